"""A GPU that draws as the original 3D Gaussian Splatting code does, as bytes and a roofline (docs/traffic.md).

Nothing here is measured on a GPU: each number is that code's array sizes, or an assumption that is named as one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from golden.timing.tiles16 import SIDE

# Orin AGX
BANDWIDTH = 204.8e9  # bytes a second
EFFICIENCY = 0.8  # share of it that streaming kernels reach: assumed
LANES = 2048
CLOCK = 1.3e9  # Hz
INSTRUCTIONS = 30  # a lane spends on one Gaussian at one pixel, skipped ones included: assumed

# Preprocess, bytes: float32 throughout
POSITION = 12
LISTED = 8  # written for every Gaussian: radius, number of tiles
GEOMETRY = 32  # read of a visible one: scale 12, rotation 16, opacity 4
PROJECTED = 64  # written: mean 8, depth 4, covariance 24, conic and opacity 16, colour 12

# Sort: 64-bit keys {tile, depth} with 32-bit values, radix passes of 8 bits
PAIR = 12
KEY = 8  # read twice more: digits' histogram, tiles' ranges
DEPTH_BITS = 32
DIGIT_BITS = 8

# Raster
VALUE = 4  # read of every entry
FEATURE = 36  # mean 8, conic and opacity 16, colour 12
MISSES = 0.25  # of features in the L2 cache: assumed
PIXEL = 20  # written: colour 12, transmittance 4, last contributor 4


@dataclass(frozen=True)
class GpuFrame:
    bytes: dict[str, dict[str, int]]  # stage -> read, write
    seconds: dict[str, float]  # of each stage; the kernels run one behind the other


def radix_passes(tiles: int) -> int:
    """Passes over keys of DEPTH_BITS and a tile number."""
    return -(-(DEPTH_BITS + max(tiles - 1, 0).bit_length()) // DIGIT_BITS)


def frame(n: int, degree: int, visible: int, entries: int, width: int, height: int, worked: float) -> GpuFrame:
    """One frame of n Gaussians.

    entries: pairs of a Gaussian and a 16-pixel tile (tiles16.boxes(...).square); worked: share of the pairs that are
    not behind their tile's end, here scu_ops / pairs of the frame's RasterResult.
    """
    harmonics = 12 * (degree + 1) ** 2
    passes = radix_passes(math.ceil(width / SIDE) * math.ceil(height / SIDE))
    moved = {
        "preprocess": {
            "read": n * POSITION + visible * (GEOMETRY + harmonics),
            "write": n * LISTED + visible * PROJECTED,
        },
        "sorting": {"read": entries * (2 * KEY + passes * PAIR), "write": entries * PAIR * (1 + passes)},
        "raster": {"read": round(entries * (VALUE + MISSES * FEATURE)), "write": width * height * PIXEL},
    }
    seconds = {stage: (b["read"] + b["write"]) / (BANDWIDTH * EFFICIENCY) for stage, b in moved.items()}
    work = entries * worked * SIDE**2 * INSTRUCTIONS / (LANES * CLOCK)
    seconds["raster"] = max(seconds["raster"], work)
    return GpuFrame(moved, seconds)
