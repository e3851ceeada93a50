"""gs_raster_core: a tile's sorted table to its pixels, fresh depths and valid bits (docs/raster_core/raster_core.md).

This is the functional model, in 32-bit arithmetic that the compiler can vectorise; `_blend` and `tile_bits` give the
codes of subtile_compute_unit.py and intersection_test_unit.py exactly (tests/test_raster_golden.py). When: timing.py.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from golden import params, records
from golden.raster_core import subtile_compute_unit as scu
from golden.raster_core.ellipse_setup import setup
from golden.raster_core.exp2_unit import OFFSET_W, SLOPE_SHIFT, table
from golden.raster_core.intersection_test_unit import bound, squared

SIDE = params.TILE // params.SUBTILE  # subtiles along a tile's side
PIXELS = params.SUBTILE * params.SUBTILE
FRESH_T = 1 << params.T_F
DEAD_T = 0  # here: transmittance of a pixel outside the picture, so that it counts as done

_BASE = np.array([row[0] for row in table()], np.int32)
_SLOPE = np.array([row[1] for row in table()], np.int32)
_I = np.int32
_DIST_SHIFT = params.STEP_F - params.DIST_F
_DIST_MAX = (1 << params.DIST_W) - 1
_POWER_SHIFT = 2 * params.DIST_F - params.POWER_F
_COLOUR_SHIFT = params.T_F + params.COLOUR_F - params.ACC_F


@dataclass(frozen=True)
class RasterResult:
    """What one frame's tables became. E entries, T tiles, B batches of all tiles in order."""

    words_out: np.ndarray  # int64[E] entries with the key of this frame; invalid when no subtile was hit
    bitmaps: np.ndarray  # uint64[E] bit 8*row + column: the subtiles hit
    value: np.ndarray  # int64[H, W, 3] UQ3.20, resolved, unclamped
    rgb8: np.ndarray  # uint8[H, W, 3]
    transmittance: np.ndarray  # int64[H, W] UQ1.18
    batch_offsets: np.ndarray  # int64[T + 1]
    counts: np.ndarray  # uint16[B, GROUPS, UNITS] operations of each SCU: hits, 0 where the subtile is known done
    pairs: np.ndarray  # int64[T] (entry, subtile) pairs hit
    scu_ops: np.ndarray  # int64[T] pairs an SCU worked on
    blends: np.ndarray  # int64[T] (entry, pixel) pairs blended


@numba.njit(inline="always")
def _least(low, high):
    """Smallest |x| for x in low .. high."""
    return low if low > 0 else (-high if high < 0 else 0)


