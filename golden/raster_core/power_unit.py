"""gs_power_unit: p = u^2 + v^2 - log2(opacity) at the pixels of a subtile (docs/architecture.md, section 4)."""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.fixed import half_up
from golden.formats import Formats
from golden.raster_core.ellipse_setup import setup

LATENCY = 11  # cycles from in_valid to the first of the BEATS beats


@numba.njit(inline="always", cache=True)
def square(f: Formats, step):
    """|step| narrowed to UQ2.DIST_F (half_up, saturated), squared: UQ4.(2*DIST_F)."""
    d = min(half_up(abs(step), f.step_f - f.dist_f), (1 << f.dist_w) - 1)
    return d * d


@numba.njit(inline="always", cache=True)
def power(f: Formats, u, v, opacity):
    """p = u^2 + v^2 - log2(opacity), .POWER_F; the pixel is blended when p <= CUT. u, v SQ9.STEP_F."""
    e = half_up(square(f, u) + square(f, v), 2 * f.dist_f - f.power_f)
    return e + (opacity << (f.power_f - f.opacity_f))


@numba.njit(inline="always", cache=True)
def narrow(f: Formats, p):
    """p as it leaves the unit, POWER_W bits; of p beyond the cut's integer bits the top one alone has a meaning."""
    return min(p, 1 << (f.power_w - 1))


@numba.njit(cache=True)
def powers(f: Formats, mean_x, mean_y, a, b, c, opacity, x0, y0):
    """p, UQ4.POWER_F, at the 64 pixels of the subtile at pixel (x0, y0): [64] int64, row by row."""
    u0, v0 = setup(f, a, b, c, mean_x, mean_y, x0, y0)
    p = np.empty(params.SUBTILE * params.SUBTILE, np.int64)
    for at in range(p.size):
        j, i = divmod(at, params.SUBTILE)
        p[at] = narrow(f, power(f, u0 + i * a + j * b, v0 + j * c, opacity))
    return p
