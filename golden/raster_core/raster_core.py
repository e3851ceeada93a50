"""gs_raster_core: a tile's sorted table to its pixels, fresh depths and valid bits (docs/raster_core/raster_core.md).

This is the functional model, composed as the RTL is; tests/test_raster_golden.py checks it against the arithmetic of
one pixel and one subtile. When things happen: timing.py.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from golden import formats, params, records
from golden.formats import Formats
from golden.raster_core.group_tester import tile_bits
from golden.raster_core.pixel_resolver import resolve_tile
from golden.raster_core.subtile_blender import NONE, all_done, blend_subtile, fresh_tile


@dataclass(frozen=True)
class RasterResult:
    """What one frame's tables became. E entries, T tiles, B batches of all tiles in order."""

    words_out: np.ndarray  # int64[E] entries with the key of their record; invalid when no subtile was hit
    bitmaps: np.ndarray  # uint64[E] bit 8*row + column: the subtiles hit
    value: np.ndarray  # int64[H, W, 3] UQ3.ACC_F, resolved, unclamped
    rgb8: np.ndarray  # uint8[H, W, 3]
    transmittance: np.ndarray  # int64[H, W] UQ1.T_F
    batch_offsets: np.ndarray  # int64[T + 1]
    counts: np.ndarray  # uint16[B, GROUPS, UNITS] operations of each SCU: hits, 0 where the subtile is known done
    pairs: np.ndarray  # int64[T] (entry, subtile) pairs hit
    scu_ops: np.ndarray  # int64[T] pairs an SCU worked on
    blends: np.ndarray  # int64[T] (entry, pixel) pairs blended
    fetched: np.ndarray  # int64[T] entries whose records were fetched; the others are as they were


@numba.njit(cache=True, error_model="numpy")
def _done(f: Formats, state):
    """Are all pixels of the tile done?"""
    subtile = 0
    while subtile < params.SUBTILES and all_done(f, state[subtile]):
        subtile += 1
    return subtile == params.SUBTILES


