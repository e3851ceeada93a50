"""When the late core does what: exact cycles of gs_late_core while its outputs are always ready.

A cycle is named as in timing.py. A tile is begin_tile, step_batch for each batch (late_core.batches: the last one is
shorter than its limit and may be empty), end_tile; the state between them is all that what follows can feel.
"""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.raster_core.pixel_resolver import DELAY
from golden.raster_core.queue_blender import PAST, blend_list, new_units, next_tile, store_end

# What step_batch tells of a batch
FILL_FIRST = 0  # first cycle in which an entry could be taken
FILL_LAST = 1  # cycle of its last entry or end beat
RECORD_LAST = 2  # arrival of its last record
SORTED = 3  # its tests can start
TESTED = 4  # last hit
BLENDED = 5  # blend_done
OUT_FIRST = 6  # first beat written back
OUT_LAST = 7
BATCH_N = 8

PX_FIRST, PX_LAST, PX_N = range(3)


def new_state(origin: int) -> np.ndarray:
    """State int64[STATE_N] of a core whose reset is low from cycle `origin` on."""
    raise NotImplementedError


@numba.njit(cache=True)
def begin_tile(state, tile_valid, first):
    """The cycle in which a tile is taken, offered from cycle `tile_valid` on; first: most entries of its first batch."""
    raise NotImplementedError


@numba.njit(cache=True)
def fill_free(state):
    """First cycle in which an entry of the next batch can be taken: for whoever needs to know when requests leave."""
    raise NotImplementedError


@numba.njit(cache=True)
def step_batch(state, n, arrivals, latency, interval, hits, counts, candidates, times):
    """A batch of n entries through the core.

    arrivals int64[n], in the last batch [n + 1]: cycles from which each entry, and the end beat, is offered, if those
    before are gone. latency int64[n]: a record comes so long behind its request (which leaves a cycle behind its
    entry), and at least `interval` behind the last one. hits, counts [GROUPS, UNITS] (late_core.work, RasterResult)
    and candidates [GROUPS, BLOCKS] (late_core.work) of the batch; of an empty one any. Fills times int64[BATCH_N].
    """
    raise NotImplementedError


@numba.njit(cache=True)
def end_tile(state, beats, times):
    """Behind a tile's last batch: store and resolve; beats: pixel_beats. Fills times int64[PX_N]."""
    raise NotImplementedError
