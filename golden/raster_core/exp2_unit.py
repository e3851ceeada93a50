"""gs_exp2_unit: alpha = min(0.99, 2^-p) for 0 <= p < 8, by a table of straight lines (docs/raster_core/exp2_unit.md).

p is UQ3.POWER_F; 2^-p UQ1.EXP_F. A chord lies above the curve by up to (ln 2 / EXP_SEGMENTS)^2 / 8 of its value,
so both ends of every chord are lowered by half of that: the error is centred, and seams stay continuous.
"""

from __future__ import annotations

import numba
import numpy as np

from golden.fixed import half_up
from golden.formats import EXP_BITS, EXP_SEGMENTS, Formats, exp_table

LATENCY = 1  # cycles from in_p to out_alpha

# Every table that formats can ask for, one behind the other: compiled code needs no new one for another format.
_TABLES = np.array(
    [row for bits in EXP_BITS for segments in EXP_SEGMENTS for row in exp_table(segments, bits)], np.int32
)
BASE, SLOPE = _TABLES[:, 0].copy(), _TABLES[:, 1].copy()


@numba.njit(inline="always", cache=True)
def exp2(f: Formats, p):
    """2^-p: p UQ3.POWER_F -> UQ1.EXP_F, half_up."""
    whole = p >> f.power_f
    fraction = p & ((1 << f.power_f) - 1)
    segment = fraction >> f.offset_w
    offset = fraction & ((1 << f.offset_w) - 1)
    y = BASE[f.exp_at + segment] - ((np.int64(SLOPE[f.exp_at + segment]) * offset) >> f.offset_w)
    return half_up(y << 1, whole + 1)


@numba.njit(inline="always", cache=True)
def alpha(f: Formats, p):
    """min(0.99, 2^-p), UQ0.ALPHA_F."""
    return min(half_up(exp2(f, p), f.exp_f - f.alpha_f), f.alpha_max)
