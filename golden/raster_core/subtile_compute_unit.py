"""gs_subtile_compute_unit: blends Gaussians on one 8x8 subtile (docs/architecture.md, section 4).

The state of a subtile is t [64] UQ1.T_F, acc [3, 64] UQ3.ACC_F (red, green, blue) and done [64], int64, pixels row by
row. Gaussians are rows of record codes in the order of formats.record_fields: mean_x, mean_y, chol_a, chol_b, chol_c,
opacity, red, green, blue; further columns are ignored.
"""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.fixed import half_up
from golden.formats import Formats
from golden.raster_core.ellipse_setup import setup
from golden.raster_core.pixel_blender import blend_pixel
from golden.raster_core.power_unit import power

PIXELS = params.SUBTILE * params.SUBTILE
LATENCY = 16  # cycles from taking a swap to sat_valid
BLEND_STAGE = 12  # cycles from taking a blend to the trace of its first beat


@numba.njit(inline="always", cache=True)
def resolve(f: Formats, acc, t, background):
    """acc + T * background, UQ3.ACC_F: the value of the pixel."""
    return acc + half_up(t * background, f.t_f + f.colour_f - f.acc_f)


@numba.njit(inline="always", cache=True)
def to_8_bit(f: Formats, value):
    """UQ3.ACC_F to 0..255, half_up, saturated."""
    return min(half_up(value * 255, f.acc_f), 255)


def fresh(f: Formats, cols: int = params.SUBTILE, rows: int = params.SUBTILE) -> tuple[np.ndarray, ...]:
    """(t, acc, done) before the first Gaussian; pixels outside the first cols columns and rows rows start done."""
    at = np.arange(PIXELS)
    done = (at % params.SUBTILE >= cols) | (at // params.SUBTILE >= rows)
    return np.full(PIXELS, 1 << f.t_f, np.int64), np.zeros((3, PIXELS), np.int64), done.astype(np.int64)


@numba.njit(cache=True)
def blend_subtile(f: Formats, t, acc, done, x0, y0, gaussians, trace):
    """Blend gaussians [n, >= 9] in order on the subtile at pixel (x0, y0); t, acc, done change in place.

    trace [n] uint64 gets the pixels that blended (bit 8*row + column). Returns the number of blends.
    """
    blends = 0
    for n in range(gaussians.shape[0]):
        mean_x, mean_y, a, b, c, opacity, red, green, blue = gaussians[n, :9]
        u0, v0 = setup(f, a, b, c, mean_x, mean_y, x0, y0)
        trace[n] = 0
        for at in range(PIXELS):
            j, i = divmod(at, params.SUBTILE)
            p = power(f, u0 + i * a + j * b, v0 + j * c, opacity)
            if p > f.cut or done[at]:
                continue
            left, new_red, new_green, new_blue = blend_pixel(
                f, p, t[at], acc[0, at], acc[1, at], acc[2, at], red, green, blue
            )
            done[at] = left < f.t_stop
            if f.drop_last and done[at]:
                continue
            t[at] = left
            acc[0, at], acc[1, at], acc[2, at] = new_red, new_green, new_blue
            trace[n] |= np.uint64(1) << np.uint64(at)
            blends += 1
    return blends


def state_w(f: Formats) -> int:
    """Bits {blue, green, red, T - 1} of a pixel in the pixel buffer."""
    return f.t_f + 3 * f.acc_w


def pack(f: Formats, t: np.ndarray, acc: np.ndarray, done: np.ndarray) -> list[int]:
    """State of a subtile -> its BEATS words in the pixel buffer, LANES * state_w bits each, lane 0 lowest.

    A pixel is done when T < T_STOP; outside the picture, where it is done from the start, T is 1.
    """
    words = [0] * params.BEATS
    kept = np.where((done != 0) & (t >= f.t_stop), 0, t - 1)
    for at in range(PIXELS):
        fields = ((kept[at], f.t_f), *((acc[k, at], f.acc_w) for k in range(3)))
        low = (at % params.LANES) * state_w(f)
        for value, width in fields:
            assert 0 <= value < 1 << width, f"pixel {at}: {value} has more than {width} bits"
            words[at // params.LANES] |= int(value) << low
            low += width
    return words


def unpack(f: Formats, words: list[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(t, acc, done) of the words; the inverse of pack but for T outside the picture."""
    t, acc, _ = fresh(f)
    for at in range(PIXELS):
        pixel = words[at // params.LANES] >> ((at % params.LANES) * state_w(f))
        t[at] = (pixel & ((1 << f.t_f) - 1)) + 1
        for k in range(3):
            acc[k, at] = (pixel >> (f.t_f + k * f.acc_w)) & ((1 << f.acc_w) - 1)
    return t, acc, (t < f.t_stop).astype(np.int64)


def cycles(operations: int) -> int:
    """From taking the first of back-to-back operations to sat_valid of the last, a swap: one every BEATS cycles."""
    return params.BEATS * (operations - 1) + LATENCY
