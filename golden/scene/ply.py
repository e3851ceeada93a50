"""PLY files: rows of the original 3DGS (INRIA), and the chunked `.compressed.ply` of PlayCanvas and SuperSplat.

INRIA rows: x y z, f_dc_0..2, f_rest_* (channel by channel), opacity (logit), scale_0..2 (log), rot_0..3 (w x y z).
Compressed: chunks of 256 rows share a box; position and scale are 11-10-11 bits in it, the colour 8-8-8 with the
opacity in the lowest byte, the quaternion 2 bits for the largest part and 3 x 10 bits; optional bytes of SH.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import plyfile

from golden.errors import InputError
from golden.scene import gaussians
from golden.scene.files import one_line, require_file

TYPE_BYTES = dict(char=1, uchar=1, int8=1, uint8=1, short=2, ushort=2, int16=2, uint16=2)
TYPE_BYTES |= dict(int=4, uint=4, int32=4, uint32=4, float=4, float32=4, double=8, float64=8)
HEADER_LIMIT = 1 << 20
CHUNK = 256  # rows that share a box in a compressed file
REST_COUNTS = (0, 9, 24, 45, 72)  # f_rest properties of degrees 0 to 4
INRIA = ("x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", *(f"scale_{i}" for i in range(3)))
INRIA += tuple(f"rot_{i}" for i in range(4))
PACKED = ("packed_position", "packed_rotation", "packed_scale", "packed_color")


@np.errstate(over="ignore", invalid="ignore")  # what overflows is not finite and its row dropped
def read(path: Path, source: str) -> gaussians.Gaussians:
    size = require_file(path)
    check_header(path, size)
    try:
        ply = plyfile.PlyData.read(str(path), mmap="r")
        elements = {e.name: e.data for e in ply.elements}
    except Exception as error:  # plyfile has no common base class for what a broken body raises
        raise InputError(f"{path}: is not readable as PLY ({one_line(error)})") from error
    comments = [*ply.comments, *(c for e in ply.elements for c in e.comments)]
    name = path.name.removesuffix(".ply").removesuffix(".compressed")
    if "vertex" not in elements:
        raise InputError(f"{path}: element 'vertex' is missing, found {', '.join(elements) or 'none'}")
    decode = compressed if "packed_position" in (elements["vertex"].dtype.names or ()) else inria
    return decode(path, elements, name, antialias_of(comments), source)


def check_header(path: Path, size: int) -> None:
    """Element counts against the file's size, before anything is allocated; messages that name the line."""
    with path.open("rb") as file:
        head = file.read(HEADER_LIMIT)
    match = re.search(rb"(?:^|[\r\n])end_header[ \t]*(?:\r\n|\n|\r)", head)
    if not re.match(rb"ply\s*[\r\n]", head):
        raise InputError(f"{path}: starts with {head[:4]!r}, a PLY file starts with the line 'ply'")
    if match is None:
        raise InputError(f"{path}: the header has no line 'end_header', the file is truncated or not PLY")
    text, elements = False, []  # [name, rows, least bytes a row, has a list]
    for at, raw in enumerate(re.split(rb"\r\n|\n|\r", head[: match.start()]), start=1):
        words = raw.decode("latin-1").split()
        if words[:1] == ["format"]:
            text = words[1:2] == ["ascii"]
        elif words[:1] == ["element"]:
            if len(words) != 3 or not re.fullmatch(r"[0-9]{1,18}", words[2]):
                raise InputError(f"{path}: line {at} is '{one_line(' '.join(words))}', 'element NAME COUNT' is needed")
            elements.append([words[1], int(words[2]), 0, False])
        elif words[:1] == ["property"] and elements:
            kind = (words[2:3] if words[1:2] == ["list"] else words[1:2]) or [""]
            if kind[0] not in TYPE_BYTES:
                known = ", ".join(TYPE_BYTES)
                raise InputError(f"{path}: line {at}: type '{one_line(kind[0])}' is unknown, one of {known} is needed")
            elements[-1][2] += 2 if text else TYPE_BYTES[kind[0]]
            elements[-1][3] |= words[1] == "list"
            if elements[-1][3] and elements[-1][0] in ("vertex", "chunk", "sh"):
                raise InputError(f"{path}: line {at}: a list in element '{elements[-1][0]}', only scalars are read")
    check_rows(path, elements, size - match.end(), match.end() if text else None)


