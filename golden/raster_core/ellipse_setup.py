"""gs_ellipse_setup: u and v of a footprint at the first pixel of a subtile (docs/architecture.md, section 4)."""

from __future__ import annotations

import numba

from golden import params
from golden.fixed import half_up, sat_s

LATENCY = 3  # cycles from in_valid to out_valid


@numba.njit(inline="always", cache=True)
def offset(origin, mean):
    """Centre of the pixel at `origin` (pixels) minus the mean (SQ13.MEAN_F): SQ14.MEAN_F, exact."""
    return (origin << params.MEAN_F) + (1 << (params.MEAN_F - 1)) - mean


@numba.njit(inline="always", cache=True)
def narrow(x):
    """Sum of products .(CHOL_F + MEAN_F) to SQ8.STEP_F: half_up, sat."""
    return sat_s(half_up(x, params.CHOL_F + params.MEAN_F - params.STEP_F), params.STEP_W)


@numba.njit(inline="always", cache=True)
def setup(a, b, c, mean_x, mean_y, x0, y0):
    """(U0, V0), SQ8.20: u and v at the centre of pixel (x0, y0), saturated. Footprint and mean in record codes."""
    dx = offset(x0, mean_x)
    dy = offset(y0, mean_y)
    return narrow(a * dx + b * dy), narrow(c * dy)
