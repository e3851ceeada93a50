"""gs_row_reach: how far from u = 0 an ellipse reaches in a row of pixels."""

from __future__ import annotations

import math

import numba

from golden.formats import Formats
from golden.raster_core.ellipse_setup import GUARD

LATENCY = 4  # cycles from in_v0 to the reach; the limit follows its row by one cycle
EMPTY = -1  # no reach


@numba.njit(inline="always", cache=True)
def limit(f: Formats, opacity):
    """Largest u^2 + v^2 at which a pixel may pass the cut, with the margin, SQ4.(2*ITU_F), floor; negative: none."""
    p = f.cut - (opacity << (f.power_f - f.opacity_f)) + f.itu_margin
    fine = 2 * f.itu_f - f.power_f
    return p << fine if fine > 0 else p >> -fine


@numba.njit(inline="always", cache=True)
def distance(f: Formats, v):
    """|v|, UQ2.ITU_F: floor, sat. v SQ6.(EDGE_F + GUARD); ~v is |v| - 1."""
    return min((v if v >= 0 else ~v) >> (f.edge_f + GUARD - f.itu_f), (1 << (f.itu_f + 2)) - 1)


@numba.njit(inline="always", cache=True)
def step(f: Formats, c, row):
    """row * c, UQ4.(EDGE_F + GUARD), from c in record codes, floored."""
    return row * (c >> (f.chol_f - f.edge_f - GUARD))


@numba.njit(inline="always", cache=True)
def reach(f: Formats, v, most):
    """sqrt(most - |v|^2), UQ2.ITU_F, floor; or EMPTY. v SQ6.(EDGE_F + GUARD), most SQ4.(2*ITU_F)."""
    d = distance(f, v)
    rest = most - d * d
    return int(math.sqrt(rest)) if rest >= 0 else EMPTY
