"""gs_chunk_sorter: sorts a list chunk by chunk and merges it with a sorted one, in data and in cycles.

Neo, section 4 (dynamic partial sorting, Algorithm 1): the table of the last frame is cut into chunks of CHUNK entries,
and the cuts of even frames lie CHUNK / 2 before those of odd ones, so that entries cross them. Here a chunk begins
where the one before it ends and the last one ends with the table, so each frame sorts every entry exactly once.

Cycles are counted from the one that accepts the command. What a command carries from chunk to chunk is int64[STATE_N].
"""

from __future__ import annotations

from itertools import pairwise

import numba
import numpy as np

from golden import params
from golden.records import INVALID
from golden.sorting_core import bitonic_sort_unit, merge_sort_unit
from golden.sorting_core.merge_sort_unit import takes_a

LOAD = 0  # first cycle in which the loader may take a beat
FREE = 1  # first cycle in which the MSU+ may take a beat of the next merge
A, B, SENT = 2, 3, 4  # beats of a and b merged, entries sent
STATE_N = 5


def first_length(number: int, chunk: int = params.CHUNK) -> int:
    """Entries in the first chunk of a pass: a chunk in odd passes, half of it in even ones."""
    return chunk if number % 2 else chunk // 2


def ranges(n: int, first: int = params.CHUNK, chunk: int = params.CHUNK) -> list[tuple[int, int]]:
    """(start, end) of each chunk of a table of n entries."""
    cuts = [0, *range(first, n, chunk), n] if n else [0]
    return list(pairwise(cuts))


@numba.njit(cache=True)
def sort_chunks(a, first=params.CHUNK, chunk=params.CHUNK):
    """[n] entries, each chunk ascending; the first one has `first` entries."""
    out = np.empty_like(a)
    start, length = 0, first
    while start < len(a):
        part = a[start : start + length]
        # numba's quicksort cannot be compiled where pytest rewrites assertions, as it does in the benches
        out[start : start + length] = part[np.argsort(part, kind="mergesort")]
        start += length
        length = chunk
    return out


def sort(a: np.ndarray, b: np.ndarray, first: int = params.CHUNK, chunk: int = params.CHUNK) -> np.ndarray:
    """SORT: int64[m] valid entries of the table a, sorted chunk by chunk, and of the sorted list b, merged."""
    return merge_sort_unit.merge(sort_chunks(a, first, chunk), b)


def merge(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """MERGE: int64[m] valid entries of two sorted lists."""
    return merge_sort_unit.merge(a, b)


@numba.njit(cache=True)
def new_state():
    """State of a command that cycle 0 accepts."""
    state = np.zeros(STATE_N, np.int64)
    state[LOAD] = state[FREE] = 1
    return state


@numba.njit(cache=True)
def pass_cycles(n, sort_n=params.SORT_N):
    """Cycles from the first beat of a chunk's first pass to the first beat of its merge with b, n entries.

    A pass from runs of L to runs of 4L takes each entry and two more cycles: the last entry is written, the readers
    fetch anew. Passes follow while there are more than two runs, which the merge with b takes as they are.
    """
    total = 0
    run = sort_n
    while 2 * run < n:
        run *= 4
        total += n + 2
    return total


@numba.njit(cache=True)
def load(state, arrival, cut, sort_steps, sort_n=params.SORT_N):
    """Cycles int64[n + 1] in which the loader takes the beats of a chunk of n entries; sets state[FREE] to the first
    cycle of its merge.

    arrival: int64[n + 1], first cycle in which each beat is offered, end beat included; cut: the chunk is full, so the
    core makes its end beat. The loader works (bitonic_sort_unit.timing) while the chunk before is sorted and merged; a
    cycle behind its end beat, and when that one is done, the sorter takes the chunk and the loader the next one. Two
    cycles later the first pass begins, and pass_cycles later the merge.
    """
    n = len(arrival) - 1
    offered = np.maximum(arrival, state[LOAD])
    if cut:
        offered[n] = state[LOAD]
    taken, left = bitonic_sort_unit.timing(offered, sort_steps, sort_n)
    take = max(left[n] + 1, state[FREE])
    state[LOAD] = take + 1
    state[FREE] = take + 2 + pass_cycles(n, sort_n)
    return taken


@numba.njit(cache=True)
def join(state, a, b, a_arrival, b_arrival, end, last, stored, a_taken, b_taken, merged, sent):
    """The MSU+ takes a[:end] and what of b goes before it; if last also the rest of b and both end beats.

    A beat a cycle, while both heads are there; those of a wait in memory if stored. Writes when beats are taken, the
    entries sent, and when the MSU+ takes each of them.
    """
    t, i, j, m = state[FREE], state[A], state[B], state[SENT]
    while i < end or last:
        t = max(t, b_arrival[j])
        if not stored:
            t = max(t, a_arrival[i])
        if i == len(a) and j == len(b):
            b_taken[j] = sent[m] = t
            if not stored:
                a_taken[i] = t
            t, i, j, m = t + 1, i + 1, j + 1, m + 1
            break
        if i < len(a) and (j == len(b) or takes_a(a[i], b[j], False)):
            entry = a[i]
            if not stored:
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
    state[FREE], state[A], state[B], state[SENT] = t, i, j, m


@numba.njit(cache=True)
def step(state, a, b, a_arrival, b_arrival, length, sort_steps, a_taken, b_taken, merged, sent, sort_n=params.SORT_N):
    """SORT: the next chunk, of up to `length` entries; tells whether there is another one behind it.

    a: the table, its chunks sorted. a_arrival, b_arrival: as in timing of sorting_core.py, but only those of this
    chunk and those of b that its merge looks at need be known. Fills a_taken, b_taken, merged and sent (join).
    """
    start = state[A]
    end = min(start + length, len(a))
    cut = end - start == length
    taken = load(state, a_arrival[start : end + 1], cut, sort_steps, sort_n)
    a_taken[start:end] = taken[: end - start]
    if not cut:
        a_taken[end] = taken[end - start]
    join(state, a, b, a_arrival, b_arrival, end, not cut, True, a_taken, b_taken, merged, sent)
    return cut
