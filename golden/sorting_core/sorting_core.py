"""gs_sorting_core: gs_chunk_sorter and its lists cut into blocks of a chunk, or of BLOCK where a chunk is longer.

What it computes is chunk_sorter.py's; here is when.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from golden import params
from golden.sorting_core import bitonic_sort_unit
from golden.sorting_core.chunk_sorter import (
    FREE,
    SENT,
    first_length,
    join,
    merge,
    new_state,
    pass_cycles,
    ranges,
    sort,
    sort_chunks,
    step,
)

BLOCK = params.CHUNK  # entries that one burst to memory can hold

__all__ = ["first_length", "merge", "pass_cycles", "ranges", "sort", "sort_chunks"]


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
def _timing(a_arrival, b_arrival, a, b, first, merging, sort_steps, busy, chunk):
    n = len(a)
    a_taken = np.zeros(n + 1, np.int64)
    b_taken = np.zeros(len(b) + 1, np.int64)
    merged = np.empty(n + len(b), np.int64)
    sent = np.zeros(n + len(b) + 1, np.int64)
    state = new_state()
    if merging:
        join(state, a, b, a_arrival, b_arrival, n, True, False, a_taken, b_taken, merged, sent)
    else:
        length = first
        while step(state, a, b, a_arrival, b_arrival, length, sort_steps, a_taken, b_taken, merged, sent):
            length = chunk
    m = state[SENT]
    block, size = blocks(sent[:m] + 1, min(chunk, BLOCK), busy)
    before = block[-2] + size[-2] - 1 if len(block) > 1 else busy
    return max(state[FREE], before) + 1, block, size, a_taken, b_taken, merged[: m - 1]


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
    chunk: int = params.CHUNK,
) -> Timing:
    """When everything happens in one command whose cycle 0 is the one that accepts it; the sink is always ready.

    a_arrival, b_arrival: int64[n + 1], first cycle in which each beat is offered, end beat included. busy: cycle of the
    last beat of the list before, when it is still leaving.

    Chunk by chunk: chunk_sorter.step. What the MSU+ takes is in the block buffer a cycle later (blocks). The next
    command is accepted once the list's last block no longer waits.
    """
    arrivals = (np.asarray(a_arrival, np.int64), np.asarray(b_arrival, np.int64))
    a = words_a if merge else sort_chunks(words_a, first, chunk)
    return Timing(*_timing(*arrivals, a, words_b, first, merge, bitonic_sort_unit.steps(network), busy, chunk))


def cycles(words_a: np.ndarray, words_b: np.ndarray, first: int = params.CHUNK, merge: bool = False) -> int:
    """Cycles from accepting a command to the last beat of its list, with every beat there from the start."""
    there = np.zeros(len(words_a) + 1, np.int64), np.zeros(len(words_b) + 1, np.int64)
    return timing(*there, words_a, words_b, first, merge).end
