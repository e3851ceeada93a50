"""gs_group_test_unit: which of a group's four subtiles a Gaussian touches (docs/architecture.md, section 5).

The same predicate decides which tiles list a Gaussian (preprocess) and which entries stay valid (raster core).
"""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.formats import Formats
from golden.raster_core import ellipse_setup, row_reach, span_finder
from golden.raster_core.ellipse_setup import corner
from golden.raster_core.intersection_test_unit import UNIT_LATENCY, hit
from golden.raster_core.row_reach import limit, reach, step
from golden.raster_core.span_finder import NOTHING, slope, upper

LATENCY = ellipse_setup.LATENCY - 1 + row_reach.LATENCY + span_finder.LATENCY + UNIT_LATENCY  # v is early by one
SLACK = 13  # codes of EDGE_F by which the lower end of a span is lowered (docs/raster_core/group_test_unit.md)


@numba.njit(inline="always", cache=True)
def column(f: Formats, a):
    """8a, UQ4.EDGE_F, floor: the step from a subtile to the next, from a in record codes."""
    return a >> (f.chol_f - f.edge_f - 3)


@numba.njit(inline="always", cache=True)
def ends(f: Formats, a, u, right, left):
    """(low, high) of the columns spanned, from the reaches to the right and left of u = 0. SQ8.EDGE_F."""
    wide = column(f, a)
    return -left - u - (wide - (wide >> 3)) - SLACK, right - u


@numba.njit(cache=True)
def span(f: Formats, u, v, a, b, c, most):
    """(low, high): columns of a group that the ellipse spans in its rows; low > high + 24a if none."""
    right = left = NOTHING << f.edge_f
    for j in range(params.SUBTILE):
        row = upper(f, reach(f, v + step(f, c, j), most))
        right = max(right, row - j * slope(f, b))
        left = max(left, row + j * slope(f, b))
    return ends(f, a, u, right, left)


@numba.njit(cache=True)
def group_hits(f: Formats, a, b, c, mean_x, mean_y, opacity, x, y, width, height):
    """Bit s: subtile s of the group at pixel (x, y) is hit. Footprint, mean and opacity in record codes."""
    u, high, low, far = corner(f, a, b, c, mean_x, mean_y, x, y)
    if far or y >= height:
        return 0
    low, high = span(f, u, high + low, a, b, c, limit(f, opacity))
    hits = 0
    for unit in range(params.UNITS):
        if x + unit * params.SUBTILE < width and hit(unit * column(f, a), low, high):
            hits |= 1 << unit
    return hits


@numba.njit(cache=True)
def tile_bitmap(f: Formats, a, b, c, mean_x, mean_y, opacity, x0, y0, width, height):
    """64-bit bitmap (uint64, bit 8*row + column) of the subtiles of the tile at pixel (x0, y0) that are hit.

    Subtiles whose origin lies outside the width x height picture are never hit.
    """
    bits = np.uint64(0)
    side = params.TILE // params.SUBTILE
    for group in range(params.GROUPS):
        x = x0 + (group & 1) * params.UNITS * params.SUBTILE
        y = y0 + (group >> 1) * params.SUBTILE
        hits = group_hits(f, a, b, c, mean_x, mean_y, opacity, x, y, width, height)
        bits |= np.uint64(hits) << np.uint64((group >> 1) * side + (group & 1) * params.UNITS)
    return bits
