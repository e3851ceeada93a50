"""gs_raster_lane: the raster core with its memory ports, and when it has finished a tile.

Cycles are named as in timing.py. The table of a tile comes through a list reader, features through a queue and a record
reader; all tables and pixels are taken at once. The queue takes up the second bursts of records that lie across a 4 KB
border; `exact` tells whether it is long enough, which it is but for tables made to fill it.
"""

from __future__ import annotations

import numba
import numpy as np

from golden import dma, params
from golden.raster_core import timing

TILES = 8  # between start and done
REQUESTS = 32  # the queue's words
REQUEST_DELAY = 2 + dma.RECORD_CYCLES  # request to record, beside the memory's latency: queue, record reader
RECORD_INTERVAL = params.RECORD_BYTES // dma.BEAT

# State of the lane, behind that of the core
LIST_FREE = timing.STATE_N  # the list reader takes a command
DONES = LIST_FREE + 1  # done beats of the last TILES tiles, in a ring
COUNT = DONES + TILES  # tiles so far
STATE_N = COUNT + 1

START, PX_FIRST, PX_LAST, DONE, TIMES_N = range(5)


def new_state(origin: int = 0) -> np.ndarray:
    """State int64[STATE_N] of a lane whose reset is low from cycle `origin` on."""
    state = np.full(STATE_N, origin - 1, np.int64)
    state[: timing.STATE_N] = timing.new_state(origin)
    state[LIST_FREE] = origin
    state[COUNT] = 0
    return state


@numba.njit(cache=True)
def step(state, start, n, counts, beats, read, write, times):
    """One tile: start is offered from cycle `start` on, with n entries; done is taken at once.

    state int64[STATE_N], updated; counts: of rasterise; beats: timing.pixel_beats; read, write: the memory's latencies.
    Fills times int64[TIMES_N].

    The core and the list reader take the tile each as soon as it can; the later of them ends the start (START). Done is
    one cycle behind the later of the last responses; those of the tile before come earlier.
    """
    ring = DONES + state[COUNT] % TILES
    offered = max(start, state[ring] + 1)
    listed = max(offered, state[LIST_FREE])
    arrivals = dma.list_arrival(listed, n, read)
    core = np.empty(timing.TIMES_N, np.int64)
    blocks = np.empty((n // params.CHUNK + 1, 2), np.int64)
    timing.step(
        state[: timing.STATE_N], offered, arrivals, counts, beats, read + REQUEST_DELAY, RECORD_INTERVAL, core, blocks
    )
    state[LIST_FREE] = dma.list_next(core[timing.END_TAKEN])
    last = len(blocks) - 1
    entry = blocks[last - 1, 1] if n > 0 and n % params.CHUNK == 0 else blocks[last, 1]
    answered = max(dma.written(entry, blocks[last, 1], n, write), dma.pixels_written(core[timing.PX_LAST], write))
    times[START] = max(listed, core[timing.TAKEN])
    times[PX_FIRST] = core[timing.PX_FIRST]
    times[PX_LAST] = core[timing.PX_LAST]
    times[DONE] = answered
    state[ring] = times[DONE]
    state[COUNT] += 1


def exact(indices: np.ndarray, base: int = 0) -> bool:
    """Whether the request queue can never be full: int64[E] indices of the tables in the order they are read.

    At most two batches of requests can leave one a cycle, then the core waits for a bank; every one with two bursts
    leaves one more request behind.
    """
    split = np.concatenate([[0], np.cumsum(dma.record_split(np.asarray(indices, np.int64), base))])
    window = min(2 * params.CHUNK, len(split) - 1)
    return bool(np.max(split[window:] - split[: len(split) - window], initial=0) <= REQUESTS)
