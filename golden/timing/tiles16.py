"""16-pixel tiles: what GSCore and a GPU list where Neo lists 64-pixel tiles (docs/traffic.md).

`split` takes a frame's tables and bitmaps apart without a test of its own, so both tile sizes draw the same pairs.
`boxes` counts what tests on boxes would list; nothing is drawn from it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from golden import params
from golden.preprocess.projection import Projection

SIDE = 16  # pixels
ACROSS = params.TILE // SIDE
OBB_ASPECT = 2.0  # axes' ratio from which GSCore takes the oriented box


class Tiles16(NamedTuple):
    """T tiles, row-major; tile t lists entry[offsets[t] : offsets[t + 1]], in the order of the 64-pixel table."""

    offsets: np.ndarray  # int64[T + 1]
    entry: np.ndarray  # int32[E] place in the 64-pixel tables
    bits: np.ndarray  # uint8[E] bit 2*row + column of the 8-pixel subtiles hit, never 0
    pairs: np.ndarray  # int64[T] bits set: (entry, 8-pixel subtile) pairs


def split(offsets: np.ndarray, bitmaps: np.ndarray, width: int, height: int) -> Tiles16:
    """Tables of 64-pixel tiles (offsets int64[T64 + 1], bitmaps uint64[E64] bit 8*row + column) by 16-pixel tiles."""
    columns, rows = -(-width // SIDE), -(-height // SIDE)
    counts, pairs = np.zeros((2, columns * rows), np.int64)
    _count(offsets, bitmaps, width, columns, rows, counts, pairs)
    at = np.concatenate((np.zeros(1, np.int64), np.cumsum(counts)))
    entry, bits = np.empty(at[-1], np.int32), np.empty(at[-1], np.uint8)
    _fill(offsets, bitmaps, width, columns, rows, at[:-1].copy(), entry, bits)
    return Tiles16(at, entry, bits, pairs)


@numba.njit(inline="always", cache=True)
def _part(bits, row, column):
    """Four bits of the 16-pixel tile at (row, column) of a 64-pixel tile."""
    two = np.int64((bits >> np.uint64(16 * row + 2 * column)) & np.uint64(0x303))
    return (two & 3) | (two >> 6)


@numba.njit(parallel=True, cache=True)
def _count(offsets, bitmaps, width, columns, rows, counts, pairs):
    across = (width + params.TILE - 1) // params.TILE
    for tile in numba.prange(len(offsets) - 1):
        x, y = tile % across * ACROSS, tile // across * ACROSS
        for row in range(min(ACROSS, rows - y)):
            for column in range(min(ACROSS, columns - x)):
                n = hits = 0
                for e in range(offsets[tile], offsets[tile + 1]):
                    part = _part(bitmaps[e], row, column)
                    n += part != 0
                    hits += (part & 1) + (part >> 1 & 1) + (part >> 2 & 1) + (part >> 3)
                counts[(y + row) * columns + x + column] = n
                pairs[(y + row) * columns + x + column] = hits


@numba.njit(parallel=True, cache=True)
def _fill(offsets, bitmaps, width, columns, rows, cursor, entry, bits):
    across = (width + params.TILE - 1) // params.TILE
    for tile in numba.prange(len(offsets) - 1):
        x, y = tile % across * ACROSS, tile // across * ACROSS
        for row in range(min(ACROSS, rows - y)):
            for column in range(min(ACROSS, columns - x)):
                at = cursor[(y + row) * columns + x + column]
                for e in range(offsets[tile], offsets[tile + 1]):
                    part = _part(bitmaps[e], row, column)
                    if part:
                        entry[at] = e
                        bits[at] = part
                        at += 1


class Boxes(NamedTuple):
    """(Gaussian, 16-pixel tile) pairs over all visible Gaussians."""

    square: int  # the original rasteriser's: a square of ceil(3 sigma of the long axis)
    oriented: int  # GSCore's: a 3-sigma oriented box, or that square below OBB_ASPECT


def boxes(projection: Projection, width: int, height: int) -> Boxes:
    """How many entries the box tests list in a width x height picture."""
    counts = np.zeros((len(projection.visible), 2), np.int64)
    p = projection
    _boxes(p.mean2d, p.cov2d, p.det, p.visible, -(-width // SIDE), -(-height // SIDE), counts)
    return Boxes(*(int(n) for n in counts.sum(axis=0)))


@numba.njit(inline="always", cache=True)
def _clip(x, end):
    return int(min(max(x, 0.0), float(end)))


@numba.njit(inline="always", cache=True)
def _tiles(x, radius, end):
    """Tiles of 0 .. end - 1 that the original's square around x reaches in one direction."""
    return _clip(math.floor((x + radius + SIDE - 1) / SIDE), end) - _clip(math.floor((x - radius) / SIDE), end)


@numba.njit(parallel=True, cache=True, error_model="numpy")
def _boxes(mean, cov, det, visible, columns, rows, counts):
    for i in numba.prange(len(visible)):
        if not visible[i]:
            continue
        x, y = mean[i, 0], mean[i, 1]
        half, middle = 0.5 * (cov[i, 0] - cov[i, 2]), 0.5 * (cov[i, 0] + cov[i, 2])
        spread = math.sqrt(half * half + cov[i, 1] * cov[i, 1])
        long, short = math.sqrt(middle + spread), math.sqrt(det[i] / (middle + spread))
        # Square: the original rounds outwards in its own pixel coordinates, half a pixel less than ours
        radius = math.ceil(3 * math.sqrt(middle + max(spread, math.sqrt(0.1))))
        counts[i, 0] = _tiles(x - 0.5, radius, columns) * _tiles(y - 0.5, radius, rows)
        counts[i, 1] = counts[i, 0]
        if long < OBB_ASPECT * short:
            continue
        angle = 0.5 * math.atan2(cov[i, 1], half)
        ux, uy = math.cos(angle), math.sin(angle)
        a, b = 3 * long, 3 * short
        wide, tall = a * abs(ux) + b * abs(uy), a * abs(uy) + b * abs(ux)
        grown = 0.5 * SIDE * (abs(ux) + abs(uy))  # a tile's half-width along either axis of the box
        n = 0
        for row in range(_clip(math.floor((y - tall) / SIDE), rows), _clip(math.floor((y + tall) / SIDE) + 1, rows)):
            for column in range(
                _clip(math.floor((x - wide) / SIDE), columns), _clip(math.floor((x + wide) / SIDE) + 1, columns)
            ):
                dx, dy = (column + 0.5) * SIDE - x, (row + 0.5) * SIDE - y
                n += abs(dx * ux + dy * uy) <= a + grown and abs(dy * ux - dx * uy) <= b + grown
        counts[i, 1] = n