def check_rows(path: Path, elements: list[list], body: int, text_at: int | None) -> None:
    """Rows that the elements count against the bytes of the body, or, for text from a place on, its lines."""
    need = 0
    for name, count, row, _ in elements:
        need += count * row
        if need - (text_at is not None) > body:  # the last line of text may lack its line feed
            raise InputError(
                f"{path}: element '{one_line(name)}' claims {count} rows, up to there {need} bytes are needed and"
                f" {body} follow the header; the file is truncated or the count wrong"
            )
    rows = sum(count for _, count, _, _ in elements)
    if text_at is not None:
        spare = sum(bool(line.strip()) for line in path.read_bytes()[text_at:].splitlines()) - rows
    else:
        spare = (body - need) // max([1, *(row for _, _, row, _ in elements[-1:])])
    if spare > 0 and not any(listed for *_, listed in elements):
        raise InputError(f"{path}: {spare} rows follow the {rows} that the header counts; the count is wrong")


def antialias_of(comments: list[str]) -> bool:
    """Opacity compensation as Brush (`SplatRenderMode: mip`) and Postshot (`antialiased 1`) note it; the last wins."""
    found = False
    for comment in comments:
        words = comment.lower().replace(":", " ").split()
        if len(words) == 2 and words[0] == "splatrendermode":
            found = words[1] == "mip"
        elif len(words) == 2 and words[0] == "antialiased":
            found = words[1] == "1"
    return found


def columns(path: Path, element: str, data: np.ndarray, names: list[str] | tuple[str, ...]) -> np.ndarray:
    """[N, len(names)] of an element's properties, in the widest of their types (float32 or float64)."""
    have = data.dtype.names or ()
    for name in names:
        if name not in have:
            raise InputError(f"{path}: element '{element}' has no property '{name}', found {one_line(', '.join(have))}")
    kinds = [data.dtype[name] for name in names]
    wide = np.float32 if all(k == np.float32 or (k.kind in "iu" and k.itemsize < 4) for k in kinds) else np.float64
    out = np.empty((len(data), len(names)), wide)
    for k, name in enumerate(names):
        out[:, k] = data[name]
    return out


def rest_names(path: Path, element: str, data: np.ndarray) -> list[str]:
    count = sum(bool(re.fullmatch(r"f_rest_\d+", n)) for n in data.dtype.names or ())
    if count not in REST_COUNTS:
        raise InputError(f"{path}: element '{element}' has {count} properties f_rest_*, 0, 9, 24, 45 or 72 are needed")
    return [f"f_rest_{k}" for k in range(count)]


