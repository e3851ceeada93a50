"""When the late core does what: exact cycles of gs_late_core while its outputs are always ready.

A cycle is named as in timing.py. A tile is begin_tile, step_batch for each batch (late_buffer.batches: the last one is
shorter than its limit and may be empty), end_tile; the state between them is all that what follows can feel.
"""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.raster_core import candidate_tester, late_buffer, queue_blender
from golden.raster_core.candidate_matrix import BLOCK
from golden.raster_core.hit_queue import MARK_DELAY
from golden.raster_core.pixel_resolver import DELAY

# State: that of the parts
ORIGIN = 0  # a cycle in which unit 0 may issue
RECORD = 1  # the last record came (a past cycle)
BUFFER = 2
TESTER = BUFFER + late_buffer.STATE_N
BLENDER = TESTER + candidate_tester.STATE_N
STATE_N = BLENDER + params.UNITS * queue_blender.UNIT_N

# What step_batch tells of a batch
FILL_FIRST = 0  # first cycle in which an entry or the end beat could be taken
FILL_LAST = 1  # cycle of the last one
RECORD_LAST = 2  # the last record came, of this batch or of one before it
SORTED = 3  # its tests can start, if those of the batches before it have
TESTED = 4  # hits_over
BLENDED = 5  # blend_done
OUT_FIRST = 6  # first beat written back
OUT_LAST = 7
BATCH_N = 8

PX_FIRST, PX_LAST, PX_N = range(3)


def new_state(origin: int, length: int = params.CHUNK) -> np.ndarray:
    """State int64[STATE_N] of a core whose reset is low from cycle `origin` on.

    length: entries of a batch; a queue holds two lists of as many hits.
    """
    state = np.empty(STATE_N, np.int64)
    state[ORIGIN] = origin
    state[RECORD] = queue_blender.PAST
    state[BUFFER:TESTER] = late_buffer.new_buffer(origin, length)
    state[TESTER:BLENDER] = candidate_tester.new_tester(origin, 2 * length)
    state[BLENDER:] = queue_blender.new_units(origin).ravel()
    return state


@numba.njit(cache=True)
def begin_tile(state, tile_valid, first):
    """Cycle in which a tile is taken, offered from cycle `tile_valid` on; first: most entries of its first batch."""
    return late_buffer.begin_tile(state[BUFFER:TESTER], tile_valid, first)


@numba.njit(cache=True)
def fill_free(state):
    """First cycle in which a beat of the next batch can be taken: for whoever needs to know when requests leave."""
    return late_buffer.fill_free(state[BUFFER:TESTER])


@numba.njit(cache=True)
def _list(state, units, group, hits, operations, mark):
    """Last cycle of the slowest unit's work on the lists of a group, or on the mark of an empty batch."""
    end = np.int64(queue_blender.PAST)
    for unit in range(params.UNITS):
        over = queue_blender.blend_list(
            units, unit, group, np.int64(hits[unit]), np.int64(operations[unit]), mark, state[ORIGIN]
        )
        end = max(end, over)
    return end


@numba.njit(cache=True)
def step_batch(state, n, arrivals, latency, interval, hits, counts, candidates, times):
    """A batch of n entries through the core.

    arrivals int64[n], in the last batch [n + 1]: cycles from which each entry, and the end beat, is offered, if those
    before are gone. latency int64[n]: a record comes so long behind its request (which leaves a cycle behind its
    entry), and at least `interval`, 3 or more, behind the last one. hits, counts [GROUPS, UNITS] (late_core.work,
    RasterResult) and candidates [GROUPS, words] (late_core.work) of the batch; of an empty one any. Fills times
    int64[BATCH_N].
    """
    buffer, tester = state[BUFFER:TESTER], state[TESTER:BLENDER]
    units = state[BLENDER:].reshape(params.UNITS, queue_blender.UNIT_N)
    times[FILL_FIRST] = late_buffer.fill_free(buffer)
    came = np.empty(n, np.int64)
    times[FILL_LAST] = late_buffer.request_batch(buffer, arrivals, came)
    for k in range(n):
        state[RECORD] = came[k] = max(came[k] + latency[k], state[RECORD] + interval)
    times[RECORD_LAST] = state[RECORD]
    ready = late_buffer.sort_batch(buffer, came)
    times[SORTED] = ready
    if n == 0:
        close = candidate_tester.test_nothing(tester, units, ready)
        nothing = np.zeros(params.UNITS, np.int64)
        end = _list(state, units, 0, nothing, nothing, close + MARK_DELAY)
    else:
        candidate_tester.begin_batch(tester, ready)
        close = end = np.int64(0)
        for group in range(params.GROUPS):
            words = candidates[group, : (n + BLOCK - 1) // BLOCK]
            close = candidate_tester.test_group(tester, units, words, hits[group])
            end = _list(state, units, group, hits[group], counts[group], close + MARK_DELAY)
    times[TESTED] = close
    times[BLENDED] = end + 1
    late_buffer.end_batch(buffer, n, close, end + 1, times[OUT_FIRST : OUT_LAST + 1])


@numba.njit(cache=True)
def end_tile(state, beats, times):
    """Behind a tile's last batch: store and resolve; beats: pixel_beats. Fills times int64[PX_N]."""
    units = state[BLENDER:].reshape(params.UNITS, queue_blender.UNIT_N)
    stored = queue_blender.store_end(units, state[ORIGIN])
    times[PX_FIRST] = stored + DELAY
    times[PX_LAST] = stored + DELAY + beats - 1
    queue_blender.next_tile(units, stored, beats)
