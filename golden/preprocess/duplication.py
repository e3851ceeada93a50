"""Duplication: for each tile the Gaussians that touch it, by the predicate of the intersection test.

A tile lists a Gaussian when golden.raster_core.group_test_unit.tile_bitmap is not zero. Asking that of all tiles
would cost 16 group tests each, so the tiles are narrowed down in real arithmetic first, on an ellipse grown by more
than everything the codes round or truncate; then the groups are tested from the row where the form is smallest, and the
first hit decides (docs/preprocess.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba
import numpy as np

from golden import params
from golden.formats import Formats
from golden.preprocess.encode import Features
from golden.raster_core import bounds
from golden.raster_core.group_tester import fast_hits
from golden.raster_core.row_reach import limit

_HALF = params.UNITS * params.SUBTILE  # pixels set up at once: a group of four subtiles
# The test takes |v| for up to 1.2 and the reach for up to 1.9 codes of ITU_F too small or large (group_finder.md). In
# such codes; more than twice what that adds to the radius, so that the rounding of real arithmetic cannot matter.
_SLACK = 5.0
_BLOCKS = 256  # Gaussians are counted and filled in this many runs


@dataclass(frozen=True)
class Pairs:
    """Tile t (row-major) lists index[tile_offsets[t] : tile_offsets[t + 1]], ascending."""

    tile_offsets: np.ndarray  # [T + 1] int64
    index: np.ndarray  # [P] int32


def tile_grid(width: int, height: int) -> tuple[int, int]:
    """(columns, rows) of tiles over a picture."""
    return -(-width // params.TILE), -(-height // params.TILE)


def duplicate(f: Formats, features: Features, width: int, height: int) -> Pairs:
    """Every (tile, visible Gaussian) whose bitmap is not empty in a width x height picture."""
    columns, rows = tile_grid(width, height)
    n = len(features.visible)
    boxes = np.empty((n, 4), np.int16)
    area = np.empty(n, np.int64)
    _boxes(f, features.mean, features.chol, features.opacity, features.visible, columns, rows, boxes, area)
    start = np.concatenate((np.zeros(1, np.int64), np.cumsum(area)))
    hits = np.empty(start[-1], np.bool_)
    counts = np.zeros((_BLOCKS, columns * rows), np.int64)
    _test(f, features.mean, features.chol, features.opacity, (width, height, columns), boxes, start, hits, counts)
    totals = counts.sum(axis=0)
    tile_offsets = np.concatenate((np.zeros(1, np.int64), np.cumsum(totals)))
    counts = np.cumsum(counts, axis=0) - counts + tile_offsets[:-1]
    index = np.empty(tile_offsets[-1], np.int32)
    _fill(columns, boxes, start, hits, counts, index)
    return Pairs(tile_offsets, index)


@numba.njit(inline="always", cache=True)
def _real(f: Formats, chol, opacity, i):
    """(a, b, c, radius): the footprint in real numbers and the largest sqrt(u^2 + v^2), grown; radius < 0: no pixel."""
    most = limit(f, opacity[i])
    if most < 0:
        return 0.0, 0.0, 0.0, -1.0
    radius = (math.sqrt(most) + _SLACK) / (1 << f.itu_f)
    step = 1.0 / (1 << f.chol_f)
    return chol[i, 0] * step, chol[i, 1] * step, chol[i, 2] * step, radius


@numba.njit(parallel=True, cache=True, error_model="numpy")
def _boxes(f: Formats, mean, chol, opacity, visible, columns, rows, boxes, area):
    """Tiles of the bounding box of each grown ellipse: first column, first row, end column, end row; and how many."""
    for i in numba.prange(len(visible)):
        boxes[i] = 0
        area[i] = 0
        if not visible[i]:
            continue
        if f.bound:
            half_x, half_y = bounds.shape(f, chol[i, 0], chol[i, 1], chol[i, 2], opacity[i])[:2]
            radius = half_x
        else:
            a, b, c, radius = _real(f, chol, opacity, i)
            # a or c of zero makes these infinite, 0 / 0 NaN: both mean "everywhere"
            half_x, half_y = radius * math.sqrt(b * b + c * c) / (a * c), radius / c
        if radius < 0:
            continue
        everywhere = 2.0 * params.TILE * max(columns, rows) + 2.0 * (1 << (f.mean_w - f.mean_f))
        half_x = half_x if half_x < everywhere else everywhere
        half_y = half_y if half_y < everywhere else everywhere
        x = mean[i, 0] / (1 << f.mean_f)
        y = mean[i, 1] / (1 << f.mean_f)
        left = max(math.floor((x - half_x) / params.TILE), 0.0)
        right = min(math.floor((x + half_x) / params.TILE) + 1, float(columns))
        top = max(math.floor((y - half_y) / params.TILE), 0.0)
        bottom = min(math.floor((y + half_y) / params.TILE) + 1, float(rows))
        if left < right and top < bottom:
            boxes[i, 0], boxes[i, 1], boxes[i, 2], boxes[i, 3] = int(left), int(top), int(right), int(bottom)
            area[i] = int(right - left) * int(bottom - top)


@numba.njit(inline="always", cache=True)
def _block(k, n):
    """(first, end) Gaussian of block k."""
    return k * n // _BLOCKS, (k + 1) * n // _BLOCKS


@numba.njit(parallel=True, cache=True)
def _test(f: Formats, mean, chol, opacity, size, boxes, start, hits, counts):
    width, height, columns = size
    n = len(opacity)
    for k in numba.prange(_BLOCKS):
        first, end = _block(k, n)
        for i in range(first, end):
            at = start[i]
            for row in range(boxes[i, 1], boxes[i, 3]):
                for column in range(boxes[i, 0], boxes[i, 2]):
                    hit = _touches(f, mean, chol, opacity, i, column * params.TILE, row * params.TILE, width, height)
                    hits[at] = hit
                    at += 1
                    if hit:
                        counts[k, row * columns + column] += 1


@numba.njit(parallel=True, cache=True)
def _fill(columns, boxes, start, hits, cursors, index):
    n = len(boxes)
    for k in numba.prange(_BLOCKS):
        first, end = _block(k, n)
        for i in range(first, end):
            at = start[i]
            for row in range(boxes[i, 1], boxes[i, 3]):
                for column in range(boxes[i, 0], boxes[i, 2]):
                    if hits[at]:
                        tile = row * columns + column
                        index[cursors[k, tile]] = i
                        cursors[k, tile] += 1
                    at += 1


@numba.njit(inline="always", cache=True)
def _clamp(x, low, high):
    return min(max(x, low), high)


@numba.njit(cache=True, error_model="numpy")
def _nearest(a, b, c, left, right, top, bottom):
    """(smallest u^2 + v^2 over a rectangle around the mean, its dy): a convex form, so inside or on a facing edge."""
    x, y = _clamp(0.0, left, right), _clamp(0.0, top, bottom)
    best, row = np.inf, y
    if x != 0 or y == 0:
        dy = _clamp(-a * b * x / (b * b + c * c), top, bottom) if b * b + c * c > 0 else y
        best, row = (a * x + b * dy) ** 2 + (c * dy) ** 2, dy
    if y != 0:
        dx = _clamp(-b * y / a, left, right) if a > 0 else x
        form = (a * dx + b * y) ** 2 + (c * y) ** 2
        if form < best:
            best, row = form, y
    return best, row


@numba.njit(cache=True)
def _touches(f: Formats, mean, chol, opacity, i, x0, y0, width, height):
    """group_tester.tile_bits(...) != 0 of Gaussian i and the tile at pixel (x0, y0)."""
    mean_x, mean_y = np.int64(mean[i, 0]), np.int64(mean[i, 1])
    if f.bound:
        a, b, c, o = np.int64(chol[i, 0]), np.int64(chol[i, 1]), np.int64(chol[i, 2]), np.int64(opacity[i])
        return bounds.tile_bits(f, a, b, c, mean_x, mean_y, o, x0, y0, width, height) != 0
    columns = min(params.TILE, -(-(width - x0) // params.SUBTILE) * params.SUBTILE)  # pixels of live subtiles
    rows = min(params.TILE, -(-(height - y0) // params.SUBTILE) * params.SUBTILE)
    real_a, real_b, real_c, radius = _real(f, chol, opacity, i)
    left = x0 + 0.5 - mean_x / (1 << f.mean_f)
    top = y0 + 0.5 - mean_y / (1 << f.mean_f)
    form, dy = _nearest(real_a, real_b, real_c, left, left + columns - 1, top, top + rows - 1)
    if form > radius * radius:
        return False
    guess = int(_clamp(math.floor(dy - top + 0.5), 0.0, rows - 1.0)) // params.SUBTILE
    rows //= params.SUBTILE
    most = limit(f, np.int64(opacity[i]))
    a, b, c = np.int64(chol[i, 0]), np.int64(chol[i, 1]), np.int64(chol[i, 2])
    for at in range(2 * rows):  # guess, guess + 1, guess - 1, guess + 2, ...
        row = guess + ((at + 1) >> 1 if at & 1 else -(at >> 1))
        for x in range(x0, x0 + columns if 0 <= row < rows else x0, _HALF):
            if fast_hits(f, a, b, c, mean_x, mean_y, most, x, y0 + row * params.SUBTILE, width):
                return True
    return False
