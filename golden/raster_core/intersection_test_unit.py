"""gs_intersection_test_unit: is a subtile among the columns that an ellipse spans?"""

from __future__ import annotations

import numba

UNIT_LATENCY = 1  # cycles from the span's ends to the hit


@numba.njit(inline="always", cache=True)
def hit(column, low, high):
    """column: of the subtile's first pixel, in steps of u from the group's; low, high: the span's ends. EDGE_F each."""
    return low <= column and column <= high
