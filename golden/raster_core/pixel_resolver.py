"""gs_pixel_resolver: a tile's pixel states over the background, as beats of four pixels."""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.formats import Formats
from golden.raster_core import subtile_compute_unit as scu

DELAY = 7  # cycles from resolve_start to the first beat
RELEASE = 2  # cycles from the read of the last word to the first phase of the next tile


@numba.njit(cache=True, error_model="numpy")
def resolve_tile(f: Formats, state, x0, y0, background, value, rgb8, transmittance):
    """State int[SUBTILES, 4, 64] (T, red, green, blue) of the tile at (x0, y0) into the picture's arrays."""
    height, width = transmittance.shape
    side = params.TILE // params.SUBTILE
    for y in range(y0, min(y0 + params.TILE, height)):
        for x in range(x0, min(x0 + params.TILE, width)):
            subtile = ((y - y0) >> 3) * side + ((x - x0) >> 3)
            k = ((y - y0) & 7) * params.SUBTILE + ((x - x0) & 7)
            t = abs(np.int64(state[subtile, 0, k]))
            transmittance[y, x] = t
            for channel in range(3):
                v = scu.resolve(f, np.int64(state[subtile, 1 + channel, k]), t, background[channel])
                value[y, x, channel] = v
                rgb8[y, x, channel] = scu.to_8_bit(f, v)


def beats(f: Formats, value: np.ndarray, rgb8: np.ndarray) -> list[tuple[int, int, int, int]]:
    """[rows, columns, 3] live pixels of a tile -> its beats (data, strb, last, rgb); dead pixels are 0 in them."""
    out = []
    rows, columns = value.shape[:2]
    for y in range(rows):
        for x in range(0, columns, 4):
            data = rgb = strobes = 0
            for p in range(min(4, columns - x)):
                colour = [*rgb8[y, x + p], 255]
                data |= sum(int(c) << 32 * p + 8 * k for k, c in enumerate(colour))
                rgb |= sum(int(v) << (3 * p + k) * f.acc_w for k, v in enumerate(value[y, x + p]))
                strobes |= 15 << 4 * p
            out.append((data, strobes, int(y == rows - 1 and x + 4 >= columns), rgb))
    return out


def live(f: Formats, data: int, strobes: int, rgb: int) -> tuple[int, int]:
    """(data, rgb) of a beat with its dead pixels set to 0."""
    pixels = [p for p in range(4) if strobes >> 4 * p & 1]
    pixel_w = 3 * f.acc_w
    return (
        data & sum(0xFFFFFFFF << 32 * p for p in pixels),
        rgb & sum((1 << pixel_w) - 1 << pixel_w * p for p in pixels),
    )


def pixel_beats(tile_xy: np.ndarray, width: int, height: int) -> np.ndarray:
    """[T] beats of pixels of tiles at [T, 2] origins: one a cycle."""
    columns, rows = (np.minimum(params.TILE, limit - tile_xy[:, i]) for i, limit in enumerate((width, height)))
    return rows * -(-columns // 4)