@numba.njit(cache=True, error_model="numpy")
def tile_bits(a, b, c, mean_x, mean_y, opacity, x0, y0, width, height):
    """intersection_test_unit.tile_bitmap, faster: rows and groups that cannot be hit are skipped."""
    bits = np.uint64(0)
    limit = bound(opacity)
    if limit < 0:
        return bits
    edge = (params.SUBTILE - 1) * a
    for row in range(SIDE):
        y = y0 + row * params.SUBTILE
        if y >= height:
            break
        for half in range(SIDE // params.UNITS):
            x = x0 + half * params.UNITS * params.SUBTILE
            if x >= width:
                break
            u0, v0 = setup(a, b, c, mean_x, mean_y, x, y)
            v_least = squared(_least(v0, v0 + (params.SUBTILE - 1) * c))
            if v_least > limit:
                break
            slant = (params.SUBTILE - 1) * b
            low = u0 + min(slant, 0)
            high = u0 + max(slant, 0) + (params.UNITS * params.SUBTILE - 1) * a
            if v_least + squared(_least(low, high)) > limit:
                continue
            hits = 0
            for j in range(params.SUBTILE):
                room = limit - squared(abs(v0 + j * c))
                if room >= 0:
                    for unit in range(params.UNITS):
                        left = u0 + unit * params.SUBTILE * a + j * b
                        hits |= int(squared(_least(left, left + edge)) <= room) << unit
            live = min(params.UNITS, (width - x + params.SUBTILE - 1) // params.SUBTILE)
            hits &= (1 << live) - 1
            bits |= np.uint64(hits) << np.uint64(row * SIDE + half * params.UNITS)
    return bits


@numba.njit(cache=True, error_model="numpy")
def _blend(state, u0, v0, a, b, c, opacity, red, green, blue):
    """One Gaussian on one subtile. state int32[4, PIXELS]: T, red, green, blue; returns the pixels blended.

    No intermediate exceeds 31 bits: alpha * T is cut in two, everything else fits as it is.
    """
    count = 0
    for k in range(PIXELS):
        j = _I(k >> 3)
        i = _I(k & 7)
        u = abs(_I(_I(u0) + _I(i * _I(a)) + _I(j * _I(b))))
        v = abs(_I(_I(v0) + _I(j * _I(c))))
        um = min(_I(_I(u + _I(1 << (_DIST_SHIFT - 1))) >> _I(_DIST_SHIFT)), _I(_DIST_MAX))
        vm = min(_I(_I(v + _I(1 << (_DIST_SHIFT - 1))) >> _I(_DIST_SHIFT)), _I(_DIST_MAX))
        e = _I(_I(um * um) + _I(vm * vm))
        e = _I(_I(e + _I(1 << (_POWER_SHIFT - 1))) >> _I(_POWER_SHIFT))
        p = _I(e + _I(opacity << (params.POWER_F - params.OPACITY_F)))
        t = state[0, k]
        blended = (p <= _I(params.CUT)) & (t >= _I(params.T_STOP))
        q = min(p, _I(params.CUT))
        whole = _I(q >> _I(params.POWER_F))
        segment = _I(q >> _I(OFFSET_W)) & _I(params.EXP_SEGMENTS - 1)
        offset = q & _I((1 << OFFSET_W) - 1)
        y = _I(_BASE[segment] - _I(_I(_SLOPE[segment] * offset) >> _I(SLOPE_SHIFT)))
        y = _I(_I(_I(y << _I(1)) + _I(_I(1) << whole)) >> _I(whole + _I(1)))
        narrow = params.EXP_F - params.ALPHA_F
        alpha = min(_I(_I(y + _I(1 << (narrow - 1))) >> _I(narrow)), _I(params.ALPHA_MAX))
        low = _I(_I(_I(alpha * _I(t & _I(7))) + _I(1 << (params.ALPHA_F - 1))) >> _I(3))
        w = _I(_I(_I(alpha * _I(t >> _I(3))) + low) >> _I(params.ALPHA_F - 3))
        w = min(w, _I(t - _I(1)))
        w = w if blended else _I(0)
        half = _I(1 << (_COLOUR_SHIFT - 1))
        state[0, k] = _I(t - w)
        state[1, k] += _I(_I(_I(w * _I(red)) + half) >> _I(_COLOUR_SHIFT))
        state[2, k] += _I(_I(_I(w * _I(green)) + half) >> _I(_COLOUR_SHIFT))
        state[3, k] += _I(_I(_I(w * _I(blue)) + half) >> _I(_COLOUR_SHIFT))
        count += _I(blended)
    return count


@numba.njit(cache=True)
def _done(state):
    """Are all pixels of the subtile done?"""
    most = _I(0)
    for k in range(PIXELS):
        most = max(most, state[0, k])
    return most < params.T_STOP


@numba.njit(cache=True, error_model="numpy")
def _raster_tile(words, mean, chol, opacity, colour, key, x0, y0, size, words_out, bitmaps, state, counts, totals):
    """One tile. Fills counts uint16[batches, GROUPS, UNITS] and totals int64[3] (pairs, scu_ops, blends)."""
    width, height = size
    for subtile in range(params.SUBTILES):
        x = x0 + (subtile & 7) * params.SUBTILE
        y = y0 + (subtile >> 3) * params.SUBTILE
        for k in range(PIXELS):
            live = x + (k & 7) < width and y + (k >> 3) < height
            state[subtile, 0, k] = FRESH_T if live else DEAD_T
            state[subtile, 1:, k] = 0
    hits = np.empty((params.SUBTILES, params.CHUNK), np.int32)
    n_hits = np.zeros(params.SUBTILES, np.int32)
    # What an SCU knows: it holds one group's subtile, and learns that a subtile is done when it swaps it out.
    held = np.full(params.UNITS, -1, np.int64)
    known_done = np.zeros(params.SUBTILES, np.bool_)
    for batch in range(counts.shape[0]):
        first = batch * params.CHUNK
        n_hits[:] = 0
        for e in range(first, min(first + params.CHUNK, len(words))):
            g = words[e] & records.INDEX_MASK
            bits = tile_bits(
                chol[g, 0], chol[g, 1], chol[g, 2], mean[g, 0], mean[g, 1], opacity[g], x0, y0, width, height
            )
            bitmaps[e] = bits
            word = (np.int64(key[g]) << params.INDEX_W) | g
            words_out[e] = word if bits else word | records.INVALID
            for row in range(SIDE):
                part = np.int64(bits >> np.uint64(row * SIDE)) & 0xFF
                if part:
                    for column in range(SIDE):
                        if (part >> column) & 1:
                            subtile = row * SIDE + column
                            hits[subtile, n_hits[subtile]] = g
                            n_hits[subtile] += 1
        for subtile in range(params.SUBTILES):
            group = subtile // params.UNITS
            unit = subtile % params.UNITS
            n = n_hits[subtile]
            totals[0] += n
            if n == 0 or known_done[subtile]:
                counts[batch, group, unit] = 0
                continue
            counts[batch, group, unit] = n
            totals[1] += n
            if held[unit] != group:
                if held[unit] >= 0:
                    out = held[unit] * params.UNITS + unit
                    known_done[out] = _done(state[out])
                held[unit] = group
            x = x0 + (subtile & 7) * params.SUBTILE
            y = y0 + (subtile >> 3) * params.SUBTILE
            for i in range(n):
                if (i & 7) == 0 and _done(state[subtile]):
                    break  # what is left changes nothing
                g = hits[subtile, i]
                u0, v0 = setup(chol[g, 0], chol[g, 1], chol[g, 2], mean[g, 0], mean[g, 1], x, y)
                totals[2] += _blend(
                    state[subtile], u0, v0, chol[g, 0], chol[g, 1], chol[g, 2], opacity[g],
                    colour[g, 0], colour[g, 1], colour[g, 2],
                )  # fmt: skip


@numba.njit(cache=True, error_model="numpy")
def _resolve_tile(state, x0, y0, background, value, rgb8, transmittance):
    """State of a tile's subtiles into the picture."""
    height, width = transmittance.shape
    for y in range(y0, min(y0 + params.TILE, height)):
        for x in range(x0, min(x0 + params.TILE, width)):
            subtile = ((y - y0) >> 3) * SIDE + ((x - x0) >> 3)
            k = ((y - y0) & 7) * params.SUBTILE + ((x - x0) & 7)
            t = np.int64(state[subtile, 0, k])
            transmittance[y, x] = t
            for channel in range(3):
                v = scu.resolve(np.int64(state[subtile, 1 + channel, k]), t, background[channel])
                value[y, x, channel] = v
                rgb8[y, x, channel] = scu.to_8_bit(v)


@numba.njit(cache=True, parallel=True, error_model="numpy")
def _raster(
    offsets, words, batch_offsets, mean, chol, opacity, colour, key, tile_xy, size, background,
    words_out, bitmaps, value, rgb8, transmittance, counts, totals,
):  # fmt: skip
    for tile in numba.prange(len(tile_xy)):
        state = np.empty((params.SUBTILES, 4, PIXELS), np.int32)
        begin, end = offsets[tile], offsets[tile + 1]
        x0, y0 = tile_xy[tile]
        _raster_tile(
            words[begin:end], mean, chol, opacity, colour, key, x0, y0, size, words_out[begin:end],
            bitmaps[begin:end], state, counts[batch_offsets[tile] : batch_offsets[tile + 1]], totals[tile],
        )  # fmt: skip
        _resolve_tile(state, x0, y0, background, value, rgb8, transmittance)


def rasterise(tables, features, tile_xy, width: int, height: int, background=(0, 0, 0)) -> RasterResult:
    """One frame.

    tables: (offsets int64[T + 1], words int64[E]), valid entries in table order.
    features: arrays mean [N, 2], chol [N, 3] (a, b, c), opacity [N], colour [N, 3], key [N] of record codes.
    tile_xy: int64[T, 2] pixel origins. background: three UQ3.10 codes. Pixels of no tile stay 0.
    """
    offsets, words = (np.ascontiguousarray(x, np.int64) for x in tables)
    tile_xy = np.ascontiguousarray(tile_xy, np.int64).reshape(-1, 2)
    if len(offsets) != len(tile_xy) + 1 or offsets[-1] != len(words):
        raise ValueError(f"tables of {len(offsets) - 1} tiles and {offsets[-1]} entries: {len(tile_xy)}, {len(words)}")
    columns = [
        np.ascontiguousarray(getattr(features, name), np.int64) for name in ("mean", "chol", "opacity", "colour", "key")
    ]
    batches = -(-np.diff(offsets) // params.CHUNK)
    batch_offsets = np.concatenate(([0], np.cumsum(batches))).astype(np.int64)
    totals = np.zeros((len(tile_xy), 3), np.int64)
    result = RasterResult(
        words_out=np.empty(len(words), np.int64),
        bitmaps=np.empty(len(words), np.uint64),
        value=np.zeros((height, width, 3), np.int64),
        rgb8=np.zeros((height, width, 3), np.uint8),
        transmittance=np.zeros((height, width), np.int64),
        batch_offsets=batch_offsets,
        counts=np.empty((batch_offsets[-1], params.GROUPS, params.UNITS), np.uint16),
        pairs=totals[:, 0],
        scu_ops=totals[:, 1],
        blends=totals[:, 2],
    )
    chunk = numba.set_parallel_chunksize(1)  # tiles differ much in length
    try:
        _raster(
            offsets, words, batch_offsets, *columns, tile_xy, (width, height), np.array(background, np.int64),
            result.words_out, result.bitmaps, result.value, result.rgb8, result.transmittance, result.counts, totals,
        )  # fmt: skip
    finally:
        numba.set_parallel_chunksize(chunk)
    return result
