"""gs_group_finder: the groups of a tile that a footprint may hit: all that it hits, and few others.

A group is 32 x 8 pixels. u and v are linear, so over a group |u| is at least its value at the centre less half of its
range, |v| likewise. What is floored on the way is less than SLACK (docs/raster_core/group_finder.md).
"""

from __future__ import annotations

import numba

from golden import params
from golden.fixed import sat_s
from golden.formats import Formats
from golden.raster_core.ellipse_setup import offset

LATENCY = 10  # cycles from in_valid to out_valid
INTERVAL = 3  # cycles between two records at least
MID_F = 8  # fraction bits of u and v at the centre of a group
NEAR_F = 4  # and of the distance in the test
SLACK = 13  # units of MID_F

_WIDE = params.UNITS * params.SUBTILE - 1  # pixels between the centres at a group's ends
_HIGH = params.SUBTILE - 1


@numba.njit(inline="always", cache=True)
def narrow(f: Formats, x):
    """Sum of products .(CHOL_F + MEAN_F) to SQ8.MID_F: floor, sat."""
    return sat_s(x >> (f.chol_f + f.mean_f - MID_F), MID_F + 9)


@numba.njit(inline="always", cache=True)
def extent(f: Formats, x):
    """Half of a range x .CHOL_F, .MID_F: rounded up, with SLACK."""
    return (x >> (f.chol_f - MID_F + 1)) + SLACK


@numba.njit(inline="always", cache=True)
def near(centre, half):
    """Square of the least |u| over a group, UQ2.NEAR_F, floor, sat, from u at its centre. ~u is |u| - 1: SLACK."""
    d = (centre if centre >= 0 else ~centre) - half
    d = min(max(d, 0) >> (MID_F - NEAR_F), (1 << (NEAR_F + 2)) - 1)
    return d * d


@numba.njit(inline="always", cache=True)
def limit(f: Formats, opacity):
    """row_reach.limit, SQ3.(2*NEAR_F), floor."""
    return (f.cut - (opacity << (f.power_f - f.opacity_f)) + f.itu_margin) >> (f.power_f - 2 * NEAR_F)


@numba.njit(cache=True)
def mask(f: Formats, a, b, c, mean_x, mean_y, opacity, x0, y0, width, height):
    """Bit g is 0 only if group_tester.tile_bits has no hit in group g of the tile at (x0, y0)."""
    dx = offset(f, x0, mean_x) + (_WIDE << (f.mean_f - 1))
    dy = offset(f, y0, mean_y) + (_HIGH << (f.mean_f - 1))
    u, v = narrow(f, a * dx + b * dy), narrow(f, c * dy)
    half_u, half_v = extent(f, _WIDE * a + _HIGH * abs(b)), extent(f, _HIGH * c)
    down = f.chol_f - MID_F - 3  # 8b and 8c, floor
    right = f.chol_f - MID_F - 5  # 32a, floor
    bits = 0
    for g in range(params.GROUPS):
        row, half = g >> 1, g & 1
        if y0 + row * params.SUBTILE < height and x0 + half * (_WIDE + 1) < width:
            rest = limit(f, opacity) - near(v + row * (c >> down), half_v)
            if near(u + row * (b >> down) + half * (a >> right), half_u) <= rest:
                bits |= 1 << g
    return bits
