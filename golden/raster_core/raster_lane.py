"""gs_raster_lane: the raster core with its memory ports, and when it has finished a tile.

Cycles are named as in timing.py. The table of a tile comes through a list reader, features through a queue and a record
reader; all tables and pixels are taken at once. `step` takes the lane through one tile on the memory of golden/dma.py.
With another memory its parts are called one by one:

    begin_tile      core and list reader take the tile; the caller finds when the entries come
    request_batch   tells when records are asked for; the caller finds when they come
    work_batch      tells when the batch is written back
    end_tile        tells when the pixels are written; the caller finds when both have been answered
    finish_tile     done

A batch may be requested before the work of the one before it, a tile begun before the last one is finished.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from golden import dma, params
from golden.raster_core import timing
from golden.records import INDEX_MASK

TILES = 8  # between start and done
REQUESTS = 32  # the queue's words
PIXEL_BYTES = 4
BEAT_PIXELS = dma.PIXEL_BEAT // PIXEL_BYTES

# State of the lane, behind that of the core
DONES = timing.STATE_N  # done beats of the last TILES tiles, in a ring
BEGUN = DONES + TILES  # tiles so far
FINISHED = BEGUN + 1
ROOM = FINISHED + 1  # the core has room for a request
PUSHED = ROOM + 1  # the last request went into the queue (a past cycle)
INDEX = PUSHED + 1  # the record reader took the last index (a past cycle)
READER = INDEX + 1  # the record reader can take an index
PULLED = READER + 1  # when the last REQUESTS requests left the queue's words, in a ring
REQUESTED = PULLED + REQUESTS  # requests so far
STATE_N = REQUESTED + 1

START, PX_FIRST, PX_LAST, DONE, TIMES_N = range(5)


class View(NamedTuple):
    """The picture and where it lies: pixels, byte addresses of record 0 and of pixel (0, 0), bytes from row to row.

    And the bytes of a table's entry and of a record.
    """

    width: int
    height: int
    feature: int
    frame: int
    stride: int
    entry: int
    record: int


def new_state(origin: int = 0) -> np.ndarray:
    """State int64[STATE_N] of a lane whose reset is low from cycle `origin` on."""
    state = np.full(STATE_N, origin - 1, np.int64)
    state[: timing.STATE_N] = timing.new_state(origin)
    state[READER] = origin
    state[[BEGUN, FINISHED, REQUESTED]] = 0
    return state


@numba.njit(cache=True)
def begin_tile(state, start):
    """Cycle in which core and list reader take a start that is offered from cycle `start` on.

    Both are free behind the end beat of the last tile's list. The tile TILES before must be finished.
    """
    offered = max(start, state[DONES + state[BEGUN] % TILES] + 1)
    state[BEGUN] += 1
    return timing.begin_tile(state[: timing.STATE_N], offered)


@numba.njit(cache=True)
def _ask(state, request, bursts):
    """Cycle of the first AR of a record that the core requests from cycle `request` on; bursts: 1 or 2.

    The core's skid holds two requests, the queue REQUESTS and one more at its head, which is a cycle behind the word.
    """
    at = PULLED + state[REQUESTED] % REQUESTS
    state[ROOM] = state[PUSHED] + 1
    state[PUSHED] = max(request, state[PUSHED] + 1, state[at] + 1)
    state[at] = max(state[PUSHED] + 1, state[INDEX])
    state[INDEX] = max(state[at] + 1, state[READER])
    state[READER] = state[INDEX] + bursts
    state[REQUESTED] += 1
    return state[INDEX] + 1


@numba.njit(cache=True)
def request_batch(state, arrivals, heads, whole, asked):
    """Entries of the tile's next batch; returns the cycle behind its last beat.

    arrivals: as of timing.request_batch; heads int64[m]: dma.record_head of its records; whole: beats of one. Fills
    asked int64[m]: cycle of each record's first AR.
    """
    core = state[: timing.STATE_N]
    fill = timing.open_batch(core)
    m = len(asked)
    for k in range(m):
        fill = max(fill, arrivals[k], state[ROOM]) + 1
        asked[k] = _ask(state, fill, 2 if heads[k] < whole else 1)
    last = len(arrivals) > m
    if last:
        fill = max(fill, arrivals[m], state[ROOM]) + 1
    timing.close_batch(core, fill, last)
    return fill


@numba.njit(cache=True)
def work_batch(state, m, record, counts, block):
    """timing.work_batch."""
    timing.work_batch(state[: timing.STATE_N], m, record, counts, block)


@numba.njit(cache=True)
def end_tile(state, beats):
    """timing.end_tile."""
    return timing.end_tile(state[: timing.STATE_N], beats)


@numba.njit(cache=True)
def finish_tile(state, written):
    """Cycle of the done of the oldest tile; written: both writers have it done. Done is taken at once."""
    last = DONES + (state[FINISHED] - 1) % TILES
    at = DONES + state[FINISHED] % TILES
    state[at] = max(written, state[last] + 1)
    state[FINISHED] += 1
    return state[at]


@numba.njit(cache=True)
def step(state, start, words, address, x, y, counts, view, latency, ports, times):
    """One tile: start is offered from cycle `start` on; done is taken at once.

    state int64[STATE_N] and ports, updated; words int64[n]: the table, at byte `address`; x, y: pixel origin; counts:
    of rasterise. Fills times int64[TIMES_N].
    """
    n = len(words)
    times[START] = begin_tile(state, start)
    arrivals = dma.list_arrival(times[START], n, view.entry, address, dma.TABLE, ports, latency)
    heads = dma.record_heads(words & INDEX_MASK, view.record, view.feature)
    whole = view.record // dma.BEAT
    asked = np.empty(params.CHUNK, np.int64)
    block = np.empty(2, np.int64)
    for batch in range(n // params.CHUNK + 1):
        first = batch * params.CHUNK
        m = min(params.CHUNK, n - first)
        part = heads[first : first + m]
        request_batch(state, arrivals[first : first + params.CHUNK], part, whole, asked[:m])
        records = dma.record_arrivals(asked[:m], part, whole, dma.FEATURE, ports, latency)
        work_batch(state, m, records[m - 1] if m > 0 else 0, counts[batch : batch + 1], block)
        dma.write_block(block[0], m, view.entry, address + first * view.entry, dma.DRAWN_TABLE, ports, latency)
    rows = min(params.TILE, view.height - y)
    columns = (min(params.TILE, view.width - x) + BEAT_PIXELS - 1) // BEAT_PIXELS
    times[PX_FIRST], times[PX_LAST] = end_tile(state, rows * columns)
    pixels = view.frame + y * view.stride + x * PIXEL_BYTES
    dma.write_pixels(times[PX_FIRST], rows, columns, pixels, view.stride, dma.PIXEL, ports, latency)
    table = dma.written(block[1], dma.DRAWN_TABLE, ports)
    times[DONE] = finish_tile(state, max(table, dma.written(times[PX_LAST], dma.PIXEL, ports)))
