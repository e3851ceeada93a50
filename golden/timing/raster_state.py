"""What a slice's raster lane draws in a frame, its state, what it has lost, and the writes that wait behind it."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from golden import dma, params
from golden.raster_core import late_timing, raster_lane
from golden.raster_core.raster_lane import TILES
from golden.timing.dram import LINE
from golden.timing.memory import NEVER, OUTSTANDING, RASTER, answer

GROUPS, CANDIDATES, SIMPLE = range(3)
REQUEST_DELAY = 3  # a request of the core to its first AR: queue, record reader
CACHE_HIT = 4  # cycles from a record's request to its answer in the cache
QUEUE = 1 << 13  # writes that wait, each a run of lines
RESOLVE = 4  # pixels resolved in a cycle
NOMINAL = dma.LATENCY  # answers to what is written
MARGIN = 24  # SIMPLE: cycles from a batch's records to its first blend

# Causes of a raster core's lost cycles; what is left is blending
WAIT_SORTING, WAIT_MEMORY, WAIT_LATE_SORT, WAIT_TESTS, IMBALANCE, WAIT_RESOLVE, BUSY, CAUSES_N = range(8)
CAUSES = ("sorting", "memory", "late_sort", "intersection", "imbalance", "resolve")

STEP = 32  # records asked for at a time

# Lane state
(
    LIST_FREE, COUNT, BATCH, THERE, LISTED, BLEND_END, QUEUE_AT, QUEUE_N, LAST_BLOCK, OFFERED, RECORD, FREE_A, FREE_B,
    FETCHED, SIZE, FILL,
) = range(16)  # fmt: skip
STATE_N = 16


class Raster(NamedTuple):
    """What the raster lanes draw in a frame, and their state. T tiles, B batches, E entries; S slices."""

    core: int  # GROUPS, CANDIDATES, SIMPLE
    first: int  # entries of a tile's first batch
    length: int  # entries of its other batches
    size: np.ndarray  # int64[4] bytes of an entry: of the table, of the second list, of an RTL writer; of a record
    entry_at: np.ndarray  # int64[T + 1]
    fetched: np.ndarray  # int64[T] entries that are drawn; those behind them stay as they are
    table: np.ndarray  # int64[T] byte address of the list
    incoming: np.ndarray  # int64[T] byte address of the second list
    table_n: np.ndarray  # int64[T] entries of the list, those that are dropped included
    incoming_n: np.ndarray  # int64[T] entries of the second list
    line_at: np.ndarray  # int64[E + 1] lines that an entry fetches
    line: np.ndarray  # int64[..]
    heads: np.ndarray  # int64[E] dma.record_head of each record
    batch_at: np.ndarray  # int64[T + 1]
    hits: np.ndarray  # [B, GROUPS, UNITS] list lengths; CANDIDATES only
    counts: np.ndarray  # [B, GROUPS, UNITS] operations
    candidates: np.ndarray  # [B, GROUPS, words]; CANDIDATES only
    cycles: np.ndarray  # int64[B]; SIMPLE only
    out: np.ndarray  # int64[T] byte address of the table written back, -1: none is
    beats: np.ndarray  # int64[T] of pixels
    rows: np.ndarray  # int64[T, 4] first byte of the tile's pixels, bytes of a row, from row to row, rows (0: none)
    state: np.ndarray  # int64[S, STATE_N]
    dones: np.ndarray  # int64[S, TILES]
    ports: np.ndarray  # int64[S, ..] of golden/dma.py, for the nominal answers to what is written
    unit: np.ndarray  # int64[S, ..] state of the lane or the core
    asked: np.ndarray  # int64[S, length] when the batch's records are asked for
    arrived: np.ndarray  # int64[S, length] when they are there
    offered: np.ndarray  # int64[S, length + 1] when its entries are
    ring: np.ndarray  # int64[S, OUTSTANDING + 1] answers of the last reads; place of the next
    queue: np.ndarray  # int64[S, QUEUE, 3] cycle, line, lines
    lost: np.ndarray  # int64[S, CAUSES_N]


def new_state(core: int, slices: int, origin: int, length: int = params.CHUNK):
    """The last fields of Raster, of raster lanes that are out of reset from cycle `origin` on.

    length: entries of a batch, where CANDIDATES sorts them.
    """
    state = np.zeros((slices, STATE_N), np.int64)
    state[:, [LIST_FREE, BLEND_END, RECORD, FREE_A, FREE_B]] = origin
    unit = late_timing.new_state(origin, length) if core == CANDIDATES else raster_lane.new_state(origin)
    return (
        state, np.full((slices, TILES), origin - 1, np.int64), np.stack([dma.new_ports()] * slices),
        np.stack([unit] * slices), *np.zeros((2, slices, length), np.int64), np.zeros((slices, length + 1), np.int64),
        np.zeros((slices, OUTSTANDING + 1), np.int64), np.zeros((slices, QUEUE, 3), np.int64),
        np.zeros((slices, CAUSES_N), np.int64),
    )  # fmt: skip


@numba.njit(cache=True)
def push(raster, s, cycle, begin, end):
    """Bytes begin .. end - 1 are to be written from `cycle` on."""
    state = raster.state[s]
    if end <= begin:
        return
    at = (state[QUEUE_AT] + state[QUEUE_N]) % QUEUE
    assert state[QUEUE_N] < QUEUE
    raster.queue[s, at, 0] = cycle
    raster.queue[s, at, 1] = begin // LINE
    raster.queue[s, at, 2] = (end - 1) // LINE - begin // LINE + 1
    state[QUEUE_N] += 1


@numba.njit(cache=True)
def lose(raster, s, before, ready, offered, sort, counts, m):
    """Attributes the cycles from `before` to the lane's BLEND_END. ready: the batch can be tested; sort: its part."""
    state = raster.state[s]
    lost = raster.lost[s]
    room = state[BLEND_END] - before
    busy = counts.sum() * params.BEATS // params.UNITS if m else 0
    fullest = np.int64(0)
    for group in range(counts.shape[0] if m else 0):
        fullest += counts[group].max() * params.BEATS
    lost[BUSY] += min(room, busy)
    room -= min(room, busy)
    causes = (WAIT_SORTING, WAIT_LATE_SORT, WAIT_MEMORY)
    waits = max(offered - before, 0), sort, ready - sort - max(offered, before)
    for i in range(3):
        part = min(room, max(waits[i], 0))
        lost[causes[i]] += part
        room -= part
    part = min(room, max(fullest - busy, 0))
    lost[IMBALANCE] += part
    lost[WAIT_TESTS] += room - part


@numba.njit(cache=True)
def full(raster, s):
    """Do so many writes wait that the lane must?"""
    return raster.state[s, QUEUE_N] > QUEUE // 2


@numba.njit(cache=True)
def next_write(raster, s):
    """Cycle of the next write that waits."""
    state = raster.state[s]
    return raster.queue[s, state[QUEUE_AT], 0] if state[QUEUE_N] else NEVER


@numba.njit(cache=True)
def write(raster, s, most, now, memory):
    """Sends up to `most` lines that wait by cycle `now`; returns the cycle in which the last is taken."""
    state = raster.state[s]
    last = now
    while most > 0 and state[QUEUE_N]:
        head = raster.queue[s, state[QUEUE_AT]]
        if head[0] > now:
            break
        for line in range(head[1], head[1] + head[2]):
            last = max(last, answer(memory, now, line, True, RASTER))
        most -= head[2]
        state[QUEUE_AT] = (state[QUEUE_AT] + 1) % QUEUE
        state[QUEUE_N] -= 1
    return last
