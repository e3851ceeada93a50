"""gs_sorting_core: repairs a table chunk by chunk and merges it with the sorted incoming entries.

Neo, section 4 (dynamic partial sorting, Algorithm 1): the table of the last frame is cut into chunks of CHUNK entries,
and the cuts of even frames lie CHUNK / 2 before those of odd ones, so that entries cross them. Here a chunk begins
where the one before it ends and the last one ends with the table, so each frame sorts every entry exactly once.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numba
import numpy as np

from golden import params
from golden.records import INVALID
from golden.sorting_core import bitonic_sort_unit, merge_sort_unit
from golden.sorting_core.merge_sort_unit import takes_a


def first_length(frame: int) -> int:
    """Entries in the first chunk of a frame: CHUNK in odd frames, half of it in even ones."""
    return params.CHUNK if frame % 2 else params.CHUNK // 2


def ranges(n: int, first: int = params.CHUNK, chunk: int = params.CHUNK) -> list[tuple[int, int]]:
    """(start, end) of each chunk of a table of n entries."""
    cuts = [0, *range(first, n, chunk), n] if n else [0]
    return list(pairwise(cuts))


@numba.njit(cache=True)
def sort_chunks(a, first=params.CHUNK):
    """[n] entries, each chunk ascending."""
    out = a.copy()
    start, length = 0, first
    while start < len(a):
        out[start : start + length].sort()
        start += length
        length = params.CHUNK
    return out


def sort(a: np.ndarray, b: np.ndarray, first: int = params.CHUNK) -> np.ndarray:
    """SORT: int64[m] valid entries of the table a, sorted chunk by chunk, and of the sorted list b, merged."""
    return merge_sort_unit.merge(sort_chunks(a, first), b)


def merge(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """MERGE: int64[m] valid entries of two sorted lists."""
    return merge_sort_unit.merge(a, b)


@numba.njit(cache=True)
def pass_cycles(n):
    """Cycles from the first beat of a chunk's first pass to the first beat of its merge with b, n entries.

    A pass from runs of L to runs of 2L takes each entry and an end beat for each of its ceil(n / 2L) pairs, and two
    more cycles: the last entry is written, the readers fetch anew. Passes follow until there is one run.
    """
    total = 0
    run = params.SORT_N
    while run < n:
        run *= 2
        total += n + (n + run - 1) // run + 2
    return total


@numba.njit(cache=True)
def blocks(taken, depth, busy):
    """gs_block_buffer: (first beat int64[k], length int64[k]) of the blocks of a list, its sink always ready.

    taken: int64[n + 1], the cycle in which the buffer takes each beat, end beat included; busy: the cycle of the last
    beat of the block in front of this list. A block's beats are consecutive; it leaves in the cycle behind the beat
    that closes it, or behind the last beat of the block before it.
    """
    n = len(taken) - 1
    count = n // depth + 1
    first = np.zeros(count, np.int64)
    length = np.full(count, depth, np.int64)
    length[count - 1] = n % depth
    for block in range(count):
        first[block] = max(taken[min((block + 1) * depth - 1, n)], busy) + 1
        busy = first[block] + max(length[block], 1) - 1
    return first, length


def block_buffer_cycles(n: int, depth: int = params.CHUNK) -> int:
    """Cycles from the first beat of a list of n entries into the block buffer to the last beat of its last block."""
    first, length = blocks(np.arange(n + 1), depth, -1)
    return int(first[-1] + max(length[-1], 1))


@numba.njit(cache=True)
def _join(a, b, a_arrival, b_arrival, at, end, last, a_taken, b_taken, merged, sent):
    """The MSU+ takes a[:end] and what of b goes before it; in the last chunk also the rest of b and both end beats.

    at is (first cycle in which it may take a beat, beats taken of a and of b, entries sent) and returned as it is then.
    Writes when beats are taken, the entries sent, and when the MSU+ takes each of them.
    """
    t, i, j, m = at
    while i < end or last:
        t = max(t, a_arrival[i], b_arrival[j])
        if i == len(a) and j == len(b):
            a_taken[i] = b_taken[j] = sent[m] = t
            return t + 1, i + 1, j + 1, m + 1
        if i < len(a) and (j == len(b) or takes_a(a[i], b[j], False)):
            entry = a[i]
            a_taken[i] = t
            i += 1
        else:
            entry = b[j]
            b_taken[j] = t
            j += 1
        if entry < INVALID:
            merged[m] = entry
            sent[m] = t
            m += 1
        t += 1
    return t, i, j, m


@numba.njit(cache=True)
def _timing(a_arrival, b_arrival, a, b, first, merging, sort_steps, busy):
    n = len(a)
    a_taken = np.zeros(n + 1, np.int64)
    b_taken = np.zeros(len(b) + 1, np.int64)
    merged = np.empty(n + len(b), np.int64)
    sent = np.zeros(n + len(b) + 1, np.int64)
    at = (1, 0, 0, 0)
    if merging:
        at = _join(a, b, a_arrival, b_arrival, at, n, True, a_taken, b_taken, merged, sent)
    else:
        there = np.zeros(n + 1, np.int64)  # the sorted entries wait in the memory
        read = np.zeros(n + 1, np.int64)
        start, length = 0, first
        load = 1  # first cycle in which the loader may take a beat
        cut = True
        while cut:
            end = min(start + length, n)
            cut = end - start == length
            arrival = np.maximum(a_arrival[start : end + 1], load)
            if cut:
                arrival[end - start] = load  # a full chunk gets its end beat from the core
            taken, left = bitonic_sort_unit.timing(arrival, sort_steps)
            count = end - start if cut else end - start + 1
            a_taken[start : start + count] = taken[:count]
            take = max(left[end - start] + 1, at[0])  # the sorter takes the chunk
            at = (take + 2 + pass_cycles(end - start), at[1], at[2], at[3])
            at = _join(a, b, there, b_arrival, at, end, not cut, read, b_taken, merged, sent)
            load = take + 1
            start, length = end, params.CHUNK
    t, _, _, m = at
    block, size = blocks(sent[:m] + 1, params.CHUNK, busy)
    before = block[-2] + size[-2] - 1 if len(block) > 1 else busy
    return max(t, before) + 1, block, size, a_taken, b_taken, merged[: m - 1]


class Timing(NamedTuple):
    """Cycles of one command, counted from the cycle in which it is accepted."""

    ready: int  # first cycle in which cmd_ready is high again
    blocks: np.ndarray  # int64[k] first beat of each output block; its beats are consecutive
    lengths: np.ndarray  # int64[k] entries in each block
    a_taken: np.ndarray  # int64[n_a + 1] when each beat of a is taken, end beat included
    b_taken: np.ndarray  # int64[n_b + 1]
    entries: np.ndarray  # int64[m] the list itself

    @property
    def end(self) -> int:
        """The last beat of the last block."""
        return int(self.blocks[-1] + max(self.lengths[-1], 1) - 1)


def timing(
    a_arrival: np.ndarray,
    b_arrival: np.ndarray,
    words_a: np.ndarray,
    words_b: np.ndarray,
    first: int = params.CHUNK,
    merge: bool = False,
    network: int = bitonic_sort_unit.RING,
    busy: int = -1,
) -> Timing:
    """When everything happens in one command whose cycle 0 is the one that accepts it; the sink is always ready.

    a_arrival, b_arrival: int64[n + 1], first cycle in which each beat is offered, end beat included. busy: cycle of the
    last beat of the list before, when it is still leaving.

    The loader takes a chunk (bitonic_sort_unit.timing) while the one before it is sorted and merged; a cycle behind its
    end beat, and when that one is done, the sorter takes it. Two cycles later its first pass begins, after
    pass_cycles its merge, which takes a beat a cycle while both heads are there (_join). What the MSU+ takes is in the
    block buffer a cycle later (blocks). The next command is accepted once the list's last block no longer waits.
    """
    arrivals = (np.asarray(a_arrival, np.int64), np.asarray(b_arrival, np.int64))
    a = words_a if merge else sort_chunks(words_a, first)
    return Timing(*_timing(*arrivals, a, words_b, first, merge, bitonic_sort_unit.steps(network), busy))


def cycles(words_a: np.ndarray, words_b: np.ndarray, first: int = params.CHUNK, merge: bool = False) -> int:
    """Cycles from accepting a command to the last beat of its list, with every beat there from the start."""
    there = np.zeros(len(words_a) + 1, np.int64), np.zeros(len(words_b) + 1, np.int64)
    return timing(*there, words_a, words_b, first, merge).end
