"""gs_group_test_unit: which of a group's four subtiles a Gaussian touches."""

from __future__ import annotations

import numba

from golden import params
from golden.formats import Formats
from golden.raster_core import ellipse_setup
from golden.raster_core.ellipse_setup import setup
from golden.raster_core.intersection_test_unit import UNIT_LATENCY, bound, subtile_hit

LATENCY = ellipse_setup.LATENCY + 1 + UNIT_LATENCY  # cycles from in_valid to out_valid


@numba.njit(cache=True)
def group_hits(f: Formats, a, b, c, mean_x, mean_y, opacity, x, y, width, height):
    """Bit s: subtile s of the group at pixel (x, y) is hit. Footprint, mean and opacity in record codes."""
    u0, v0 = setup(f, a, b, c, mean_x, mean_y, x, y)
    hits = 0
    for unit in range(params.UNITS):
        step = unit * params.SUBTILE
        if x + step < width and y < height and subtile_hit(f, u0 + step * a, v0, a, b, c, bound(f, opacity)):
            hits |= 1 << unit
    return hits
