"""gs_ellipse_setup: u and v of a footprint at the first pixel of a subtile (docs/architecture.md, section 4)."""

from __future__ import annotations

import numba

from golden.fixed import half_up, sat_s
from golden.formats import Formats

LATENCY = 3  # cycles from in_valid to out_valid


@numba.njit(inline="always", cache=True)
def offset(f: Formats, origin, mean):
    """Centre of the pixel at `origin` (pixels) minus the mean (SQ13.MEAN_F): SQ14.MEAN_F, exact."""
    return (origin << f.mean_f) + (1 << (f.mean_f - 1)) - mean


@numba.njit(inline="always", cache=True)
def narrow(f: Formats, x):
    """Sum of products .(CHOL_F + MEAN_F) to SQ8.STEP_F: half_up, sat."""
    return sat_s(half_up(x, f.chol_f + f.mean_f - f.step_f), f.step_w)


@numba.njit(inline="always", cache=True)
def setup(f: Formats, a, b, c, mean_x, mean_y, x0, y0):
    """(U0, V0), SQ8.STEP_F: u and v at the centre of pixel (x0, y0), saturated. Footprint and mean in record codes."""
    dx = offset(f, x0, mean_x)
    dy = offset(f, y0, mean_y)
    return narrow(f, a * dx + b * dy), narrow(f, c * dy)
