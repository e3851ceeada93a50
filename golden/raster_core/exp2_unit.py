"""gs_exp2_unit: 2^-p for 0 <= p < 8 by a table of straight lines (docs/raster_core/exp2_unit.md).

p is UQ3.POWER_F; the result UQ1.EXP_F. A chord lies above the curve by up to (ln 2 / EXP_SEGMENTS)^2 / 8 of its value,
so both ends of every chord are lowered by half of that: the error is centred, and seams stay continuous.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numba
import numpy as np

from golden import params
from golden.fixed import half_up

OFFSET_W = params.POWER_F - params.EXP_SEGMENTS.bit_length() + 1  # bits of p below the segment number
SLOPE_SHIFT = OFFSET_W
LATENCY = 1  # cycles from in_p to out_y


def table() -> list[tuple[int, int]]:
    """[EXP_SEGMENTS] of (base UQ1.EXP_F, drop over the segment UQ0.EXP_F)."""
    lowered = 1 - (math.log(2) / params.EXP_SEGMENTS) ** 2 / 16
    ends = [round(lowered * 2.0 ** (params.EXP_F - i / params.EXP_SEGMENTS)) for i in range(params.EXP_SEGMENTS + 1)]
    return [(a, a - b) for a, b in pairwise(ends)]


_TABLE = np.array(table(), np.int64)


@numba.njit(inline="always", cache=True)
def exp2(p):
    """2^-p: p UQ3.POWER_F -> UQ1.EXP_F, half_up."""
    whole = p >> params.POWER_F
    fraction = p & ((1 << params.POWER_F) - 1)
    segment = fraction >> OFFSET_W
    offset = fraction & ((1 << OFFSET_W) - 1)
    y = _TABLE[segment, 0] - ((_TABLE[segment, 1] * offset) >> SLOPE_SHIFT)
    return half_up(y << 1, whole + 1)
