"""gs_subtile_compute_unit: blends Gaussians on one 8x8 subtile (docs/architecture.md, section 4)."""

from __future__ import annotations

import numba

from golden import params
from golden.fixed import half_up
from golden.raster_core.exp2_unit import exp2


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
def alpha(p):
    """min(0.99, 2^-p), UQ0.ALPHA_F."""
    return min(half_up(exp2(p), params.EXP_F - params.ALPHA_F), params.ALPHA_MAX)


@numba.njit(inline="always", cache=True)
def weight(a, t):
    """w = alpha * T, UQ1.T_F, never all of T: T stays above 0."""
    return min(half_up(a * t, params.ALPHA_F), t - 1)


@numba.njit(inline="always", cache=True)
def accumulate(acc, w, colour):
    """acc + w * colour, UQ3.ACC_F. The weights of a pixel add up to at most 1, so it cannot overflow."""
    return acc + half_up(w * colour, params.T_F + params.COLOUR_F - params.ACC_F)


@numba.njit(inline="always", cache=True)
def resolve(acc, t, background):
    """acc + T * background, UQ3.ACC_F: the value of the pixel."""
    return acc + half_up(t * background, params.T_F + params.COLOUR_F - params.ACC_F)


@numba.njit(inline="always", cache=True)
def to_8_bit(value):
    """UQ3.ACC_F to 0..255, half_up, saturated."""
    return min(half_up(value * 255, params.ACC_F), 255)
