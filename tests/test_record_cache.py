"""Lines that raster cores fetch for records, against a plain least-recently-used cache."""

from __future__ import annotations

from collections import OrderedDict

import numpy as np
import pytest

from golden.timing.address_map import LINE
from golden.timing.record_cache import fetch

RECORD, CHUNK, TILES = 24, 256, 10


def tables(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(offsets, index, place): tiles that have Gaussians in common; one is empty, one longer than two batches."""
    rng = np.random.default_rng(seed)
    lengths = np.array([300, 0, 700, 256, 1, 90, 512, 40, 255, 257])
    pool = [rng.choice(900, size, replace=False) for size in lengths]
    return np.concatenate(([0], np.cumsum(lengths))), np.concatenate(pool), rng.permutation(900)


def turns(visits: list[list[int]], offsets: np.ndarray):
    """(core, entry) in the order of accesses: a batch a core, in turn."""
    queues = []
    for tiles in visits:
        runs = [range(offsets[t], offsets[t + 1]) for t in tiles]
        queues.append([run[k : k + CHUNK] for run in runs for k in range(0, max(len(run), 1), CHUNK)])
    for turn in range(max(len(queue) for queue in queues)):
        for core, queue in enumerate(queues):
            if turn < len(queue):
                yield from ((core, e) for e in queue[turn])


def reference(offsets, index, place, base, stride, visits, cache_kb, shared, ways) -> list[list[int]]:
    caches = 1 if shared else len(visits)
    sets = cache_kb * 1024 // LINE // ways // caches
    held = [[OrderedDict() for _ in range(sets)] for _ in range(caches)]
    lines: list[list[int]] = [[] for _ in index]
    for core, e in turns(visits, offsets):
        begin = base + int(place[index[e]]) * stride
        for line in range(begin // LINE, (begin + RECORD - 1) // LINE + 1):
            if sets:
                row = held[0 if shared else core][line % sets]
                if line in row:
                    row.move_to_end(line)
                    continue
                row[line] = True
                if len(row) > ways:
                    row.popitem(last=False)
            lines[e].append(line)
    return lines


@pytest.mark.parametrize("stride", [24, 32, 64])
@pytest.mark.parametrize(
    ("cache_kb", "shared", "ways"), [(0, False, 4), (2, False, 1), (4, False, 4), (4, True, 4), (8, True, 2)]
)
def test_fetched_lines_equal_a_plain_cache(stride, cache_kb, shared, ways):
    offsets, index, place = tables(stride + ways)
    visits = [[3, 0, 1], [2, 9], [6, 4, 5], [7]]  # no core draws tile 8
    got = fetch(offsets, index, place, 64 * 1000, stride, visits, cache_kb, shared, ways)
    lines = reference(offsets, index, place, 64 * 1000, stride, visits, cache_kb, shared, ways)
    assert np.array_equal(np.diff(got.line_at), [len(x) for x in lines])
    assert got.lines.tolist() == [line for part in lines for line in part]
    assert got.fetched == got.lines.size
    drawn = index.size - np.diff(offsets)[8]
    if stride != RECORD:
        assert got.asked == drawn
    if not cache_kb:
        assert got.hit_rate == 0 and (stride == RECORD or got.fetched == drawn)
    else:
        assert got.hit_rate < 1
        assert got.hit_rate > 0 or stride == 64


def test_a_record_across_a_border_needs_two_lines():
    place = np.arange(8)
    got = fetch(np.array([0, 8]), place, place, 0, 24, [[0]])
    assert np.diff(got.line_at).tolist() == [1, 1, 2, 1, 1, 2, 1, 1]
    assert got.lines.tolist() == [0, 0, 0, 1, 1, 1, 1, 2, 2, 2]


def test_neighbours_in_memory_share_lines():
    """All records of two tiles, in order, fit the cache: each line is fetched once."""
    index = np.tile(np.arange(160), 2)
    got = fetch(np.array([0, 160, 320]), index, np.arange(160), 0, 24, [[0], [1]], 8, True)
    assert got.fetched == 160 * 24 // LINE
    apart = fetch(np.array([0, 160, 320]), index, np.arange(160), 0, 24, [[0], [1]], 8)
    assert apart.fetched == 2 * got.fetched


def test_a_cache_needs_a_set_for_each_core():
    with pytest.raises(ValueError, match="record cache of 1 KB in 8 parts"):
        fetch(np.zeros(2, int), np.zeros(0, int), np.zeros(0, int), 0, 24, [[0]] * 8, 1)


def test_no_entries():
    got = fetch(np.zeros(2, int), np.zeros(0, int), np.zeros(0, int), 0, 24, [[0]], 4)
    assert got.lines.size == 0 and got.hit_rate == 0
