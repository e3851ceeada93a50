"""gs_intersection_test_unit: which subtiles a Gaussian touches (docs/architecture.md, section 5).

The same predicate decides which tiles list a Gaussian (preprocess) and which entries stay valid (raster core).
"""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.formats import Formats
from golden.raster_core import ellipse_setup
from golden.raster_core.ellipse_setup import setup

UNIT_LATENCY = 5  # cycles from in_valid to out_valid
LATENCY = ellipse_setup.LATENCY + UNIT_LATENCY  # of set-up and test together


@numba.njit(inline="always", cache=True)
def squared(f: Formats, step):
    """|step| truncated to UQ2.ITU_F, saturated, squared."""
    d = min(step >> (f.step_f - f.itu_f), (1 << f.itu_w) - 1)
    return d * d


@numba.njit(cache=True)
def bound(f: Formats, opacity):
    """Largest u^2 + v^2 at which a pixel may pass the cut, with the margin, UQ5.(2*ITU_F); negative: none."""
    p = f.cut - (opacity << (f.power_f - f.opacity_f)) + f.itu_margin
    return p << (2 * f.itu_f - f.power_f)


@numba.njit(cache=True)
def subtile_hit(f: Formats, u0, v0, a, b, c, limit):
    """Does the ellipse touch a row of pixel centres of the subtile whose first centre has u0, v0 (SQ9.STEP_F)?"""
    for j in range(params.SUBTILE):
        left = u0 + j * b
        right = left + (params.SUBTILE - 1) * a
        du = left if left > 0 else (-right if right < 0 else 0)
        if squared(f, du) + squared(f, abs(v0 + j * c)) <= limit:
            return True
    return False


@numba.njit(cache=True)
def tile_bitmap(f: Formats, a, b, c, mean_x, mean_y, opacity, x0, y0, width, height):
    """64-bit bitmap (uint64, bit 8*row + column) of the subtiles of the tile at pixel (x0, y0) that are hit.

    Subtiles whose origin lies outside the width x height picture are never hit.
    """
    bits = np.uint64(0)
    limit = bound(f, opacity)
    side = params.TILE // params.SUBTILE
    for row in range(side):
        y = y0 + row * params.SUBTILE
        if y >= height:
            break
        for half in range(side // params.UNITS):
            x = x0 + half * params.UNITS * params.SUBTILE
            u0, v0 = setup(f, a, b, c, mean_x, mean_y, x, y)
            for unit in range(params.UNITS):
                if x + unit * params.SUBTILE < width and subtile_hit(
                    f, u0 + unit * params.SUBTILE * a, v0, a, b, c, limit
                ):
                    bits |= np.uint64(1) << np.uint64(row * side + half * params.UNITS + unit)
    return bits
