"""When the raster core does what: exact cycles of gs_raster_core while its outputs are always ready.

A cycle is named by the clock edge that ends it: a beat of cycle c moves at edge c, and what it changes is seen in cycle
c + 1. `step` takes the core through one tile. It is composed of

    begin_tile                                      the tile is taken
    request_batch (or open_batch and close_batch)   a batch's entries are taken; tells when its records are requested
    work_batch                                      given when its last record came: tests, blends, writes back
    end_tile                                        pixels

A batch may be requested before the work of the one before it is known, not earlier: there are two banks. The state
carried between calls is all that a tile can feel of those before it.
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

# State: the first cycle in which something can happen again, unless said otherwise.
TILE = 0  # the next tile can be taken
FILL = 1  # the next entry or end beat of the tile can be taken, if a bank is free
BANK = 2  # number of the bank to be filled, 0 or 1
BANK_FREE = 3  # 3, 4: a bank can take entries
CLOSED = 5  # 5, 6: the entries of the batch in a bank are known
WORK = 7  # number of the bank whose batch is worked on next
LOADED = 8  # the last batch was loaded (a past cycle)
RECORD = 9  # the last record came (a past cycle)
TEST = 10  # a group's tests can start
HITS = 11  # hits of the next batch can be gathered
SET_FREE = 12  # 12, 13: a set of lists can be filled
OUT = 14  # the next batch can be written back
BLEND = 15  # a phase can start
ORIGIN = 16  # a cycle in which unit 0 may issue
HELD = 17  # 17..20: group that a unit's SCU holds, or NONE
STATE_N = HELD + params.UNITS

# What `step` tells
TAKEN, END_TAKEN, PX_FIRST, PX_LAST, TIMES_N = range(5)


def new_state(origin: int) -> np.ndarray:
    """State int64[STATE_N] of a core whose reset is low from cycle `origin` on."""
    state = np.full(STATE_N, origin, np.int64)
    state[[BANK, WORK]] = 0
    state[[LOADED, RECORD]] = origin - (1 << 40)
    state[HELD:] = NONE
    return state


@numba.njit(cache=True)
def begin_tile(state, tile_valid):
    """Cycle in which the core takes a tile that is offered from cycle `tile_valid` on."""
    taken = max(tile_valid, state[TILE])
    state[FILL] = taken + 1
    return taken


@numba.njit(cache=True)
def open_batch(state):
    """First cycle in which the core can take a beat of the next batch."""
    return max(state[FILL], state[BANK_FREE + state[BANK]])


@numba.njit(cache=True)
def close_batch(state, fill, last):
    """All beats of a batch have been taken before cycle `fill`; last: the list's end beat is one of them."""
    state[FILL] = fill
    if last:
        state[TILE] = fill
    bank = state[BANK]
    state[CLOSED + bank] = fill
    state[BANK] = 1 - bank


@numba.njit(cache=True)
def request_batch(state, arrivals, requests):
    """Entries of the tile's next batch; returns the cycle behind its last beat.

    arrivals int64[m], int64[m + 1] of the tile's last batch: cycles from which each entry, and the end beat, is
    offered, if those before it are gone. Fills requests int64[m]: the cycle in which each record is requested.
    """
    fill = load(open_batch(state), arrivals, requests)
    last = len(arrivals) > len(requests)
    if last:
        fill = max(fill, arrivals[len(requests)]) + 1
    close_batch(state, fill, last)
    return fill


@numba.njit(cache=True)
def work_batch(state, m, record, counts, block):
    """Tests, blending and write-back of the oldest batch that was requested and not worked on, m entries.

    record: the cycle in which its last record comes, if there is one; counts [1, GROUPS, UNITS]: operations of
    rasterise, [0, ..] for a batch without entries. Fills block int64[2]: first, last beat of its block.
    """
    bank = state[WORK]
    state[WORK] = 1 - bank
    origin = state[ORIGIN]
    held = state[HELD:]
    if m > 0:
        state[RECORD] = record
    ready = loaded(state[CLOSED + bank], m, state[RECORD], state[LOADED])
    state[LOADED] = ready

    # A phase waits for its lists, a group's tests for the phase before the last.
    if m == 0:
        state[TEST] = max(state[TEST], ready) + 1
        hits_over = max(state[HITS], ready)
        state[BLEND] = max(state[BLEND], ready) + 1
    else:
        hits = np.int64(0)
        for group in range(params.GROUPS):
            lists = SET_FREE + (group & 1)
            tests_end = group_end(max(max(state[TEST], ready), state[lists]), m)
            state[TEST] = tests_end + 1
            hits = tests_end + TEST_LATENCY
            start = max(state[BLEND], hits + 1)
            end = phase_end(start, group, counts[0, group], held, origin)
            state[BLEND] = end + 1
            state[lists] = end + 1
        hits_over = hits + 1
    state[HITS] = hits_over + 1

    block[0], block[1] = write_back(max(hits_over + 1, state[OUT]), m)
    state[OUT] = block[1]
    state[BANK_FREE + bank] = max(state[BLEND], block[1]) + 1


@numba.njit(cache=True)
def end_tile(state, beats):
    """(first, last) beat of the pixels of a tile whose last batch is worked on; beats: pixel_beats."""
    end = store_end(state[BLEND], state[HELD:], state[ORIGIN])
    state[HELD:] = NONE
    state[BLEND] = end + beats + RELEASE
    return end + DELAY, end + DELAY + beats - 1


@numba.njit(cache=True)
def step(state, tile_valid, arrivals, counts, beats, latency, interval, times, blocks):
    """One tile through the core.

    state int64[STATE_N], updated; tile_valid: cycle from which the tile is offered; arrivals int64[n + 1]: as of
    request_batch, of the whole tile; counts [ceil(n / CHUNK), GROUPS, UNITS] of rasterise; beats: pixel_beats; a record
    comes `latency` cycles behind its request and at least `interval` behind the last one. Fills times int64[TIMES_N]
    and blocks int64[n // CHUNK + 1, 2]: first, last beat of a block.
    """
    n = len(arrivals) - 1
    requests = np.empty(params.CHUNK, np.int64)
    times[TAKEN] = begin_tile(state, tile_valid)
    for batch in range(n // params.CHUNK + 1):
        first = batch * params.CHUNK
        m = min(params.CHUNK, n - first)
        times[END_TAKEN] = request_batch(state, arrivals[first : first + params.CHUNK], requests[:m]) - 1
        record = state[RECORD]
        for request in requests[:m]:
            record = max(request + latency, record + interval)
        work_batch(state, m, record, counts[batch : batch + 1], blocks[batch])
    times[PX_FIRST], times[PX_LAST] = end_tile(state, beats)


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