@numba.njit(cache=True, error_model="numpy")
def _raster_tile(
    f: Formats,
    words,
    kept,
    cut,
    mean,
    chol,
    opacity,
    colour,
    key,
    x0,
    y0,
    size,
    words_out,
    bitmaps,
    state,
    counts,
    totals,
):
    """One tile. Fills counts uint16[batches, GROUPS, UNITS] and totals int64[4] (pairs, scu_ops, blends, fetched)."""
    first, length, ahead = cut
    width, height = size
    fresh_tile(f, state, x0, y0, width, height)
    hits = np.empty((params.SUBTILES, length), np.int32)
    n_hits = np.zeros(params.SUBTILES, np.int32)
    held = np.full(params.UNITS, NONE, np.int64)
    known_done = np.zeros(params.SUBTILES, np.bool_)
    end = 0
    done = counts.shape[0]  # the batch that ended the last pixel
    for batch in range(counts.shape[0]):
        begin = end
        if ahead and batch >= done + ahead:
            words_out[begin:] = kept[begin:]
            bitmaps[begin:] = 0
            counts[batch:] = 0
            break
        end = min(begin + (length if batch else first), len(words))
        n_hits[:] = 0
        for e in range(begin, end):
            g = words[e] & records.INDEX_MASK
            bits = tile_bits(
                f, chol[g, 0], chol[g, 1], chol[g, 2], mean[g, 0], mean[g, 1], opacity[g], x0, y0, width, height
            )
            bitmaps[e] = bits
            word = (np.int64(key[g]) << params.INDEX_W) | g
            words_out[e] = word if bits else word | records.INVALID
            for row in range(8):
                part = np.int64(bits >> np.uint64(row * 8)) & 0xFF
                if part:
                    for column in range(8):
                        if (part >> column) & 1:
                            subtile = row * 8 + column
                            hits[subtile, n_hits[subtile]] = g
                            n_hits[subtile] += 1
        for subtile in range(params.SUBTILES):
            n = n_hits[subtile]
            operations, blends = blend_subtile(
                f, state, subtile, x0, y0, hits[subtile, :n], mean, chol, opacity, colour, held, known_done
            )
            counts[batch, subtile // params.UNITS, subtile % params.UNITS] = operations
            totals[0] += n
            totals[1] += operations
            totals[2] += blends
        if ahead and batch < done and _done(f, state):
            done = batch
    totals[3] = end


@numba.njit(cache=True, parallel=True, error_model="numpy")
def _raster(
    f: Formats, integer, offsets, words, kept, cut, batch_offsets, mean, chol, opacity, colour, key, tile_xy, size,
    background, words_out, bitmaps, value, rgb8, transmittance, counts, totals,
):  # fmt: skip
    for tile in numba.prange(len(tile_xy)):
        state = np.empty((params.SUBTILES, 4, params.SUBTILE**2), integer.dtype)
        begin, end = offsets[tile], offsets[tile + 1]
        x0, y0 = tile_xy[tile]
        _raster_tile(
            f, words[begin:end], kept[begin:end], cut, mean, chol, opacity, colour, key, x0, y0, size,
            words_out[begin:end], bitmaps[begin:end], state, counts[batch_offsets[tile] : batch_offsets[tile + 1]],
            totals[tile],
        )  # fmt: skip
        resolve_tile(f, state, x0, y0, background, value, rgb8, transmittance)


def rasterise(
    f: Formats,
    tables,
    features,
    tile_xy,
    width: int,
    height: int,
    background=(0, 0, 0),
    first: int = params.CHUNK,
    length: int = params.CHUNK,
    ahead: int = 0,
    kept: np.ndarray | None = None,
) -> RasterResult:
    """One frame. The first batch of a tile has up to `first` entries (gs_late_core), every other one up to `length`.

    ahead > 0: a batch is not fetched when every pixel of its tile was done behind the batch `ahead` places in front of
    it; its entries leave as they are in `kept` (int64[E], default: the tables). 0: all are fetched.
    tables: (offsets int64[T + 1], words int64[E]), valid entries in table order.
    features: arrays mean [N, 2], chol [N, 3] (a, b, c), opacity [N], colour [N, 3], key [N] of record codes.
    tile_xy: int64[T, 2] pixel origins. background: three UQ3.COLOUR_F codes. Pixels of no tile stay 0.
    """
    offsets, words = (np.ascontiguousarray(x, np.int64) for x in tables)
    tile_xy = np.ascontiguousarray(tile_xy, np.int64).reshape(-1, 2)
    if len(offsets) != len(tile_xy) + 1 or offsets[-1] != len(words):
        raise ValueError(f"tables of {len(offsets) - 1} tiles and {offsets[-1]} entries: {len(tile_xy)}, {len(words)}")
    columns = [
        np.ascontiguousarray(getattr(features, name), np.int64) for name in ("mean", "chol", "opacity", "colour", "key")
    ]
    kept = words if kept is None else np.ascontiguousarray(kept, np.int64)
    n = np.diff(offsets)
    batches = np.where(n > 0, 1 + -(-np.maximum(n - first, 0) // length), 0)
    batch_offsets = np.concatenate(([0], np.cumsum(batches))).astype(np.int64)
    totals = np.zeros((len(tile_xy), 4), np.int64)
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
        fetched=totals[:, 3],
    )
    integer = np.zeros(0, np.int32 if formats.narrow(f) else np.int64)  # of the pixels' state
    chunk = numba.set_parallel_chunksize(1)  # tiles differ much in length
    try:
        _raster(
            f, integer, offsets, words, kept, (first, length, ahead), batch_offsets, *columns, tile_xy,
            (width, height), np.array(background, np.int64), result.words_out, result.bitmaps,
            result.value, result.rgb8, result.transmittance, result.counts, totals,
        )  # fmt: skip
    finally:
        numba.set_parallel_chunksize(chunk)
    return result
