"""gs_span_finder: how far an ellipse reaches to the right and to the left over the eight rows of a group."""

from __future__ import annotations

import numba

from golden.formats import Formats
from golden.raster_core.row_reach import EMPTY

LATENCY = 2  # cycles from the reaches to the span; b is one cycle ahead of them
NOTHING = -32  # reach of an empty row, and something


@numba.njit(inline="always", cache=True)
def upper(f: Formats, row):
    """Upper end of a reach (UQ2.ITU_F or EMPTY), SQ5.EDGE_F; below all others that of an empty row."""
    fine = f.edge_f - f.itu_f
    return ((row + 1) << fine) - 1 if row != EMPTY else NOTHING << f.edge_f


@numba.njit(inline="always", cache=True)
def slope(f: Formats, b):
    """b SQ1.EDGE_F, floor, from its record code."""
    return b >> (f.chol_f - f.edge_f)


@numba.njit(cache=True)
def reaches(f: Formats, b, rows):
    """(right, left) of rows [8]: largest reach - j*b and reach + j*b, SQ6.EDGE_F. b SQ1.EDGE_F."""
    right = left = NOTHING << f.edge_f
    for j in range(len(rows)):
        right = max(right, upper(f, rows[j]) - j * b)
        left = max(left, upper(f, rows[j]) + j * b)
    return right, left
