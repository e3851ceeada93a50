"""gs_group_tester: the subtiles of a tile that each entry of a batch hits, group by group, and the lists of hits."""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.formats import Formats
from golden.raster_core import bounds, group_test_unit
from golden.raster_core.ellipse_setup import corner
from golden.raster_core.group_test_unit import column, ends
from golden.raster_core.intersection_test_unit import hit
from golden.raster_core.row_reach import EMPTY, limit, reach, step
from golden.raster_core.span_finder import NOTHING, slope, upper

SIDE = params.TILE // params.SUBTILE  # subtiles along a tile's side
LATENCY = 1 + group_test_unit.LATENCY  # cycles from the read of a geometry to its hits


@numba.njit(cache=True)
def fast_hits(f: Formats, a, b, c, mean_x, mean_y, most, x, y, width):
    """group_test_unit.group_hits with the limit given and y inside the picture, faster where nothing is hit."""
    u, v, v_low, far = corner(f, a, b, c, mean_x, mean_y, x, y)
    if far:
        return 0
    v += v_low
    last = v + step(f, c, params.SUBTILE - 1)
    widest = reach(f, v if v > 0 else min(last, 0), most)
    if widest == EMPTY:
        return 0
    slant = (params.SUBTILE - 1) * slope(f, b)
    wide = column(f, a)
    low, high = ends(f, a, u, upper(f, widest) - min(slant, 0), upper(f, widest) + max(slant, 0))
    if high < 0 or low > (params.UNITS - 1) * wide:
        return 0
    right = left = NOTHING << f.edge_f
    for j in range(params.SUBTILE):
        row = reach(f, v + step(f, c, j), most)
        if row != EMPTY:
            right = max(right, upper(f, row) - j * slope(f, b))
            left = max(left, upper(f, row) + j * slope(f, b))
    low, high = ends(f, a, u, right, left)
    hits = 0
    for unit in range(min(params.UNITS, (width - x + params.SUBTILE - 1) // params.SUBTILE)):
        hits |= int(hit(unit * wide, low, high)) << unit
    return hits


@numba.njit(cache=True, error_model="numpy")
def tile_bits(f: Formats, a, b, c, mean_x, mean_y, opacity, x0, y0, width, height):
    """group_test_unit.tile_bitmap, faster; or f.bound's test."""
    if f.bound:
        return bounds.tile_bits(f, a, b, c, mean_x, mean_y, opacity, x0, y0, width, height)
    bits = np.uint64(0)
    most = limit(f, opacity)
    for row in range(SIDE if most >= 0 else 0):
        y = y0 + row * params.SUBTILE
        if y >= height:
            break
        for half in range(SIDE // params.UNITS):
            x = x0 + half * params.UNITS * params.SUBTILE
            if x < width:
                hits = fast_hits(f, a, b, c, mean_x, mean_y, most, x, y, width)
                bits |= np.uint64(hits) << np.uint64(row * SIDE + half * params.UNITS)
    return bits


def group_hits(bitmaps: np.ndarray) -> np.ndarray:
    """[n] uint64 bitmaps -> [GROUPS, n] int64: bit s tells whether unit s of the group is hit."""
    shifts = np.arange(params.GROUPS, dtype=np.uint64)[:, None] * np.uint64(params.UNITS)
    return ((bitmaps[None, :] >> shifts) & np.uint64((1 << params.UNITS) - 1)).astype(np.int64)


def lists(hits: np.ndarray) -> list[list[int]]:
    """[n] hits of a group -> the slots that each unit lists."""
    return [np.flatnonzero(hits >> unit & 1).tolist() for unit in range(params.UNITS)]


@numba.njit(inline="always", cache=True)
def group_end(free, n):
    """Cycle of a group's last read, when the tester, the batch and the set of lists are free from cycle `free` on.

    The group starts there, and reads one slot a cycle from the next cycle on. Its hits follow LATENCY later.
    """
    return free + n
