"""The sorting core's golden model against plain sorts: chunks, merges, recovery from disorder, and its timing."""

import numpy as np
import pytest

from golden import params
from golden.formats import REFERENCE
from golden.records import INVALID, entries
from golden.sorting_core import bitonic_sort_unit, merge_sort_unit, sorting_core

C = params.CHUNK
LENGTHS = [0, 1, 2, 127, 128, 129, 200, 255, 256, 257, 383, 384, 385, 511, 512, 513, 1000]


def words(n: int, seed: int = 0, invalid: float = 0.0, keys: int = 0) -> np.ndarray:
    """[n] random entries; one in four keys comes twice, or there are only `keys` of them."""
    rng = np.random.default_rng([seed, n])
    key = rng.integers(0, keys or 1 << REFERENCE.key_w, n)
    key[rng.random(n) < 0.25] = key[0] if n else 0
    return entries(key, rng.integers(0, 1 << params.INDEX_W, n)) | (rng.random(n) < invalid) * INVALID


def inversions(x: np.ndarray) -> int:
    """Pairs that are in the wrong order."""
    return sum(int(np.count_nonzero(x[i + 1 :] < x[i])) for i in range(len(x)))


@pytest.mark.parametrize("network", [bitonic_sort_unit.ring, bitonic_sort_unit.bitonic], ids=["ring", "bitonic"])
@pytest.mark.parametrize("n", [4, 8, 16])
def test_the_networks_sort_every_input_of_zeros_and_ones(network, n):
    groups = (np.arange(1 << n)[:, None] >> np.arange(n)) & 1
    assert np.array_equal(network(groups), np.sort(groups, axis=1))


@pytest.mark.parametrize("network", [bitonic_sort_unit.ring, bitonic_sort_unit.bitonic], ids=["ring", "bitonic"])
def test_the_networks_keep_equal_entries_apart(network):
    groups = words(1600, keys=2).reshape(-1, params.SORT_N)
    assert np.array_equal(network(groups), np.sort(groups, axis=1))


@pytest.mark.parametrize("network", [bitonic_sort_unit.RING, bitonic_sort_unit.BITONIC], ids=["ring", "bitonic"])
def test_bsu_cycles_equal_its_recurrence(network):
    for n in range(70):
        for size in (8, 16):
            steps = bitonic_sort_unit.steps(network, size)
            taken, sent = bitonic_sort_unit.timing(np.zeros(n + 1, np.int64), steps, size)
            assert taken[0] == 0 and sent[n] + 1 == bitonic_sort_unit.cycles(n, network, size)


