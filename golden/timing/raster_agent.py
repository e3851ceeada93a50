"""A slice's raster lane, batch by batch: list and records from memory, the core's own cycles, what it writes.

The core is gs_raster_core (in gs_raster_lane), gs_late_core or a SIMPLE one: two banks, a batch's cycles given.
Outputs are posted: they go through a queue to the memory and do not hold the core up.
"""

from __future__ import annotations

import numba
import numpy as np

from golden import dma
from golden.raster_core import late_timing, raster_lane, timing
from golden.raster_core.late_timing import BATCH_N, BLENDED, PX_N, SORTED
from golden.raster_core.raster_lane import TILES
from golden.timing.dram import LINE
from golden.timing.memory import OUTSTANDING, RASTER, answer
from golden.timing.raster_state import (
    BATCH,
    BLEND_END,
    CACHE_HIT,
    CANDIDATES,
    COUNT,
    FETCHED,
    FILL,
    FREE_A,
    FREE_B,
    GROUPS,
    LAST_BLOCK,
    LIST_FREE,
    LISTED,
    MARGIN,
    NOMINAL,
    OFFERED,
    RECORD,
    REQUEST_DELAY,
    SIZE,
    STEP,
    THERE,
    WAIT_RESOLVE,
    lose,
    push,
)


@numba.njit(cache=True)
def begin(raster, s, tile, offered, memory):
    """The lane takes a tile that is offered from `offered` on; returns the cycle in which it does."""
    state = raster.state[s]
    if raster.core == GROUPS:
        taken = listed = raster_lane.begin_tile(raster.unit[s], offered)
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
    state[THERE] = _list(raster, tile, *_range(raster, tile, 0)[:2], listed, memory)
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
    n = raster.fetched[tile]
    entry = raster.first + (batch - 1) * raster.length if batch else 0
    most = raster.length if batch else raster.first
    return entry, max(min(most, n - entry), 0), n - entry < most


@numba.njit(cache=True)
def _list(raster, tile, entry, m, ask, memory):
    """Asks in cycle `ask` for the part of the lists that m entries from `entry` on are; returns when it is there."""
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
    whole = raster.size[3] // dma.BEAT
    for k in range(begin, end):
        beats = raster.heads[entry + k]
        state[RECORD] += 1
        for burst in range(2 if beats < whole else 1):
            there = asked[k] + burst + CACHE_HIT
            for i in range(raster.line_at[entry + k] + burst, raster.line_at[entry + k + 1]):
                at = ring[OUTSTANDING]
                ask = asked[k] + burst if memory.fixed else max(asked[k], ring[at])
                ring[at] = answer(memory, ask, raster.line[i], False, RASTER)
                there = max(there, ring[at])
                ring[OUTSTANDING] = (at + 1) % OUTSTANDING
                if beats < whole:
                    break
            state[RECORD] = max(there, state[RECORD] + burst) + (beats if burst == 0 else whole - beats) - 1
        raster.arrived[s, k] = state[RECORD] + 1


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
        state[THERE] = _list(raster, tile, *_range(raster, tile, b + 1)[:2], now, memory)
    if raster.core == GROUPS:
        heads = raster.heads[raster.entry_at[tile] + entry : raster.entry_at[tile] + entry + m]
        state[FILL] = raster_lane.request_batch(
            unit, offered[: m + 1 if over else m], heads, raster.size[3] // dma.BEAT, asked[:m]
        )
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
def _pass_on(raster, s, tile, cycle, memory):
    """Entries behind the last batch that is drawn are merged and written back as they are, an entry a cycle."""
    fetched = raster.fetched[tile]
    rest = raster.entry_at[tile + 1] - raster.entry_at[tile] - fetched
    if rest:
        end = _list(raster, tile, fetched, rest, cycle, memory) + rest
        size = raster.size[0]
        push(raster, s, end, raster.out[tile] + fetched * size, raster.out[tile] + (fetched + rest) * size)
        raster.state[s, LAST_BLOCK] = end


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
    lose(raster, s, before, ready, state[OFFERED] if b == 0 else before, late, raster.counts[row], m)
    if raster.out[tile] >= 0 and m:
        to = raster.out[tile] + entry * raster.size[0]
        push(raster, s, block[0], to, to + m * raster.size[0])
        dma.write_block(block[0], m, raster.size[2], to, dma.DRAWN_TABLE, raster.ports[s], NOMINAL)
    state[LAST_BLOCK] = block[1]
    if over and raster.out[tile] not in (-1, raster.table[tile]):
        _pass_on(raster, s, tile, block[1], memory)
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
        push(raster, s, first + beats * (row + 1) // rows, begin + row * stride, begin + row * stride + width)
    if rows:
        columns = (width + dma.PIXEL_BEAT - 1) // dma.PIXEL_BEAT
        dma.write_pixels(first, rows, columns, begin, stride, dma.PIXEL, ports, NOMINAL)
    written = max(dma.written(state[LAST_BLOCK], dma.DRAWN_TABLE, ports), dma.written(last, dma.PIXEL, ports))
    if raster.core == GROUPS:
        return raster_lane.finish_tile(raster.unit[s], written)
    raster.dones[s, state[COUNT] % TILES] = written
    state[COUNT] += 1
    return written
