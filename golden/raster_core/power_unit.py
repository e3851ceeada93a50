"""gs_power_unit: p = u^2 + v^2 - log2(opacity) at the pixels of a subtile (docs/architecture.md, section 4)."""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.fixed import half_up
from golden.raster_core.ellipse_setup import setup

LATENCY = 10  # cycles from in_valid to the first of the BEATS beats
P_W = params.POWER_F + 4  # of out_p: UQ3.POWER_F and a bit that says "8 or more"


@numba.njit(inline="always", cache=True)
def square(step):
    """|step| narrowed to UQ2.DIST_F (half_up, saturated), squared: UQ4.(2*DIST_F)."""
    d = min(half_up(abs(step), params.STEP_F - params.DIST_F), (1 << params.DIST_W) - 1)
    return d * d


@numba.njit(inline="always", cache=True)
def power(u, v, opacity):
    """p = u^2 + v^2 - log2(opacity), .POWER_F; the pixel is blended when p <= CUT. u, v SQ9.20."""
    e = half_up(square(u) + square(v), 2 * params.DIST_F - params.POWER_F)
    return e + (opacity << (params.POWER_F - params.OPACITY_F))


@numba.njit(inline="always", cache=True)
def narrow(p):
    """p as it leaves the unit: the bits from 8 on are collected in the top one."""
    top = 1 << (P_W - 1)
    return p if p < top else top | (p & (top - 1))


@numba.njit(cache=True)
def powers(mean_x, mean_y, a, b, c, opacity, x0, y0):
    """p, UQ4.POWER_F, at the 64 pixels of the subtile at pixel (x0, y0): [64] int64, row by row."""
    u0, v0 = setup(a, b, c, mean_x, mean_y, x0, y0)
    p = np.empty(params.SUBTILE * params.SUBTILE, np.int64)
    for at in range(p.size):
        j, i = divmod(at, params.SUBTILE)
        p[at] = narrow(power(u0 + i * a + j * b, v0 + j * c, opacity))
    return p
