"""The late core's model: batches of any length, what its cycles are counted from, and bounds on them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from golden import params, records
from golden.formats import REFERENCE
from golden.raster_core import late_buffer, late_core, late_timing
from golden.raster_core.group_finder import mask
from golden.raster_core.raster_core import rasterise
from tb.raster_core.scenes import every_entry, scene, tiles

SIZE = (130, 70)
FIRSTS = (1, params.CHUNK // 2, params.CHUNK)


@pytest.fixture(scope="module")
def drawn():
    """(features, lists, tile_xy, {first: result}): every Gaussian in every tile, in no order."""
    features = scene(300, *SIZE, seed=4, sigma=4.0)
    features.key >>= 12
    xy = tiles(*SIZE)
    offsets, words = every_entry(features, len(xy))
    words = words[np.random.default_rng(0).permuted(np.arange(len(words)).reshape(len(xy), -1), axis=1).ravel()]
    lists = offsets, words
    return (
        features,
        lists,
        xy,
        {first: late_core.rasterise_late(REFERENCE, lists, features, xy, *SIZE, first=first) for first in FIRSTS},
    )


@pytest.mark.parametrize("first", FIRSTS)
def test_batches_are_sorted_and_lose_nothing(drawn, first):
    features, (offsets, words), _, results = drawn
    for begin, end in pairwise(offsets):
        spans = late_buffer.batches(end - begin, first)
        assert sum(n for _, n in spans) == end - begin
        assert all(n == (params.CHUNK if at else first) for at, n in spans[:-1])
        assert spans[-1][1] < (params.CHUNK if len(spans) > 1 else first)
        for at, n in spans:
            out = results[first].words_out[begin + at : begin + at + n] & ~records.INVALID
            index = records.indices_of(words[begin + at : begin + at + n])
            np.testing.assert_array_equal(out, np.sort(records.entries(features.key[index], index)))


def test_the_length_of_the_first_batch_changes_no_pixel(drawn):
    """The same order, cut in another way: pixels, bitmaps and blends stay."""
    features, (offsets, _), xy, results = drawn
    words = results[params.CHUNK].words_out & ~records.INVALID
    whole = rasterise(REFERENCE, (offsets, words), features, xy, *SIZE)
    for first in (1, 100, 299, 300):
        cut = rasterise(REFERENCE, (offsets, words), features, xy, *SIZE, first=first)
        assert len(cut.counts) == len(xy) * sum(n > 0 for _, n in late_buffer.batches(300, first))
        for name in ("words_out", "bitmaps", "value", "rgb8", "transmittance", "pairs", "blends"):
            np.testing.assert_array_equal(getattr(cut, name), getattr(whole, name), err_msg=f"{name}, first {first}")


@pytest.mark.parametrize("first", FIRSTS)
def test_work_counts_hits_and_candidates(drawn, first):
    features, (offsets, _), xy, results = drawn
    result = results[first]
    hits, candidates = late_core.work(REFERENCE, result, offsets, features, xy, *SIZE, first)
    assert ((result.counts == hits) | (result.counts == 0)).all()
    np.testing.assert_array_equal(np.add.reduceat(hits.sum(axis=(1, 2)), result.batch_offsets[:-1]), result.pairs)
    f, tile = features, 1
    for k, (at, n) in enumerate(late_buffer.batches(300, first)):
        index = records.indices_of(result.words_out[offsets[tile] + at : offsets[tile] + at + n])
        found = np.array([mask(REFERENCE, *f.chol[g], *f.mean[g], f.opacity[g], *xy[tile], *SIZE) for g in index])
        for block in range(0, n, 16):
            bits = found[block : block + 16, None] >> np.arange(params.GROUPS) & 1
            batch = result.batch_offsets[tile] + k
            np.testing.assert_array_equal(candidates[batch, :, block // 16], bits.sum(axis=0))


def test_cycles_keep_to_the_bounds_of_every_stage(drawn):
    """Records, operations of each SCU and pixels take what they must, and not much more than their sum."""
    features, (offsets, _), xy, results = drawn
    result = results[params.CHUNK]
    hits, candidates = late_core.work(REFERENCE, result, offsets, features, xy, *SIZE)
    state = late_timing.new_state(0)
    times, px = np.zeros(late_timing.BATCH_N, np.int64), np.zeros(late_timing.PX_N, np.int64)
    before = 0
    for tile in range(len(xy)):
        assert late_timing.begin_tile(state, 0, params.CHUNK) >= 0
        for k, (_, n) in enumerate(late_buffer.batches(offsets[tile + 1] - offsets[tile])):
            row = result.batch_offsets[tile] + k
            free = late_timing.fill_free(state)
            work = hits[row], result.counts[row], candidates[row]
            late_timing.step_batch(state, n, np.zeros(n + 1, np.int64), np.full(n, 20), 3, *work, times)
            assert times[late_timing.FILL_FIRST] == free
            assert times[late_timing.RECORD_LAST] >= free + 20 + 3 * (n - 1)
            assert times[late_timing.TESTED] >= times[late_timing.SORTED] + candidates[row].sum()
            operations = result.counts[row].astype(np.int64).sum(axis=0).max()
            assert times[late_timing.BLENDED] >= max(times[late_timing.SORTED], before) + params.BEATS * operations
            assert times[late_timing.OUT_FIRST] > times[late_timing.TESTED]
            assert times[late_timing.OUT_LAST] == times[late_timing.OUT_FIRST] + max(n, 1) - 1
        late_timing.end_tile(state, 100, px)
        assert px[1] == px[0] + 99
        assert px[0] > times[late_timing.BLENDED]
        before = px[1] - 10
