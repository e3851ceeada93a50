"""gs_late_sorter: the order of a batch by its fresh keys, and when it is known.

Cycles are named as in timing.py.
"""

from __future__ import annotations

import numba
import numpy as np

from golden.sorting_core import bitonic_sort_unit, chunk_sorter

# State. The first STATE_N of chunk_sorter, of the tile's command, then:
TAKEN = chunk_sorter.STATE_N  # the sorter took the last word or end beat (a past cycle)
COMMAND = TAKEN + 1  # the next command can be accepted
OPEN = COMMAND + 1  # 1: the tile has a command
STATE_N = OPEN + 1

SORT_STEPS = bitonic_sort_unit.steps()


def order(words: np.ndarray) -> np.ndarray:
    """[n] slots of a batch in the order of its words {key, index}; of equal ones the lower slot first."""
    return np.argsort(words, kind="stable")


def new_sorter(origin: int) -> np.ndarray:
    """State int64[STATE_N] of a sorter whose reset is low from cycle `origin` on."""
    state = np.zeros(STATE_N, np.int64)
    state[[TAKEN, COMMAND]] = origin - 1, origin
    return state


@numba.njit(cache=True)
def sort_batch(state, keys, known, last):
    """Cycle of the first entry of the next batch in order; the others follow one a cycle.

    keys int64[n]: cycles in which the keys come; known: cycle of the batch's last beat, for that its n is known from
    the next one on; last: the batch is its tile's last, so an end beat follows.

    A word is read in the cycle behind its key, if the word before it goes to the sorter by then, and is offered in the
    next one. The first word of a tile, or its end beat, asks for the command.
    """
    n = len(keys)
    offered = np.empty(n + 1, np.int64)
    offered[:n] = keys + 2
    offered[n] = known + 2
    if not state[OPEN]:
        accepted = max(max(offered[0], state[TAKEN] + 1), state[COMMAND])
        state[chunk_sorter.LOAD] = accepted + 1
        state[chunk_sorter.FREE] = accepted + 1
    taken = chunk_sorter.load(state[: chunk_sorter.STATE_N], offered, not last, SORT_STEPS)
    merge = state[chunk_sorter.FREE]
    state[TAKEN] = taken[n] if last else taken[n - 1]
    state[chunk_sorter.FREE] = merge + n
    if last:
        state[COMMAND] = merge + n + 2  # the end beats of both lists are taken, the list's one is sent
    state[OPEN] = 0 if last else 1
    return merge + 1
