"""Fixed point: one function a rounding and overflow mode, on int64 arrays (or scalars inside numba).

A narrowing names both: `half_up(x, n)` drops n fraction bits with ties to +infinity, `floor(x, n)` truncates to
-infinity, `sat_u` and `sat_s` saturate. Nothing wraps.
"""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(inline="always", cache=True)
def half_up(x, n):
    """x / 2**n rounded to nearest, ties to +infinity; n >= 1."""
    return (x + (1 << (n - 1))) >> n


@numba.njit(inline="always", cache=True)
def floor(x, n):
    """x / 2**n rounded to -infinity."""
    return x >> n


@numba.njit(inline="always", cache=True)
def sat_u(x, bits):
    """x limited to 0 .. 2**bits - 1."""
    return min(max(x, 0), (1 << bits) - 1)


@numba.njit(inline="always", cache=True)
def sat_s(x, bits):
    """x limited to -2**(bits-1) .. 2**(bits-1) - 1."""
    return min(max(x, -(1 << (bits - 1))), (1 << (bits - 1)) - 1)


def quantise(x: np.ndarray, fraction: int, low: int, high: int) -> tuple[np.ndarray, np.ndarray]:
    """Real numbers to codes of 2**-fraction, half up, saturated to [low, high].

    Returns (codes int64, clamped bool): where the value lay outside. NaN is the caller's error and raises ValueError.
    """
    x = np.asarray(x, dtype=np.float64)
    if np.isnan(x).any():
        raise ValueError("quantise: NaN has no code")
    scaled = np.floor(np.clip(np.ldexp(x, fraction), -(2.0**62), 2.0**62) + 0.5)
    clamped = (scaled < low) | (scaled > high)
    return np.clip(scaled, low, high).astype(np.int64), clamped
