"""Which subtiles a pixel needs, by the blend unit's own test: what every intersection test is judged by."""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.cameras.camera import Camera
from golden.formats import Formats
from golden.preprocess import Features, Pairs
from golden.raster_core import power_unit


@numba.njit(cache=True)
def _needed(f, mean, chol, opacity, origins):
    bits = np.zeros(len(opacity), np.uint64)
    for n in range(len(opacity)):
        x0, y0 = origins[n]
        for s in range(params.SUBTILES):
            x, y = x0 + params.SUBTILE * (s & 7), y0 + params.SUBTILE * (s >> 3)
            p = power_unit.powers(f, mean[n, 0], mean[n, 1], chol[n, 0], chol[n, 1], chol[n, 2], opacity[n], x, y)
            if p.min() <= f.cut:
                bits[n] |= np.uint64(1) << np.uint64(s)
    return bits


def needed(f: Formats, features: Features, origins) -> np.ndarray:
    """[N] uint64: bit 8*row + column of each subtile of the tile at origins [N, 2] in which a pixel is blended."""
    columns = (np.ascontiguousarray(a, np.int64) for a in (features.mean, features.chol, features.opacity))
    return _needed(f, *columns, np.broadcast_to(np.asarray(origins, np.int64), (len(features.opacity), 2)))


def bits_set(bitmaps: np.ndarray) -> int:
    """Ones in all of them."""
    return int(np.bitwise_count(bitmaps).sum())


def one_a_tile(n: int, columns: int = 16) -> tuple[Camera, np.ndarray, Pairs]:
    """(camera of a picture of n tiles, their origins [n, 2], lists in which tile i holds Gaussian i alone)."""
    at = np.arange(n)
    origins = np.stack([at % columns, at // columns], 1) * params.TILE
    width, height = columns * params.TILE, -(-n // columns) * params.TILE
    camera = Camera(width, height, 128.0, 128.0, width / 2, height / 2, np.eye(3), np.zeros(3))
    tiles = columns * (height // params.TILE)
    return camera, origins, Pairs(np.minimum(np.arange(tiles + 1), n).astype(np.int64), at.astype(np.int32))
