"""gs_group_tester: the subtiles of a tile that each entry of a batch hits, group by group, and the lists of hits."""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.formats import Formats
from golden.raster_core import bounds, group_test_unit
from golden.raster_core.ellipse_setup import setup
from golden.raster_core.intersection_test_unit import bound, squared

SIDE = params.TILE // params.SUBTILE  # subtiles along a tile's side
LATENCY = 1 + group_test_unit.LATENCY  # cycles from the read of a geometry to its hits


@numba.njit(inline="always")
def _least(low, high):
    """Smallest |x| for x in low .. high."""
    return low if low > 0 else (-high if high < 0 else 0)


@numba.njit(cache=True, error_model="numpy")
def tile_bits(f: Formats, a, b, c, mean_x, mean_y, opacity, x0, y0, width, height):
    """intersection_test_unit.tile_bitmap, faster: rows and groups that cannot be hit are skipped; or f.bound's test."""
    if f.bound:
        return bounds.tile_bits(f, a, b, c, mean_x, mean_y, opacity, x0, y0, width, height)
    bits = np.uint64(0)
    limit = bound(f, opacity)
    if limit < 0:
        return bits
    edge = (params.SUBTILE - 1) * a
    for row in range(SIDE):
        y = y0 + row * params.SUBTILE
        if y >= height:
            break
        for half in range(SIDE // params.UNITS):
            x = x0 + half * params.UNITS * params.SUBTILE
            if x >= width:
                break
            u0, v0 = setup(f, a, b, c, mean_x, mean_y, x, y)
            v_least = squared(f, _least(v0, v0 + (params.SUBTILE - 1) * c))
            if v_least > limit:
                break
            slant = (params.SUBTILE - 1) * b
            low = u0 + min(slant, 0)
            high = u0 + max(slant, 0) + (params.UNITS * params.SUBTILE - 1) * a
            if v_least + squared(f, _least(low, high)) > limit:
                continue
            hits = 0
            for j in range(params.SUBTILE):
                room = limit - squared(f, abs(v0 + j * c))
                if room >= 0:
                    for unit in range(params.UNITS):
                        left = u0 + unit * params.SUBTILE * a + j * b
                        hits |= int(squared(f, _least(left, left + edge)) <= room) << unit
            live = min(params.UNITS, (width - x + params.SUBTILE - 1) // params.SUBTILE)
            hits &= (1 << live) - 1
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
