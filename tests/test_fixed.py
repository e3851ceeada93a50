"""Rounding and saturation, exhaustively at small widths, negative ties included."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest

from golden.fixed import half_up, sat_s


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_half_up_takes_ties_to_plus_infinity(n):
    for x in range(-300, 301):
        assert half_up(x, n) == math.floor(Fraction(x, 2**n) + Fraction(1, 2))


@pytest.mark.parametrize("bits", [1, 2, 4])
def test_sat_s_keeps_what_fits_and_takes_the_nearest_otherwise(bits):
    codes = range(-(2 ** (bits - 1)), 2 ** (bits - 1))
    for x in range(-20, 21):
        assert sat_s(x, bits) == min(codes, key=lambda code: abs(code - x))
