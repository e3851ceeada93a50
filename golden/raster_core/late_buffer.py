"""gs_late_buffer: a table cut into batches, each in its fresh order, and when they can be tested and are written back.

Cycles are named as in timing.py; requests and the table that is written back never stall. A batch passes
request_batch, sort_batch and end_batch in this order; each of them takes the batches in turn.
"""

from __future__ import annotations

from itertools import pairwise

import numba
import numpy as np

from golden import params, records
from golden.formats import Formats
from golden.raster_core import late_sorter
from golden.raster_core.batch_buffer import load
from golden.raster_core.candidate_matrix import done_cycle

BANKS = 3

# State: the first cycle in which something can happen again, unless said otherwise.
TILE = 0  # the next tile can be taken
FILL = 1  # the next beat of the tile can be taken, if a bank is free
LIMIT = 2  # most entries of the next batch
OUT = 3  # the next batch can be read for write-back
FILL_BANK = 4  # number of the bank of the next request_batch
SORT_BANK = 5  # sort_batch
END_BANK = 6  # end_batch
FREE = 7  # [BANKS] the bank can take entries
CLOSED = FREE + BANKS  # [BANKS] cycle of the last beat of its batch
LAST = CLOSED + BANKS  # [BANKS] 1: its batch is its tile's last
LENGTH = LAST + BANKS  # entries of a batch that is not its tile's first or last
SORTER = LENGTH + 1  # state of late_sorter
STATE_N = SORTER + late_sorter.STATE_N


def batches(n: int, first: int = params.CHUNK) -> list[tuple[int, int]]:
    """(first entry, entries) of each batch of a table of n; the last one is shorter than its limit, maybe empty."""
    begins = [0, *range(first, n + 1, params.CHUNK)]
    return [(begin, end - begin) for begin, end in pairwise([*begins, n])]


def blocks(
    f: Formats, words: np.ndarray, hit: np.ndarray, first: int = params.CHUNK
) -> list[tuple[int | None, int, int]]:
    """A table's beats (word, len, last) of the block stream; the word of an empty block is None.

    words [n]: entries {key, index} with fresh keys, as they come; hit [n]: whether a subtile is.
    """
    spans = batches(len(words), first)
    out: list[tuple[int | None, int, int]] = []
    for begin, n in spans:
        last = int((begin, n) == spans[-1])
        here = begin + late_sorter.order(words[begin : begin + n])
        marked = words[here] | np.where(hit[here], 0, records.INVALID)
        out += [(int(word), n, last) for word in records.hardware(f, marked)] or [(None, 0, last)]
    return out


def new_buffer(origin: int, length: int = params.CHUNK) -> np.ndarray:
    """State int64[STATE_N] of a buffer whose reset is low from cycle `origin` on, for batches of `length` entries."""
    state = np.full(STATE_N, origin, np.int64)
    state[[FILL_BANK, SORT_BANK, END_BANK]] = 0
    state[LENGTH] = length
    state[SORTER:] = late_sorter.new_sorter(origin)
    return state


@numba.njit(cache=True)
def begin_tile(state, tile_valid, first):
    """Cycle in which a tile is taken, offered from cycle `tile_valid` on; first: most entries of its first batch."""
    taken = max(tile_valid, state[TILE])
    state[FILL] = taken + 1
    state[LIMIT] = first
    return taken


@numba.njit(cache=True)
def fill_free(state):
    """First cycle in which a beat of the next batch can be taken."""
    return max(state[FILL], state[FREE + state[FILL_BANK]])


@numba.njit(cache=True)
def request_batch(state, arrivals, requests):
    """Entries of the tile's next batch, len(requests) of them; returns the cycle of its last beat.

    arrivals int64[n], with the end beat [n + 1]: cycles from which each beat is offered, if those before it are gone.
    Fills requests int64[n]: the cycle in which each record is requested. One that comes 3 cycles behind the last one is
    taken at once.
    """
    n = len(requests)
    bank = state[FILL_BANK]
    fill = load(fill_free(state), arrivals, requests)
    state[LAST + bank] = n < state[LIMIT]
    if state[LAST + bank]:
        fill = max(fill, arrivals[n]) + 1
        state[TILE] = fill
    state[FILL] = fill
    state[LIMIT] = state[LENGTH]
    state[CLOSED + bank] = fill - 1
    state[FILL_BANK] = (bank + 1) % BANKS
    return fill - 1


@numba.njit(cache=True)
def sort_batch(state, came):
    """Cycle from which the next batch shows test_valid, when those before it are issued.

    came int64[n]: cycles in which its records come. A mask goes to the candidates in the cycle behind its entry in
    order; the batch is shown in the cycle behind the candidates' done.
    """
    bank = state[SORT_BANK]
    state[SORT_BANK] = (bank + 1) % BANKS
    closed = state[CLOSED + bank]
    first = late_sorter.sort_batch(state[SORTER:], came, closed, state[LAST + bank] == 1)
    return done_cycle(first + len(came)) + 1 if len(came) > 0 else closed + 1


@numba.njit(cache=True)
def end_batch(state, n, hits_over, blend_done, block):
    """Write-back of the next batch, of n entries, and its end; hits_over, blend_done: cycles of these pulses.

    Fills block int64[2]: first and last beat. Behind the last one, and two cycles behind blend_done, the bank is free.
    """
    bank = state[END_BANK]
    state[END_BANK] = (bank + 1) % BANKS
    read = max(hits_over + 1, state[OUT])
    block[0] = read + 3
    block[1] = read + max(n, 1) + 2
    state[OUT] = block[1]
    state[FREE + bank] = max(block[1] + 1, blend_done + 2)
