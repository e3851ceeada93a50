"""`.splat` rows (32 bytes) and Niantic's `.spz` (gzip, versions 1 to 3).

A .splat row: float32 x y z, float32 sigma x y z, bytes r g b opacity, bytes of the quaternion w x y z (128 is 0).

An .spz stream: 16-byte header (magic NGSP, version, count, SH degree, fraction bits, flags, 0), then field by field:
positions 3 x 24-bit fixed point (version 1: half floats), opacity byte, colour bytes (0.15 * f_dc + 0.5), log scale
bytes (16 steps an e-fold above -10), rotations (versions 1, 2: x y z bytes, w >= 0 follows; 3: largest of x y z w in
2 bits and the others as sign and 9 bits), SH bytes ((v - 128) / 128, coefficient by coefficient, r g b inside).
Coordinates stay as stored: .spz is by convention y up, z towards the viewer.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

from golden.errors import InputError
from golden.scene import gaussians
from golden.scene.files import check_claim, one_line, read_bytes
from golden.scene.ply import with_largest

SPLAT_ROW = np.dtype([("mean", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("quat", "u1", 4)])
SPZ_MAGIC = b"NGSP"
SPZ_HEADER = 16
SPZ_COEFFICIENTS = (0, 3, 8, 15, 24)  # above the constant one, by degree
SPZ_COLOUR = 0.15
FLAG_ANTIALIAS, FLAG_EXTENSIONS = 1, 2


@np.errstate(invalid="ignore")  # a signalling NaN is not finite and its row dropped
def read_splat(path: Path, source: str) -> gaussians.Gaussians:
    data = read_bytes(path)
    rows, over = divmod(len(data), SPLAT_ROW.itemsize)
    if over:
        raise InputError(
            f"{path}: {len(data)} bytes are {rows} rows of {SPLAT_ROW.itemsize} and {over} more;"
            " the file is truncated or not .splat"
        )
    row = np.frombuffer(data, SPLAT_ROW)
    means, scales = row["mean"].astype(np.float64), row["scale"].astype(np.float64)
    gaussians.check_float32_positions(str(path), row["mean"], scales)
    rgba = row["rgba"] / 255.0
    sh = ((rgba[:, :3] - 0.5) / gaussians.SH_C0)[:, None, :]
    quats = (row["quat"].astype(np.float64) - 128) / 128
    return gaussians.checked(path.stem, means, scales, quats, rgba[:, 3], sh, source=source)


def inflate(path: Path, data: bytes, limit: int) -> bytes:
    """The first `limit` bytes of a gzip stream, fewer where it ends; never allocates more."""
    stream = zlib.decompressobj(wbits=16 + zlib.MAX_WBITS)
    try:
        out = stream.decompress(data, limit)
    except zlib.error as error:
        raise InputError(f"{path}: the gzip stream is broken ({one_line(error)})") from error
    if len(out) < limit and not stream.eof:
        raise InputError(f"{path}: the gzip stream ends after {len(out)} bytes, the file is truncated")
    return out


def read_spz(path: Path, source: str) -> gaussians.Gaussians:
    data = read_bytes(path)
    packed = data[:2] == b"\x1f\x8b"
    head = inflate(path, data, SPZ_HEADER) if packed else data[:SPZ_HEADER]
    if head[:4] != SPZ_MAGIC[: len(head)] or not head:
        raise InputError(f"{path}: starts with {head[:4]!r}, gzip of 'NGSP' is needed")
    if len(head) < SPZ_HEADER:
        raise InputError(f"{path}: the header has {len(head)} bytes, {SPZ_HEADER} are needed; the file is truncated")
    _, version, n, degree, fraction, flags, _ = struct.unpack("<4sIIBBBB", head)
    if version not in (1, 2, 3):
        raise InputError(f"{path}: field 'version' is {version}, 1 to 3 are read")
    if degree >= len(SPZ_COEFFICIENTS):
        raise InputError(f"{path}: field 'shDegree' is {degree}, 0 to {len(SPZ_COEFFICIENTS) - 1} are read")
    if fraction > 24:
        raise InputError(f"{path}: field 'fractionalBits' is {fraction}, 0 to 24 are read")
    if flags & FLAG_EXTENSIONS:
        raise InputError(f"{path}: field 'flags' is {flags:#x}: extensions are not read, write the file without them")
    check_claim(str(path), n, len(data))
    rest = SPZ_COEFFICIENTS[degree]
    sizes = dict(position=6 if version == 1 else 9, opacity=1, colour=3, scale=3, quat=4 if version == 3 else 3)
    sizes["sh"] = 3 * rest
    need = SPZ_HEADER + n * sum(sizes.values())
    body = inflate(path, data, need + 1) if packed else data
    if len(body) != need:
        found = f"more than {need}" if len(body) > need else str(len(body))
        raise InputError(f"{path}: {n} Gaussians of degree {degree} need {need} bytes, the stream has {found}")
    fields, at = {}, SPZ_HEADER
    for name, width in sizes.items():
        fields[name] = np.frombuffer(body, np.uint8, n * width, at).reshape(n, width)
        at += n * width

    if version == 1:
        means = fields["position"].copy().view("<f2").astype(np.float64)
    else:
        parts = fields["position"].reshape(n, 3, 3).astype(np.int64)
        codes = parts[:, :, 0] | parts[:, :, 1] << 8 | parts[:, :, 2] << 16
        means = (codes - ((codes & 0x800000) << 1)) * 2.0**-fraction
    sh = np.empty((n, 1 + rest, 3), np.float32)
    sh[:, 0] = (fields["colour"] / 255.0 - 0.5) / SPZ_COLOUR
    sh[:, 1:] = (fields["sh"].reshape(n, rest, 3).astype(np.float32) - 128) / 128
    if version == 3:
        words = fields["quat"].copy().view("<u4")[:, 0]
        thirds = [(words >> np.uint32(low)) & np.uint32(0x3FF) for low in (20, 10, 0)]
        smallest = np.stack([(t & 0x1FF) / 511 * np.sqrt(0.5) * np.where(t & 0x200, -1, 1) for t in thirds], axis=1)
        xyzw = with_largest(smallest, (words >> np.uint32(30)).astype(np.int64))
    else:
        xyz = fields["quat"] / 127.5 - 1
        xyzw = np.concatenate([xyz, np.sqrt(np.maximum(0, 1 - (xyz**2).sum(axis=1, keepdims=True)))], axis=1)
    counters: dict[str, int] = {}
    return gaussians.checked(
        path.stem,
        means,
        np.exp(fields["scale"] / 16.0 - 10),
        np.roll(xyzw, 1, axis=1),
        fields["opacity"][:, 0] / 255.0,
        gaussians.limit_bands(sh, counters),
        bool(flags & FLAG_ANTIALIAS),
        source,
        counters,
    )
