"""SOG (Spatially Ordered Gaussians): `meta.json` beside lossless WebP images, as a folder, a `.sog` zip, or streamed.

Pixel i of every image, row by row, is Gaussian i. Version 2: positions are 16 bits in two images between mins and
maxs of sign(x) * ln(1 + |x|); scale and colour bytes index code books of 256 numbers; a quaternion is its three
smaller parts and, in alpha, 252 + the place of the largest; the opacity is the alpha of sh0; SH bands are rows of a
palette. Version 1 (no field 'version'): bytes between mins and maxs instead of code books, the opacity a logit.
Streamed: `lod-meta.json` lists chunk folders; its tree says which level of detail a chunk belongs to.
"""

from __future__ import annotations

import io
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path, PurePosixPath

import numpy as np
from PIL import Image

from golden.errors import InputError
from golden.scene import gaussians
from golden.scene.files import check_claim, member, numbers, one_line, parse_json, read_bytes, require_file
from golden.scene.ply import with_largest

PALETTE_COLUMNS = 64
BAND_COEFFICIENTS = (0, 3, 8, 15)
ZIP_RATIO = 200  # images are stored and JSON shrinks some ten times; more than this is a zip bomb
ZIP_FLOOR = 1 << 20

Loader = Callable[[str], bytes]  # name of a file beside meta.json to its bytes


def read_folder(meta: Path, name: str, source: str) -> gaussians.Gaussians:
    folder = meta.parent
    return decode(read_bytes(meta), lambda file: read_bytes(folder / file), str(meta), name, source)


def read_zip(path: Path, source: str) -> gaussians.Gaussians:
    size = require_file(path)
    try:
        with zipfile.ZipFile(path) as archive:
            infos = {i.filename: i for i in archive.infolist() if not i.is_dir()}
            metas = sorted((n for n in infos if PurePosixPath(n).name == "meta.json"), key=len)
            if not metas:
                raise InputError(f"{path}: the zip holds no meta.json, found {one_line(', '.join(infos) or 'nothing')}")
            base = metas[0].removesuffix("meta.json")
            total = sum(i.file_size for i in infos.values())
            most = max(i.compress_size for i in infos.values())
            if most > size:  # zipfile would ask for a buffer of that many
                raise InputError(f"{path}: {size} bytes claim to hold a packed file of {most}")
            if total > ZIP_FLOOR + ZIP_RATIO * size:
                raise InputError(
                    f"{path}: {size} bytes claim to unpack to {total}, more than {ZIP_RATIO} times as many"
                )

            def load(file: str) -> bytes:
                if base + file not in infos:
                    raise InputError(f"{path}: the zip holds no {base + file}, which meta.json names")
                return archive.read(infos[base + file])

            return decode(load("meta.json"), load, f"{path}/{base}meta.json", path.stem, source)
    except InputError:
        raise
    except Exception as error:  # zipfile raises a dozen kinds for broken archives
        raise InputError(f"{path}: not a readable zip ({one_line(error) or type(error).__name__})") from error


def read_streamed(meta: Path, level: int, name: str, source: str) -> gaussians.Gaussians:
    """All chunks of one level of detail in the order of `filenames`, then the environment if there is one."""
    where = str(meta)
    top = parse_json(read_bytes(meta), where)
    version = top.get("version", 1) if isinstance(top, dict) else 1
    if version != 1:
        raise InputError(f"{where}: field 'version' is {one_line(version)}, 1 is read")
    levels = member(top, "lodLevels", where, int, "the number of levels")
    files = member(top, "filenames", where, list, "a list of chunk files")
    if not 0 <= level < levels:
        raise InputError(f"{where}: @lod={level} asked, levels 0 to {levels - 1} exist")
    expected = chunk_counts(member(top, "tree", where, dict, "the spatial tree"), level, len(files), where)
    if not expected:
        raise InputError(f"{where}: the tree lists no chunk of level {level}")
    parts = []
    for index in sorted(expected):
        part = read_folder(chunk_path(meta.parent, files[index], where), name, source)
        rows = len(part) + sum(v for k, v in part.counters.items() if k.startswith("rejected_"))
        if rows != expected[index]:
            raise InputError(f"{where}: lists {expected[index]} Gaussians in {files[index]}, which holds {rows}")
        parts.append(part)
    if top.get("environment") is not None:
        parts.append(read_folder(chunk_path(meta.parent, top["environment"], where), name, source))
    return gaussians.joined(name, parts, source)


def chunk_path(folder: Path, file: object, where: str) -> Path:
    relative = PurePosixPath(file) if isinstance(file, str) and file and "\0" not in file else None
    if relative is None or relative.is_absolute() or ".." in relative.parts:
        raise InputError(f"{where}: file {one_line(repr(file))} named, a path below the folder is needed")
    return folder / relative


