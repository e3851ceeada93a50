"""Approximate tests of which subtiles a Gaussian touches, for the accuracy study; the hardware has the exact one.

With q = d^T conic d, u^2 + v^2 = q log2(e) / 2: the ellipse of 3 sigma is u^2 + v^2 = _THREE, that of the pixels above
the cut u^2 + v^2 = CUT + log2(opacity). A subtile is the rectangle of its pixel centres. Real numbers made of codes.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from golden import params
from golden.formats import BOUNDS, Formats

BOX, ORIENTED, CIRCLE = (BOUNDS.index(name) for name in ("box", "oriented", "circle"))
_THREE = 9 * math.log2(math.e) / 2
_ENDLESS = 1e9  # pixels
_HALF = (params.SUBTILE - 1) / 2
_SIDE = params.TILE // params.SUBTILE


@numba.njit(cache=True, error_model="numpy")
def shape(f: Formats, a, b, c, opacity):
    """(half_x, half_y, along, across, x1, y1), pixels, of what stands for a footprint in record codes.

    half_x, half_y: half of its bounding box, negative where the opacity is below the cut; along, across: 3 sigma of the
    long and the short axis; (x1, y1): unit vector along the long one.
    """
    square = (f.cut - (opacity << (f.power_f - f.opacity_f))) / (1 << f.power_f)
    if square < 0:
        return -1.0, -1.0, 0.0, 0.0, 1.0, 0.0
    unit = 1.0 / (1 << f.chol_f)
    a, b, c = a * unit, b * unit, c * unit
    xx, xy, yy = a * a, a * b, b * b + c * c  # the conic
    most = (xx + yy) / 2 + math.hypot((xx - yy) / 2, xy)
    along = min(math.sqrt(_THREE * most) / (a * c), _ENDLESS)
    across = min(math.sqrt(_THREE / most), _ENDLESS)
    least = (a * c) ** 2 / most
    x1, y1 = (-xy, xx - least) if xx > yy else (yy - least, -xy)
    length = math.hypot(x1, y1)
    x1, y1 = (x1 / length, y1 / length) if length > 0 else (1.0, 0.0)
    if f.bound == CIRCLE:
        return along, along, along, across, x1, y1
    if f.bound == ORIENTED:
        return along * abs(x1) + across * abs(y1), along * abs(y1) + across * abs(x1), along, across, x1, y1
    half_x = min(math.sqrt(square * yy) / (a * c), _ENDLESS)
    return half_x, min(math.sqrt(square) / c, _ENDLESS), along, across, x1, y1


@numba.njit(cache=True)
def tile_bits(f: Formats, a, b, c, mean_x, mean_y, opacity, x0, y0, width, height):
    """As group_tester.tile_bits, by the test that f.bound names."""
    bits = np.uint64(0)
    half_x, half_y, along, across, x1, y1 = shape(f, a, b, c, opacity)
    if half_x < 0:
        return bits
    unit = 1.0 / (1 << f.mean_f)
    for row in range(_SIDE):
        dy = y0 + row * params.SUBTILE + 0.5 + _HALF - mean_y * unit  # of the subtile's centre
        if y0 + row * params.SUBTILE >= height or abs(dy) > half_y + _HALF:
            continue
        for column in range(_SIDE):
            dx = x0 + column * params.SUBTILE + 0.5 + _HALF - mean_x * unit
            if x0 + column * params.SUBTILE >= width or abs(dx) > half_x + _HALF:
                continue
            if f.bound == CIRCLE:
                hit = math.hypot(max(abs(dx) - _HALF, 0.0), max(abs(dy) - _HALF, 0.0)) <= along
            elif f.bound == ORIENTED:
                reach = _HALF * (abs(x1) + abs(y1))
                hit = abs(dx * x1 + dy * y1) <= along + reach and abs(dy * x1 - dx * y1) <= across + reach
            else:
                hit = True
            bits |= np.uint64(hit) << np.uint64(row * _SIDE + column)
    return bits
