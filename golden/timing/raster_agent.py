"""A slice's raster lane, batch by batch: list and records from memory, the core's own cycles, what it writes.

The core is gs_raster_core (in gs_raster_lane), gs_late_core or a SIMPLE one: two banks, a batch's cycles given.
Outputs are posted: they go through a queue to the memory and do not hold the core up.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from golden import dma, params
from golden.raster_core import late_timing, raster_lane, timing
from golden.raster_core.late_timing import BATCH_N, BLENDED, PX_N, SORTED
from golden.raster_core.raster_lane import TILES
from golden.timing.jobs import LINE
from golden.timing.memory import OUTSTANDING, RASTER, answer

GROUPS, CANDIDATES, SIMPLE = range(3)
REQUEST_DELAY = 3  # a request of the core to its first AR: queue, record reader
CACHE_HIT = 4  # cycles from a record's request to its answer in the cache
NEVER = 1 << 60
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
    size: np.ndarray  # int64[2] bytes of an entry: of the table, of the second list
    entry_at: np.ndarray  # int64[T + 1]
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
    candidates: np.ndarray  # [B, GROUPS, BLOCKS]; CANDIDATES only
    cycles: np.ndarray  # int64[B]; SIMPLE only
    out: np.ndarray  # int64[T] byte address of the table written back, -1: none is
    beats: np.ndarray  # int64[T] of pixels
    rows: (
        np.ndarray
    )  # int64[T, 4] first byte of the tile's pixels, bytes of a row, distance of rows, rows; 0 rows: none
    state: np.ndarray  # int64[S, STATE_N]
    dones: np.ndarray  # int64[S, TILES]
    ports: np.ndarray  # int64[S, ..] of golden/dma.py, for the nominal answers to what is written
    unit: np.ndarray  # int64[S, ..] state of the lane or the core
    asked: np.ndarray  # int64[S, CHUNK] when the batch's records are asked for
    arrived: np.ndarray  # int64[S, CHUNK] when they are there
    offered: np.ndarray  # int64[S, CHUNK + 1] when its entries are
    ring: np.ndarray  # int64[S, OUTSTANDING + 1] answers of the last reads; place of the next
    queue: np.ndarray  # int64[S, QUEUE, 3] cycle, line, lines
    lost: np.ndarray  # int64[S, CAUSES_N]


def new_state(core: int, slices: int, origin: int):
    """The last fields of Raster, of raster lanes that are out of reset from cycle `origin` on."""
    state = np.zeros((slices, STATE_N), np.int64)
    state[:, [LIST_FREE, BLEND_END, RECORD, FREE_A, FREE_B]] = origin
    make = late_timing.new_state if core == CANDIDATES else raster_lane.new_state
    unit = np.stack([make(origin) for _ in range(slices)])
    return (
        state, np.full((slices, TILES), origin - 1, np.int64), np.stack([dma.new_ports()] * slices), unit,
        *np.zeros((2, slices, params.CHUNK), np.int64), np.zeros((slices, params.CHUNK + 1), np.int64),
        np.zeros((slices, OUTSTANDING + 1), np.int64), np.zeros((slices, QUEUE, 3), np.int64),
        np.zeros((slices, CAUSES_N), np.int64),
    )  # fmt: skip


@numba.njit(cache=True)
def begin(raster, s, tile, offered, memory):
    """The lane takes a tile that is offered from `offered` on; returns the cycle in which it does."""
    state = raster.state[s]
    if raster.core == GROUPS:
        taken, listed = raster_lane.begin_tile(raster.unit[s], offered)
    else:
        offered = max(offered, raster.dones[s, state[COUNT] % TILES] + 1)
        listed = max(offered, state[LIST_FREE])
        taken = state[FREE_A]
        if raster.core == CANDIDATES:
            taken = late_timing.begin_tile(raster.unit[s], offered, raster.first)
        taken = max(listed, taken)
    state[BATCH] = 0
    state[FETCHED] = -1
    state[LISTED] = listed
    state[OFFERED] = listed
    state[THERE] = _list(raster, s, tile, 0, listed, memory)
    return taken


@numba.njit(cache=True)
def next_time(raster, s, now):
    """Cycle in which the lane acts next: it opens a batch, or asks for more of its records."""
    state = raster.state[s]
    if state[FETCHED] >= 0:
        k = min(state[FETCHED], state[SIZE] - 1)
        return max(now, raster.asked[s, k] if k >= 0 else now)
    if raster.core == GROUPS:
        return max(now, timing.open_batch(raster.unit[s, : timing.STATE_N]))
    if raster.core == CANDIDATES:
        return max(now, late_timing.fill_free(raster.unit[s]))
    return max(now, state[FREE_A])


@numba.njit(cache=True)
def _range(raster, tile, batch):
    """(first entry, entries, is it the tile's last) of a batch."""
    n = raster.entry_at[tile + 1] - raster.entry_at[tile]
    entry = raster.first + (batch - 1) * params.CHUNK if batch else 0
    most = params.CHUNK if batch else raster.first
    return entry, max(min(most, n - entry), 0), n - entry < most


@numba.njit(cache=True)
def _list(raster, s, tile, batch, ask, memory):
    """Asks in cycle `ask` for a batch's part of the lists; returns when it is there."""
    entry, m, _ = _range(raster, tile, batch)
    n = raster.entry_at[tile + 1] - raster.entry_at[tile]
    there = ask
    lists = (
        (raster.table[tile], raster.table_n[tile], raster.size[0]),
        (raster.incoming[tile], raster.incoming_n[tile], raster.size[1]),
    )
    for address, total, size in lists:
        begin, end = address, address
        if m:
            begin, end = address + total * entry // n * size, address + total * (entry + m) // n * size
        if end > begin:
            for line in range(begin // LINE, (end - 1) // LINE + 1):
                there = max(there, answer(memory, ask, line, False, RASTER))
    return there


@numba.njit(cache=True)
def _records(raster, s, entry, begin, end, memory):
    """Asks for the records begin .. end - 1 of the batch whose first entry is `entry`.

    As dma.record_arrivals, but of lines: a record that is in the cache waits for none.
    """
    state, ring = raster.state[s], raster.ring[s]
    asked = raster.asked[s]
    for k in range(begin, end):
        beats = raster.heads[entry + k]
        state[RECORD] += 1
        for burst in range(2 if beats < dma.RECORD_BEATS else 1):
            there = asked[k] + burst + CACHE_HIT
            for i in range(raster.line_at[entry + k] + burst, raster.line_at[entry + k + 1]):
                at = ring[OUTSTANDING]
                ask = asked[k] + burst if memory.fixed else max(asked[k], ring[at])
                ring[at] = answer(memory, ask, raster.line[i], False, RASTER)
                there = max(there, ring[at])
                ring[OUTSTANDING] = (at + 1) % OUTSTANDING
                if beats < dma.RECORD_BEATS:
                    break
            state[RECORD] = max(there, state[RECORD] + burst) + (beats if burst == 0 else dma.RECORD_BEATS - beats) - 1
        raster.arrived[s, k] = state[RECORD] + 1


@numba.njit(cache=True)
def _push(raster, s, cycle, begin, end):
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
def _lose(raster, s, before, ready, offered, sort, counts, m):
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
def _open(raster, s, tile, now, memory):
    """The entries of the lane's next batch are taken, and the next batch's are asked for."""
    state, unit = raster.state[s], raster.unit[s]
    b = state[BATCH]
    entry, m, over = _range(raster, tile, b)
    n = raster.entry_at[tile + 1] - raster.entry_at[tile]
    offered, asked = raster.offered[s], raster.asked[s]
    for k in range(m + (1 if over else 0)):
        offered[k] = state[LISTED] + 2 + entry + k + (memory.read if n else 0)  # dma.list_arrival
        if not memory.fixed:
            offered[k] = max(offered[k], state[THERE] + 1)
    if not over:
        state[THERE] = _list(raster, s, tile, b + 1, now, memory)
    if raster.core == GROUPS:
        heads = raster.heads[raster.entry_at[tile] + entry : raster.entry_at[tile] + entry + m]
        state[FILL] = raster_lane.request_batch(unit, offered[: m + 1 if over else m], heads, asked[:m])
    else:
        fill = late_timing.fill_free(unit) if raster.core == CANDIDATES else max(state[FREE_A], state[LISTED])
        for k in range(m):
            fill = max(fill, offered[k]) + 1
            asked[k] = fill + REQUEST_DELAY
        if over:
            fill = max(fill, offered[m]) + 1
        state[FILL] = fill
        state[LIST_FREE] = dma.list_next(fill - 1)
    state[FETCHED] = 0
    state[SIZE] = m


@numba.njit(cache=True)
def batch(raster, s, tile, now, memory):
    """The lane acts on its next batch; True when it was the tile's last and all of it is done."""
    state, unit = raster.state[s], raster.unit[s]
    b = state[BATCH]
    entry, m, over = _range(raster, tile, b)
    if state[FETCHED] < 0:
        _open(raster, s, tile, now, memory)
        if m:
            return False
    first_entry = raster.entry_at[tile] + entry
    if state[FETCHED] < m:
        end = min(state[FETCHED] + STEP, m)
        _records(raster, s, first_entry, state[FETCHED], end, memory)
        state[FETCHED] = end
        if end < m:
            return False
    before = state[BLEND_END]
    arrived, asked = raster.arrived[s, :m], raster.asked[s, :m]
    at = raster.batch_at[tile] + b
    row = at if m else 0
    block = np.zeros(2, np.int64)
    record = arrived[m - 1] if m else 0
    late = 0  # cycles between the last record and the batch being sorted
    if raster.core == GROUPS:
        raster_lane.work_batch(unit, m, record, raster.counts[at : at + 1 if m else at], block)
        state[BLEND_END] = unit[timing.BLEND]
        ready = unit[timing.LOADED]
    elif raster.core == CANDIDATES:
        times = np.zeros(BATCH_N, np.int64)
        late_timing.step_batch(
            unit, m, raster.offered[s, : m + 1 if over else m], arrived - asked + REQUEST_DELAY, 1, raster.hits[row],
            raster.counts[row], raster.candidates[row], times,
        )  # fmt: skip
        state[BLEND_END] = max(before, times[BLENDED])
        block[0], block[1] = times[late_timing.OUT_FIRST], times[late_timing.OUT_LAST]
        ready = times[SORTED]
        late = ready - times[late_timing.RECORD_LAST] if m else 0
    else:
        ready = max(record, state[FILL]) + MARGIN
        state[BLEND_END] = max(before, ready) + (raster.cycles[row] if m else 0)
        block[0] = state[BLEND_END]
        block[1] = block[0] + m
        state[FREE_A] = state[FREE_B]
        state[FREE_B] = state[BLEND_END]
    _lose(raster, s, before, ready, state[OFFERED] if b == 0 else before, late, raster.counts[row], m)
    if raster.out[tile] >= 0 and m:
        to = raster.out[tile] + entry * raster.size[0]
        _push(raster, s, block[0], to, to + m * raster.size[0])
        dma.write_block(block[0], m, to, dma.DRAWN_TABLE, raster.ports[s], NOMINAL)
    state[LAST_BLOCK] = block[1]
    state[BATCH] = b + 1
    state[FETCHED] = -1
    return over


@numba.njit(cache=True)
def finish(raster, s, tile, memory):
    """Behind a tile's last batch: its pixels; returns the cycle of done."""
    state = raster.state[s]
    beats = raster.beats[tile]
    ports = raster.ports[s]
    if raster.core == CANDIDATES:
        px = np.zeros(PX_N, np.int64)
        late_timing.end_tile(raster.unit[s], beats, px)
        first, last = px[0], px[1]
    elif raster.core == GROUPS:
        first, last = raster_lane.end_tile(raster.unit[s], beats)
    else:
        first = state[BLEND_END] + MARGIN
        last = first + beats - 1
        state[FREE_B] = last + 1
    raster.lost[s, WAIT_RESOLVE] += last + 1 - state[BLEND_END]
    state[BLEND_END] = last + 1
    begin, width, stride, rows = raster.rows[tile]
    for row in range(rows):
        _push(raster, s, first + beats * (row + 1) // rows, begin + row * stride, begin + row * stride + width)
    if rows:
        columns = (width + dma.PIXEL_BEAT - 1) // dma.PIXEL_BEAT
        dma.write_pixels(first, rows, columns, begin, stride, dma.PIXEL, ports, NOMINAL)
    written = max(dma.written(state[LAST_BLOCK], dma.DRAWN_TABLE, ports), dma.written(last, dma.PIXEL, ports))
    if raster.core == GROUPS:
        return raster_lane.finish_tile(raster.unit[s], written)
    raster.dones[s, state[COUNT] % TILES] = written
    state[COUNT] += 1
    return written


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