def chunk_counts(tree: dict, level: int, files: int, where: str) -> dict[int, int]:
    """Index into filenames -> Gaussians the tree's leaves list there for this level."""
    counts: dict[int, int] = {}
    nodes: list[object] = [tree]
    while nodes:
        node = nodes.pop()
        if not isinstance(node, dict):
            raise InputError(f"{where}: tree node is {one_line(node)}, an object is needed")
        if "children" in node:
            nodes += member(node, "children", where, list, "a list of nodes")
        if "lods" in node:
            leaf = member(node, "lods", where, dict, "an object by level").get(str(level))
            if leaf is not None:
                index = member(leaf, "file", where, int, "an index into filenames")
                if not 0 <= index < files:
                    raise InputError(f"{where}: field 'file' is {index}, 0 to {files - 1} exist")
                counts[index] = counts.get(index, 0) + member(leaf, "count", where, int, "a number of Gaussians")
    return counts


def webp_size(data: bytes, where: str) -> tuple[int, int]:
    """(width, height) that a WebP file states, without decoding."""
    if data[:4] != b"RIFF" or data[8:12] != b"WEBP":
        raise InputError(f"{where}: starts with {data[:4]!r}, a WebP image is needed")
    kind = data[12:16]
    if len(data) < (30 if kind == b"VP8X" else 25):
        raise InputError(f"{where}: {len(data)} bytes, the WebP header is truncated")
    if kind == b"VP8L":
        word = int.from_bytes(data[21:25], "little")
        return 1 + (word & 0x3FFF), 1 + (word >> 14 & 0x3FFF)
    if kind == b"VP8X":
        return 1 + int.from_bytes(data[24:27], "little"), 1 + int.from_bytes(data[27:30], "little")
    raise InputError(f"{where}: WebP chunk {kind!r} found, lossless WebP (VP8L) is needed")


def plain_name(file: object, where: str) -> str:
    if not isinstance(file, str) or not file or "/" in file or "\\" in file or "\0" in file or file == "..":
        raise InputError(f"{where}: file {one_line(repr(file))} named, the plain name of a file beside it is needed")
    return file


