"""gs_late_core: a tile's nearly sorted table to its pixels and to its table in the fresh order, batch by batch.

The functional model: each batch is sorted by the fresh keys of its records; what follows is the raster core's work.
When things happen: late_timing.py, which takes what `work` counts.
"""

from __future__ import annotations

import numba
import numpy as np

from golden import params, records, tables
from golden.formats import Formats
from golden.raster_core import group_finder
from golden.raster_core.candidate_matrix import BLOCK
from golden.raster_core.raster_core import RasterResult, rasterise


def rasterise_late(
    f: Formats, lists, features, tile_xy, width: int, height: int, background=(0, 0, 0), first: int = params.CHUNK
) -> RasterResult:
    """One frame. Arguments as of raster_core.rasterise; words_out and bitmaps are in the order of blending.

    first: entries in a tile's first batch, sorting_core.first_length of the frame.
    """
    merged = tables.Lists(*(np.ascontiguousarray(x, np.int64) for x in lists))
    order = tables.late_sort(merged, np.ascontiguousarray(features.key, np.int64), first)
    return rasterise(f, (order.offsets, order.words), features, tile_xy, width, height, background, first)


@numba.njit(cache=True, parallel=True, error_model="numpy")
def _work(
    f: Formats,
    offsets,
    words,
    bitmaps,
    fetched,
    cut,
    batch_offsets,
    mean,
    chol,
    opacity,
    tile_xy,
    width,
    height,
    hits,
    candidates,
):
    first, length = cut
    for tile in numba.prange(len(tile_xy)):
        x0, y0 = tile_xy[tile]
        end = offsets[tile]
        over = end + fetched[tile]
        for batch in range(batch_offsets[tile], batch_offsets[tile + 1]):
            begin = end
            end = min(begin + (length if batch > batch_offsets[tile] else first), over)
            for e in range(begin, end):
                g = words[e] & records.INDEX_MASK
                mask = group_finder.mask(
                    f, chol[g, 0], chol[g, 1], chol[g, 2], mean[g, 0], mean[g, 1], opacity[g], x0, y0, width, height
                )
                for subtile in range(params.SUBTILES):  # f.bound may hit what the groups' test rules out
                    mask |= np.int64((bitmaps[e] >> np.uint64(subtile)) & np.uint64(1)) << (subtile // params.UNITS)
                for group in range(params.GROUPS):
                    candidates[batch, group, (e - begin) // BLOCK] += (mask >> group) & 1
                for subtile in range(params.SUBTILES):
                    hit = (bitmaps[e] >> np.uint64(subtile)) & np.uint64(1)
                    hits[batch, subtile // params.UNITS, subtile % params.UNITS] += hit


def work(
    f: Formats,
    result: RasterResult,
    offsets,
    features,
    tile_xy,
    width: int,
    height: int,
    first: int = params.CHUNK,
    length: int = params.CHUNK,
) -> tuple[np.ndarray, np.ndarray]:
    """What cycles depend on: (hits uint16[B, GROUPS, UNITS], candidates uint8[B, GROUPS, ceil(length / BLOCK)]).

    result: of rasterise with these lists, first and length. hits: entries in the list of each unit and group, also
    where the subtile is known to be done (counts of result: 0 there). candidates: entries that are tested, for each
    word of BLOCK entries of a group.
    """
    columns = [np.ascontiguousarray(getattr(features, name), np.int64) for name in ("mean", "chol", "opacity")]
    hits = np.zeros((result.batch_offsets[-1], params.GROUPS, params.UNITS), np.uint16)
    candidates = np.zeros((result.batch_offsets[-1], params.GROUPS, -(-length // BLOCK)), np.uint8)
    _work(
        f, np.ascontiguousarray(offsets, np.int64), result.words_out, result.bitmaps, result.fetched,
        (first, length), result.batch_offsets, *columns,
        np.ascontiguousarray(tile_xy, np.int64).reshape(-1, 2), width, height, hits, candidates,
    )  # fmt: skip
    return hits, candidates
