"""gs_pixel_blender: one layer on one pixel (docs/architecture.md, section 4)."""

from __future__ import annotations

import numba

from golden.fixed import half_up
from golden.formats import Formats
from golden.raster_core.exp2_unit import alpha

BEATS = 4  # pixels a lane holds: so many beats later the same one is at S12 again
COLOUR_DELAY = 2  # beats from a pixel's place at S12 to S14, where its colours are wanted


@numba.njit(inline="always", cache=True)
def weight(f: Formats, a, t):
    """w = alpha * T, UQ1.T_F, never all of T: T stays above 0."""
    return min(half_up(a * t, f.alpha_f), t - 1)


@numba.njit(inline="always", cache=True)
def accumulate(f: Formats, acc, w, colour):
    """acc + w * colour, UQ3.ACC_F. Weights add up to 1 at most and colours end at COLOUR_MAX: it cannot overflow."""
    return acc + half_up(w * colour, f.t_f + f.colour_f - f.acc_f)


@numba.njit(inline="always", cache=True)
def blend_pixel(f: Formats, p, t, acc_r, acc_g, acc_b, red, green, blue):
    """One layer of power p <= CUT on a pixel that is not done: (T', acc_r', acc_g', acc_b'); done when T' < T_STOP."""
    w = weight(f, alpha(f, p), t)
    return t - w, accumulate(f, acc_r, w, red), accumulate(f, acc_g, w, green), accumulate(f, acc_b, w, blue)
