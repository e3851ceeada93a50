"""gs_candidate_tester: the tests of a batch's candidates, group by group, and when they are done.

The tester goes through the words of candidate_matrix in order: a cycle for each candidate, one for a word without any.
A test begins when each queue has room for its hit, the last cycle of a group when each has room for its mark. Taken are
the slots and marks of complete lists (queue_blender tells when they leave), marks under way, and one slot of every
queue for each test whose list is not closed. Cycles as in timing.py.
"""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.raster_core import group_test_unit
from golden.raster_core.group_tester import group_hits
from golden.raster_core.queue_blender import left, taken

START = 2  # cycles from test_valid to the first test
LATENCY = 2 + group_test_unit.LATENCY  # from the read of a geometry to its hits
NEVER = 1 << 60

# What the state holds
NEXT = 0  # first cycle in which something can be issued again
QUEUE = 1  # slots of a queue
MARKS = 2  # marks of a queue
CLOSES = 3  # issued so far, of groups and of empty batches
ARRIVED = 4  # of these
OPEN = 5  # tests of the others
SLOTS = 6  # [UNITS] of the lists that have arrived
RING = SLOTS + params.UNITS  # of each close: its cycle, tests, hits of each unit
RECENT = 16  # closes remembered: more than can be under way
CLOSE_N = 2 + params.UNITS
STATE_N = RING + RECENT * CLOSE_N


def tests(masks: np.ndarray, bitmaps: np.ndarray) -> list[tuple[int, int, int]]:
    """(group, position, hits) of each test of a batch, in order. masks [n] of groups; bitmaps uint64[n]."""
    hits = group_hits(bitmaps)
    return [
        (group, int(at), int(hits[group, at]))
        for group in range(params.GROUPS)
        for at in np.flatnonzero(masks >> group & 1)
    ]


def new_tester(origin: int, queue: int = params.QUEUE, marks: int = params.MARKS) -> np.ndarray:
    """State int64[STATE_N] of a tester whose reset is low from cycle `origin` on, and its queues' sizes."""
    state = np.zeros(STATE_N, np.int64)
    state[[NEXT, QUEUE, MARKS]] = origin, queue, marks
    return state


@numba.njit(cache=True)
def _arrive(state, cycle):
    """Count what has been closed in front of `cycle`; returns the cycle of the next close, or NEVER."""
    while state[ARRIVED] < state[CLOSES]:
        at = RING + state[ARRIVED] % RECENT * CLOSE_N
        if state[at] >= cycle:
            return state[at]
        state[ARRIVED] += 1
        state[OPEN] -= state[at + 1]
        for unit in range(params.UNITS):
            state[SLOTS + unit] += state[at + 2 + unit]
    return np.int64(NEVER)


@numba.njit(cache=True)
def _slots_free(state, units, more):
    """First cycle in which each queue has room for `more` tests, unless a close makes room earlier."""
    excess = state[OPEN] + more - state[QUEUE]
    if excess > 0:
        return np.int64(NEVER)
    free = np.int64(0)
    for unit in range(params.UNITS):
        free = max(free, left(units, unit, state[SLOTS + unit] + excess) + 1)
    return free


@numba.njit(cache=True)
def _test(state, units, cycle):
    """First cycle from `cycle` on in which a test can begin."""
    while True:
        close = _arrive(state, cycle)
        free = _slots_free(state, units, 1)
        if free <= cycle:
            return cycle
        cycle = min(free, close + 1)


@numba.njit(cache=True)
def _close(state, units, cycle):
    """First cycle from `cycle` on in which a close can be issued."""
    for unit in range(params.UNITS):
        cycle = max(cycle, taken(units, unit, state[CLOSES] + 1 - state[MARKS]) + 1)
    return cycle


@numba.njit(cache=True)
def _closed(state, cycle, n, hits):
    """Cycle of the close that is issued in `cycle`, behind n tests."""
    at = RING + state[CLOSES] % RECENT * CLOSE_N
    state[CLOSES] += 1
    state[NEXT] = cycle + 1
    state[at] = cycle + LATENCY
    state[at + 1] = n
    for unit in range(params.UNITS):
        state[at + 2 + unit] = hits[unit]
    return cycle + LATENCY


@numba.njit(cache=True)
def begin_batch(state, ready):
    """A batch that has entries and shows test_valid from cycle `ready` on, if the one before has been issued."""
    state[NEXT] = max(state[NEXT], ready) + START


@numba.njit(cache=True)
def test_group(state, units, words, hits):
    """Cycle of a group's close; the last group's is that of hits_over, LATENCY behind test_issued.

    words int[blocks]: candidates of each of its words; hits int[UNITS]: lengths of its lists. units: state of
    queue_blender, which has been told of the lists of all groups in front of this one.
    """
    cycle = state[NEXT]
    n = 0
    for at in range(len(words)):
        last = at == len(words) - 1
        in_word = np.int64(words[at])
        alone = in_word - last  # tests that do not close
        _arrive(state, cycle)
        if alone > 0 and _slots_free(state, units, alone) <= cycle:
            cycle += alone
            state[OPEN] += alone
        else:
            for _ in range(alone):
                cycle = _test(state, units, cycle) + 1
                state[OPEN] += 1
        n += in_word
        if last:
            cycle = _close(state, units, cycle)
        if last and in_word > 0:
            cycle = _test(state, units, cycle)
            state[OPEN] += 1
        if not last and in_word == 0:
            cycle += 1
    return _closed(state, cycle, n, hits)


@numba.njit(cache=True)
def test_nothing(state, units, ready):
    """Cycle of the void close of a batch without entries that shows test_valid from cycle `ready` on."""
    cycle = _close(state, units, max(state[NEXT], ready))
    _arrive(state, cycle)
    return _closed(state, cycle, 0, np.zeros(params.UNITS, np.int64))
