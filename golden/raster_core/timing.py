"""When the raster core does what: exact cycles of gs_raster_core while its outputs are always ready.

A cycle is named by the clock edge that ends it: a beat of cycle c moves at edge c, and what it changes is seen in cycle
c + 1. `step` takes the core through one tile; the state it carries is all that a tile can feel of those before it.
"""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.raster_core.batch_buffer import load, loaded, write_back
from golden.raster_core.group_tester import LATENCY as TEST_LATENCY
from golden.raster_core.group_tester import group_end
from golden.raster_core.pixel_resolver import DELAY, RELEASE, pixel_beats
from golden.raster_core.subtile_blender import NONE, phase_end, store_end

__all__ = ["new_state", "pixel_beats", "step", "timing"]

# What `step` carries: the first cycle in which something can happen again, unless said otherwise.
TILE = 0  # the next tile can be taken
BANK = 1  # number of the bank to be filled, 0 or 1
BANK_FREE = 2  # 2, 3: a bank can take entries
LOADED = 4  # the last batch was loaded (a past cycle)
RECORD = 5  # last record came (a past cycle)
TEST = 6  # a group's tests can start
HITS = 7  # hits of the next batch can be gathered
SET_FREE = 8  # 8, 9: a set of lists can be filled
OUT = 10  # the next batch can be written back
BLEND = 11  # a phase can start
ORIGIN = 12  # a cycle in which unit 0 may issue
STATE_N = 13

# What `step` tells
TAKEN, END_TAKEN, PX_FIRST, PX_LAST, TIMES_N = range(5)


def new_state(origin: int) -> np.ndarray:
    """State int64[STATE_N] of a core whose reset is low from cycle `origin` on."""
    state = np.full(STATE_N, origin, np.int64)
    state[BANK] = 0
    state[[LOADED, RECORD]] = origin - (1 << 40)
    return state


@numba.njit(cache=True)
def step(state, tile_valid, arrivals, counts, beats, latency, interval, times, blocks):
    """One tile through the core.

    state int64[STATE_N], updated; tile_valid: cycle from which the tile is offered; arrivals int64[n + 1]: cycles from
    which each entry and the end beat are offered, if those before them are gone; counts [ceil(n / CHUNK), GROUPS,
    UNITS] of rasterise; beats: pixel_beats; a record comes `latency` cycles behind its request and at least `interval`
    behind the last one. Fills times int64[TIMES_N] and blocks int64[n // CHUNK + 1, 2]: first, last beat of a block.
    """
    n = len(arrivals) - 1
    origin = state[ORIGIN]
    held = np.full(params.UNITS, NONE, np.int64)
    times[TAKEN] = max(tile_valid, state[TILE])
    fill = times[TAKEN] + 1
    for batch in range(n // params.CHUNK + 1):
        first = batch * params.CHUNK
        m = min(params.CHUNK, n - first)
        bank = state[BANK]

        # Load
        fill = max(fill, state[BANK_FREE + bank])
        fill, state[RECORD] = load(fill, arrivals[first : first + m], state[RECORD], latency, interval)
        if m < params.CHUNK:
            times[END_TAKEN] = max(fill, arrivals[n])
            fill = times[END_TAKEN] + 1
            state[TILE] = fill
        ready = loaded(fill, m, state[RECORD], state[LOADED])
        state[LOADED] = ready
        state[BANK] = 1 - bank

        # Test and blend. A phase waits for its lists, a group's tests for the phase before the last.
        if m == 0:
            state[TEST] = max(state[TEST], ready) + 1
            hits_over = max(state[HITS], ready)
            blended = max(state[BLEND], ready) + 1
        else:
            hits = np.int64(0)
            for group in range(params.GROUPS):
                lists = SET_FREE + (group & 1)
                tests_end = group_end(max(max(state[TEST], ready), state[lists]), m)
                state[TEST] = tests_end + 1
                hits = tests_end + TEST_LATENCY
                start = max(state[BLEND], hits + 1)
                end = phase_end(start, group, counts[batch, group], held, origin)
                state[BLEND] = end + 1
                state[lists] = end + 1
            hits_over = hits + 1
            blended = state[BLEND]
        state[HITS] = hits_over + 1

        # Write back
        blocks[batch, 0], blocks[batch, 1] = write_back(max(hits_over + 1, state[OUT]), m)
        state[OUT] = blocks[batch, 1]
        state[BANK_FREE + bank] = max(blended, blocks[batch, 1]) + 1

    # Store and resolve
    end = store_end(blended, held, origin)
    times[PX_FIRST] = end + DELAY
    times[PX_LAST] = end + DELAY + beats - 1
    state[BLEND] = end + beats + RELEASE


@numba.njit(cache=True)
def timing(
    state, offsets, arrivals, tile_valid, batch_offsets, counts, beats, latency, interval, times, block_offsets, blocks
):
    """`step` over T tiles whose entries come at known cycles.

    offsets int64[T + 1] of entries; arrivals int64[E + T]: those of tile t start at offsets[t] + t; tile_valid, beats
    int64[T]; batch_offsets, counts: of rasterise; fills times int64[T, TIMES_N] and blocks int64[.., 2], those of tile
    t from block_offsets[t] on.
    """
    for tile in range(len(offsets) - 1):
        step(
            state, tile_valid[tile], arrivals[offsets[tile] + tile : offsets[tile + 1] + tile + 1],
            counts[batch_offsets[tile] : batch_offsets[tile + 1]], beats[tile], latency, interval,
            times[tile], blocks[block_offsets[tile] : block_offsets[tile + 1]],
        )  # fmt: skip