def harmonics(dc: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """dc [N, 3] and rest [N, 3 * (K - 1)] (channel by channel) to [N, K, 3] float32."""
    n = len(dc)
    sh = np.empty((n, 1 + rest.shape[1] // 3, 3), np.float32)
    sh[:, 0] = dc
    sh[:, 1:] = rest.reshape(n, 3, sh.shape[1] - 1).transpose(0, 2, 1)
    return sh


def inria(path: Path, elements: dict[str, np.ndarray], name: str, antialias: bool, source: str) -> gaussians.Gaussians:
    data = elements["vertex"]
    columns(path, "vertex", data[:0], INRIA)  # names every missing property before any work
    rest = columns(path, "vertex", data, rest_names(path, "vertex", data))
    means = columns(path, "vertex", data, INRIA[:3])
    scales = gaussians.exp_scales(columns(path, "vertex", data, INRIA[7:10]))
    opacity = columns(path, "vertex", data, INRIA[6:7])[:, 0]
    quats = columns(path, "vertex", data, INRIA[10:14])
    counters: dict[str, int] = {}
    sh = gaussians.limit_bands(harmonics(columns(path, "vertex", data, INRIA[3:6]), rest), counters)
    if means.dtype == np.float32:
        gaussians.check_float32_positions(str(path), means, scales)
    opacity = gaussians.sigmoid(opacity)
    return gaussians.checked(name, means, scales, quats, opacity, sh, antialias, source, counters)


def bits(words: np.ndarray, low: int, width: int) -> np.ndarray:
    """Field of uint32 words as a fraction of its full range, float64 0..1."""
    mask = (1 << width) - 1
    return ((words >> np.uint32(low)) & np.uint32(mask)) / mask


def compressed(
    path: Path, elements: dict[str, np.ndarray], name: str, antialias: bool, source: str
) -> gaussians.Gaussians:
    if "chunk" not in elements:
        raise InputError(f"{path}: packed rows without element 'chunk'")
    data, chunks = elements["vertex"], elements["chunk"]
    n = len(data)
    if len(chunks) != -(-n // CHUNK):
        raise InputError(f"{path}: {len(chunks)} chunks for {n} rows, {-(-n // CHUNK)} are needed (one per {CHUNK})")
    for field in PACKED:
        if field not in (data.dtype.names or ()):
            raise InputError(f"{path}: element 'vertex' has no property '{field}'")
        if data.dtype[field].itemsize != 4 or data.dtype[field].kind != "u":
            raise InputError(f"{path}: property '{field}' is {data.dtype[field]}, uint is needed")
    position, rotation, scale, colour = (np.ascontiguousarray(data[f], np.uint32) for f in PACKED)
    of_chunk = np.arange(n) // CHUNK

    def in_box(parts: list[np.ndarray], prefix: str, axes: str) -> np.ndarray:
        low = columns(path, "chunk", chunks, [f"min_{prefix}{a}" for a in axes]).astype(np.float64)[of_chunk]
        high = columns(path, "chunk", chunks, [f"max_{prefix}{a}" for a in axes]).astype(np.float64)[of_chunk]
        t = np.stack(parts, axis=1)
        return low * (1 - t) + high * t

    means = in_box([bits(position, 21, 11), bits(position, 11, 10), bits(position, 0, 11)], "", "xyz")
    logs = in_box([bits(scale, 21, 11), bits(scale, 11, 10), bits(scale, 0, 11)], "scale_", "xyz")
    parts = [bits(colour, low, 8) for low in (24, 16, 8)]
    boxed = "min_r" in (chunks.dtype.names or ())
    rgb = in_box(parts, "", "rgb") if boxed else np.stack(parts, axis=1)
    dc = (rgb - 0.5) / gaussians.SH_C0
    smallest = (np.stack([bits(rotation, low, 10) for low in (20, 10, 0)], axis=1) - 0.5) * np.sqrt(2)
    quats = with_largest(smallest, (rotation >> np.uint32(30)).astype(np.int64))
    rest = np.zeros((n, 0))
    if "sh" in elements:
        codes = columns(path, "sh", elements["sh"], rest_names(path, "sh", elements["sh"]))
        if len(codes) != n:
            raise InputError(f"{path}: element 'sh' has {len(codes)} rows, 'vertex' has {n}")
        level = np.where(codes == 0, 0, np.where(codes == 255, 1, (codes + 0.5) / 256))
        rest = (level - 0.5) * 8
    counters: dict[str, int] = {}
    sh = gaussians.limit_bands(harmonics(dc, rest), counters)
    scales = gaussians.exp_scales(logs)
    return gaussians.checked(name, means, scales, quats, bits(colour, 0, 8), sh, antialias, source, counters)


def with_largest(smallest: np.ndarray, largest: np.ndarray) -> np.ndarray:
    """Three parts [N, 3] in order and the place 0..3 of the dropped, largest one [N] to unit quaternions [N, 4]."""
    n = len(smallest)
    quats = np.empty((n, 4))
    places = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])[largest]
    rows = np.arange(n)
    quats[rows[:, None], places] = smallest
    quats[rows, largest] = np.sqrt(np.maximum(0, 1 - (smallest**2).sum(axis=1)))
    return quats
