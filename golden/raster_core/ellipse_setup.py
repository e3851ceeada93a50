"""gs_ellipse_setup: u and v of a footprint at the first pixel of a group; and of a subtile, as the SCU sets it up.

Both are in docs/architecture.md, section 4. The test needs far fewer bits than the SCU, and knows on which side it is.
"""

from __future__ import annotations

import numba

from golden.fixed import half_up, sat_s
from golden.formats import Formats

LATENCY = 3  # cycles from in_valid to out_valid and u; v is one cycle earlier
GUARD = 3  # bits of a product below EDGE_F
V_BIAS = 4  # codes of these added to v


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


@numba.njit(inline="always", cache=True)
def product(f: Formats, x, d):
    """(high, low) parts of x * d, .(EDGE_F + GUARD), floored each, without the product of the low bits of both.

    x of the footprint, d SQ14.MEAN_F. Together less than the exact product, by below 3; low is within SQ2.
    """
    dropped = f.chol_f + f.mean_f - f.edge_f - GUARD
    low_x = min(dropped >> 1, f.chol_f - 12)
    low_d = dropped - low_x
    return ((x >> low_x) * d) >> low_d, ((x & ((1 << low_x) - 1)) * (d >> low_d)) >> low_x


@numba.njit(inline="always", cache=True)
def corner(f: Formats, a, b, c, mean_x, mean_y, x0, y0):
    """(u, high, low, far) at pixel (x0, y0): u SQ7.EDGE_F, floor; parts of v, SQ5 and SQ2.(EDGE_F + GUARD).

    v is 4 codes above its floor (docs/raster_core/ellipse_setup.md). far: u or the high part of v does not fit.
    """
    dx = offset(f, x0, mean_x)
    dy = offset(f, y0, mean_y)
    high_a, low_a = product(f, a, dx)
    high_b, low_b = product(f, b, dy)
    high, low = product(f, c, dy)
    u = (high_a + low_a + high_b + low_b - 1) >> GUARD
    high += V_BIAS
    fits_u = -(1 << (f.edge_f + 7)) <= u < 1 << (f.edge_f + 7)
    fits_v = -(1 << (f.edge_f + GUARD + 5)) <= high < 1 << (f.edge_f + GUARD + 5)
    return u, high, low, not (fits_u and fits_v)
