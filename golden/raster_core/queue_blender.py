"""gs_queue_blender: when four SCUs, each with a queue of hits of its own, take and finish their lists.

What they compute is subtile_blender.blend_subtile, list by list. Cycles as in timing.py. A list's mark is shown to its
unit from a cycle on that the hit queue gives; the state tells the queue when slots and marks have left.
"""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.raster_core.pixel_resolver import RELEASE
from golden.raster_core.subtile_blender import CHANGE, NONE, turn

PAST = -(1 << 40)
RING = 64  # lists that a unit's state remembers, more than a queue has marks

# Columns of a unit's state
READY = 0  # first cycle in which the next list can be taken
HELD = 1  # group or NONE
LISTS = 2  # taken so far, empty batches included
SLOTS = 3  # of these lists
BACK = 4  # [GROUPS] first cycle in which the group's pixels are back in the buffer
TAKEN = BACK + params.GROUPS  # [RING] cycle in which a list's mark was taken
POPPED = TAKEN + RING  # [RING] cycle in which its first slot left
STEP = POPPED + RING  # [RING] cycles from one slot to the next; 0: all leave at once
TOTAL = STEP + RING  # [RING] SLOTS behind the list
UNIT_N = TOTAL + RING


def new_units(origin: int) -> np.ndarray:
    """State int64[UNITS, UNIT_N] of the units whose reset is low from cycle `origin` on."""
    units = np.full((params.UNITS, UNIT_N), PAST, np.int64)
    units[:, READY] = origin
    units[:, HELD] = NONE
    units[:, [LISTS, SLOTS]] = 0
    return units


@numba.njit(cache=True)
def blend_list(units, unit, group, hits, operations, mark, origin):
    """Last cycle of a list of `hits` slots, whose mark is shown from cycle `mark` on. Of an empty batch: hits = 0.

    The unit takes the mark when it is through with the list before, and when the group's pixels are back in the buffer
    (only then it knows whether they are done; an empty list does not ask). operations = 0: dropped in that cycle. Else
    one operation every BEATS cycles in the unit's turns, the first of them a change if another group is held.
    units int64[UNITS, UNIT_N], updated; origin: a cycle in which unit 0 may issue.
    """
    state = units[unit]
    take = max(mark, state[READY])
    if hits > 0:
        take = max(take, state[BACK + group])
    popped = take
    end = take
    if operations > 0:
        popped = turn(take + 1, unit, origin)
        if state[HELD] != group:
            if state[HELD] != NONE:
                state[BACK + state[HELD]] = popped + CHANGE
            state[HELD] = group
            popped += params.BEATS
        end = popped + params.BEATS * (operations - 1)
    ring = state[LISTS] % RING
    state[LISTS] += 1
    state[SLOTS] += hits
    state[READY] = end + 1
    state[TAKEN + ring] = take
    state[POPPED + ring] = popped
    state[STEP + ring] = params.BEATS if operations > 0 else 0
    state[TOTAL + ring] = state[SLOTS]
    return end


@numba.njit(cache=True)
def left(units, unit, slots):
    """Cycle in which the queue's slot number `slots` (from 1 on, since the reset) left; of 0 and less: PAST."""
    state = units[unit]
    if slots <= 0:
        return np.int64(PAST)
    at = state[LISTS] - 1
    while at > max(0, state[LISTS] - RING) and state[TOTAL + (at - 1) % RING] >= slots:
        at -= 1
    ring = at % RING
    before = state[TOTAL + (at - 1) % RING] if at > 0 else 0
    return state[POPPED + ring] + state[STEP + ring] * max(slots - before - 1, 0)


@numba.njit(cache=True)
def taken(units, unit, marks):
    """Cycle in which the unit took its mark number `marks` (from 1 on, since the reset), one of the last RING."""
    return units[unit, TAKEN + (marks - 1) % RING] if marks > 0 else np.int64(PAST)


@numba.njit(cache=True)
def store_end(units, origin):
    """Cycle of resolve_start behind a tile's last lists: every unit has stored what it holds."""
    end = np.int64(PAST)
    for unit in range(params.UNITS):
        state = units[unit]
        stored = state[READY]
        if state[HELD] != NONE:
            stored = turn(stored, unit, origin) + CHANGE
        end = max(end, stored)
    return end


@numba.njit(cache=True)
def next_tile(units, stored, beats):
    """The resolver starts in cycle `stored` and needs so many beats; then the units take lists again."""
    for unit in range(params.UNITS):
        units[unit, READY] = stored + beats + RELEASE
        units[unit, HELD] = NONE