@pytest.mark.parametrize("invalid", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("n_a", [0, 1, 17, 256, 1000])
@pytest.mark.parametrize("n_b", [0, 1, 16, 3000])
def test_merge_is_the_sorted_union_of_what_is_valid(n_a, n_b, invalid):
    a, b = np.sort(words(n_a, 1, invalid)), np.sort(words(n_b, 2, invalid))
    both = np.sort(np.concatenate([a, b]))
    assert np.array_equal(merge_sort_unit.merge(a, b, True), both)
    assert np.array_equal(merge_sort_unit.merge(a, b), both[both < INVALID])


@pytest.mark.parametrize("keep", [False, True])
@pytest.mark.parametrize("lengths", [(0, 0, 0, 0), (5, 0, 9, 1), (40, 17, 0, 30), (16, 16, 16, 16)])
def test_four_lists_merge_to_the_sorted_union(lengths, keep):
    lists = [np.sort(words(n, seed, 0.3, 9)) for seed, n in enumerate(lengths)]
    every = np.sort(np.concatenate(lists))
    assert np.array_equal(merge_sort_unit.merge4(*lists, keep), every if keep else every[every < INVALID])


def test_merge_drops_invalid_entries_before_it_compares():
    a = np.array([3, INVALID, 1, INVALID | 9])
    b = np.array([INVALID, 2, 4])
    assert merge_sort_unit.merge(a, b).tolist() == [2, 3, 1, 4]


@pytest.mark.parametrize("n", LENGTHS)
@pytest.mark.parametrize("frame", [0, 1])
def test_ranges_cover_the_table_once(n, frame):
    first = sorting_core.first_length(frame)
    ranges = sorting_core.ranges(n, first)
    assert [i for start, end in ranges for i in range(start, end)] == list(range(n))
    assert all(0 < end - start <= C for start, end in ranges)
    a = words(n)
    by_range = [np.sort(a[start:end]) for start, end in ranges] or [a]
    assert np.array_equal(sorting_core.sort_chunks(a, first), np.concatenate(by_range))


@pytest.mark.parametrize("n", LENGTHS)
@pytest.mark.parametrize("frame", [0, 1])
def test_short_tables_are_sorted_at_once(n, frame):
    a = np.arange(n, 0, -1)
    none = a[:0]
    once = sorting_core.sort(a, none, sorting_core.first_length(frame))
    twice = sorting_core.sort(once, none, sorting_core.first_length(frame + 1))
    assert n > C // 2 or np.array_equal(once, np.sort(a))
    assert n > C or np.array_equal(twice, np.sort(a))


@pytest.mark.parametrize("frame", [0, 1])
def test_an_entry_crosses_the_borders_of_chunks(frame):
    a = np.arange(1, 1025)
    a[300] = 0
    for step in range(4):
        a = sorting_core.sort(a, a[:0], sorting_core.first_length(frame + step))
    assert a[0] == 0


@pytest.mark.parametrize("order", ["reversed", "random"])
@pytest.mark.parametrize("frame", [0, 1])
def test_a_table_recovers_from_any_disorder(order, frame):
    n = 4000
    a = np.arange(n)[::-1] if order == "reversed" else np.random.default_rng(0).permutation(n)
    before = inversions(a)
    for step in range(-(-2 * n // C)):
        a = sorting_core.sort(a, a[:0], sorting_core.first_length(frame + step))
        now = inversions(a)
        assert now <= before
        before = now
    assert before == 0


@pytest.mark.parametrize("first", [C, C // 2])
@pytest.mark.parametrize("n", LENGTHS)
def test_update_conserves_the_valid_entries(n, first):
    a, b = words(n, 3, 0.2), np.sort(words(n // 3, 4))
    out = sorting_core.sort(a, b, first)
    assert np.array_equal(np.sort(out), np.sort(np.concatenate([a[a < INVALID], b])))


@pytest.mark.parametrize("n", LENGTHS)
def test_timing_computes_the_same_list(n):
    a, b = words(n, 5, 0.1), np.sort(words(n // 2, 6, 0.1))
    arrivals = np.arange(n + 1) * 2, np.arange(n // 2 + 1) * 3
    for first in (C, C // 2, 100):
        assert np.array_equal(sorting_core.timing(*arrivals, a, b, first).entries, sorting_core.sort(a, b, first))
    assert np.array_equal(
        sorting_core.timing(*arrivals, np.sort(a), b, merge=True).entries, sorting_core.merge(np.sort(a), b)
    )


def test_merge_command_takes_a_beat_a_cycle():
    a, b = np.arange(1000), np.arange(300)
    there = np.zeros(1001, np.int64), np.zeros(301, np.int64)
    timing = sorting_core.timing(*there, a, b, merge=True)
    assert timing.a_taken[-1] == merge_sort_unit.cycles(1300)  # cycle 0 accepts the command
    assert timing.blocks[0] == C + 2
    assert timing.ready == timing.blocks[-1]  # the last block has waited for the one before it


def test_a_full_chunk_takes_two_passes_and_a_merge():
    assert C == 256 and sorting_core.pass_cycles(C) == sorting_core.pass_cycles(C, 16) == 2 * (C + 2)
    assert sorting_core.pass_cycles(2 * params.SORT_N) == 0
    assert sorting_core.pass_cycles(2 * params.SORT_N + 1) == 2 * params.SORT_N + 3
    assert sorting_core.pass_cycles(C // 4) == C // 4 + 2


def test_block_buffer_sends_while_it_fills():
    assert sorting_core.block_buffer_cycles(0) == 2
    assert sorting_core.block_buffer_cycles(C - 1) == 2 * C - 1
    assert sorting_core.block_buffer_cycles(4 * C) == 5 * C + 1