def image(load: Loader, file: object, where: str, fits: Callable[[int, int], str | None]) -> np.ndarray:
    """[height, width, 4] uint8 of a lossless WebP; `fits` names what is wrong with its size before it is decoded."""
    data = load(plain_name(file, where))
    where = f"{where}: {file}"
    width, height = webp_size(data, where)
    problem = fits(width, height)
    if problem:
        raise InputError(f"{where}: {width} x {height} pixels, {problem}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(io.BytesIO(data), formats=["WEBP"]) as picture:
                if picture.size != (width, height):
                    raise InputError(f"{where}: states two sizes, {width} x {height} and {picture.size}")
                return np.asarray(picture.convert("RGBA"))
    except InputError:
        raise
    except Exception as error:  # pillow raises OSError, SyntaxError, ValueError and more for broken images
        raise InputError(f"{where}: cannot be decoded ({one_line(error)})") from error


@np.errstate(over="ignore", invalid="ignore")  # what overflows is not finite and its row dropped
def decode(data: bytes, load: Loader, where: str, name: str, source: str) -> gaussians.Gaussians:
    """Gaussians of one meta.json and a way to get at the images it names."""
    meta = parse_json(data, where)
    version = member(meta, "version", where, int, "2") if isinstance(meta, dict) and "version" in meta else 1
    if version not in (1, 2):
        raise InputError(f"{where}: field 'version' is {version}, 1 and 2 are read")
    means = member(meta, "means", where, dict, "an object")
    if version == 2:
        n = member(meta, "count", where, int, "the number of Gaussians")
    else:
        n = (member(means, "shape", where, list, "[count, 3]") or [0])[0]
    if not isinstance(n, int) or not 0 <= n <= gaussians.MAX_GAUSSIANS:
        raise InputError(f"{where}: {one_line(n)} Gaussians, 0 to {gaussians.MAX_GAUSSIANS} are read")
    held: dict[str, bytes] = {}

    def once(file: str) -> bytes:
        if file not in held:
            held[file] = load(file)
        return held[file]

    for key in ("means", "quats", "scales", "sh0"):  # what is stored must be worth the claim before it is decoded
        for file in member(
            member(meta, key, where, dict, "an object"), "files", f"{where}: {key}", list, "image names"
        ):
            once(plain_name(file, f"{where}: {key}"))
    check_claim(where, n, sum(map(len, held.values())))

    def rows(section: dict, key: str, index: int) -> np.ndarray:
        """[n, 4] uint8 of an image that holds one pixel a Gaussian."""
        files = member(section, "files", f"{where}: {key}", list, "a list of image names")
        if len(files) <= index:
            raise InputError(f"{where}: {key}: {len(files)} files named, {index + 1} are needed")

        def fits(width: int, height: int) -> str | None:
            spare = 4 * (width + height)  # images are padded to whole rows, and rows to a multiple of four
            ok = n <= width * height <= n + spare or width * height <= max(4 * n, 1 << 16)
            return None if ok and n <= width * height else f"{n} Gaussians need about as many"

        return image(once, files[index], where, fits).reshape(-1, 4)[:n]

    def section(key: str) -> dict:
        return member(meta, key, where, dict, "an object")

    low, high = rows(means, "means", 0), rows(means, "means", 1)
    packed_quats = rows(section("quats"), "quats", 0)
    scale_codes = rows(section("scales"), "scales", 0)
    colour_codes = rows(section("sh0"), "sh0", 0)

    mins, maxs = (numbers(means.get(k), (3,), f"{where}: means.{k}") for k in ("mins", "maxs"))
    code = low[:, :3].astype(np.float64) + 256.0 * high[:, :3]
    logs = mins + (maxs - mins) * (code / 65535)
    positions = np.sign(logs) * np.expm1(np.abs(logs))
    quats = with_largest((packed_quats[:, :3] / 255.0 - 0.5) * np.sqrt(2), np.maximum(packed_quats[:, 3], 252) - 252)
    quats[packed_quats[:, 3] < 252] = 0  # no such place: dropped and counted as a zero quaternion
    if version == 2:
        scales = gaussians.exp_scales(codebook(section("scales"), f"{where}: scales")[scale_codes[:, :3]])
        dc = codebook(section("sh0"), f"{where}: sh0")[colour_codes[:, :3]]
        opacities = colour_codes[:, 3] / 255.0
    else:
        scales = gaussians.exp_scales(between(section("scales"), scale_codes[:, :3], f"{where}: scales"))
        colour = between(section("sh0"), colour_codes, f"{where}: sh0")
        dc, opacities = colour[:, :3], gaussians.sigmoid(colour[:, 3])
    sh = dc[:, None, :].astype(np.float32)
    if meta.get("shN") is not None:
        sh = np.concatenate([sh, palette(section("shN"), version, n, rows, once, where)], axis=1)
    antialias = meta.get("antialias") is True or meta.get("model") == "antialiased"
    return gaussians.checked(name, positions, scales, quats, opacities, sh, antialias, source)


def codebook(section: dict, where: str) -> np.ndarray:
    """[256] float64; a null in front, which old writers left, continues the book's mean step."""
    book = member(section, "codebook", where, list, "256 numbers")
    if len(book) == 256 and book[0] is None:
        tail = numbers(book[1:], (255,), f"{where}: codebook")
        return np.concatenate([[tail[0] + (tail[0] - tail[-1]) / 255], tail])
    return numbers(book, (256,), f"{where}: codebook")


def between(section: dict, codes: np.ndarray, where: str) -> np.ndarray:
    """Version 1: bytes [n, k] between the section's mins and maxs."""
    mins, maxs = (numbers(section.get(k), (codes.shape[1],), f"{where}: {k}") for k in ("mins", "maxs"))
    return mins + (maxs - mins) * (codes / 255.0)


def palette(
    section: dict, version: int, n: int, rows: Callable[[dict, str, int], np.ndarray], load: Loader, where: str
) -> np.ndarray:
    """[n, K - 1, 3] float32 of the SH bands above the constant one."""
    where = f"{where}: shN"
    files = member(section, "files", where, list, "centroids and labels")
    labels = rows(section, "shN", 1)
    labels = labels[:, 0].astype(np.int64) + 256 * labels[:, 1].astype(np.int64)
    widths = {PALETTE_COLUMNS * k: k for k in BAND_COEFFICIENTS[1:]}
    if version == 2:
        bands = member(section, "bands", where, int, "1, 2 or 3")
        if bands not in (1, 2, 3):
            raise InputError(f"{where}: field 'bands' is {bands}, 1, 2 or 3 is needed")
        widths = {PALETTE_COLUMNS * BAND_COEFFICIENTS[bands]: BAND_COEFFICIENTS[bands]}

    def fits(width: int, height: int) -> str | None:
        need = int(labels.max(initial=0)) // PALETTE_COLUMNS + 1
        if width not in widths:
            return f"a width of {' or '.join(map(str, widths))} is needed"
        return None if need <= height <= 1024 else f"{need} to 1024 rows are needed for the labels"

    centroids = image(load, files[0] if files else None, where, fits)
    coefficients = widths[centroids.shape[1]]
    entries = centroids[:, :, :3].reshape(-1, coefficients, 3)
    if version == 2:
        values = codebook(section, where).astype(np.float32)[entries]
    else:
        low, high = (float(numbers(section.get(k), (), f"{where}: {k}")) for k in ("mins", "maxs"))
        values = (low + (high - low) * (entries / 255.0)).astype(np.float32)
    return values[labels]
