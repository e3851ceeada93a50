"""One frame on a whole accelerator, event by event: preprocessing, sorting lanes, raster lanes, writes, one memory.

Agents act in the order of time; each carries the recurrences of its unit from one piece of work to the next:

    preprocess   a block of Gaussians: read, compute, write
    slice        takes the next tile (in Morton order) as soon as its lane for it is free
    sort lane    a piece of its job; the job's cycles are those of the RTL on a memory of nominal latency, and what the
                 memory answers later than that is added
    raster lane  a batch: list, records, tests, blending (raster_agent.py)
    writer       what a raster lane has written: tables and pixels

On a memory of fixed latency one slice gives exactly the cycles of golden/slice.py, and so of the RTL.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from golden.slice import OFFER, QUEUE
from golden.timing import raster_agent, raster_state
from golden.timing.memory import NEVER, OUTSTANDING, PREPROCESS, SORTING, answer

AHEAD = 4  # blocks of Gaussians that preprocessing has asked for and not yet written
STREAMS = 128  # lines of preprocessing on their way at once: most are in order
LATENCY = 40  # cycles before a block's data are there in which the next one's are asked for
WRITES = 32  # lines a writer sends at once


class Trace(NamedTuple):
    """When it happened; T tiles in the order they are taken."""

    preprocess: np.ndarray  # int64[2] begin, end
    slice: np.ndarray  # int64[T] which took it
    accepted: np.ndarray  # int64[T]
    ready: np.ndarray  # int64[T] sorted table in memory
    started: np.ndarray  # int64[T] raster lane takes it
    done: np.ndarray  # int64[T]
    slip: np.ndarray  # int64[T] cycles that the memory added to the tile's sort


def new_trace(tiles: int) -> Trace:
    """Of a frame with so many tiles."""
    return Trace(np.zeros(2, np.int64), *(np.zeros(tiles, np.int64) for _ in range(6)))


# State of preprocessing: the next block to be read and to be written, when the units are free and the last write is
# through, when blocks were computed (a ring)
BLOCK, WRITTEN, UNITS_FREE, PUT, ENDS = range(5)
PRE_N = ENDS + AHEAD


@numba.njit(cache=True)
def _preprocess(work, now, memory, state):
    """Preprocessing acts in cycle `now`: writes a block that has been computed, or reads the next one.

    Returns the cycle in which it acts again.
    """
    blocks = len(work.cycles)
    b = state[WRITTEN]
    if b < state[BLOCK] and state[ENDS + b % AHEAD] <= now:
        ring = np.full(STREAMS, now, np.int64)
        for i in range(work.write_at[b], work.write_at[b + 1]):
            k = i % STREAMS
            ring[k] = answer(memory, ring[k], work.write[i], True, PREPROCESS)
            state[PUT] = max(state[PUT], ring[k])
        state[WRITTEN] = b + 1
    elif state[BLOCK] < blocks and state[BLOCK] < b + AHEAD:
        b = state[BLOCK]
        ring = np.full(STREAMS, now, np.int64)
        there = now
        for i in range(work.read_at[b], work.read_at[b + 1]):
            k = i % STREAMS
            ring[k] = answer(memory, ring[k], work.read[i], False, PREPROCESS)
            there = max(there, ring[k])
        state[UNITS_FREE] = max(state[UNITS_FREE], there) + work.cycles[b]
        state[ENDS + b % AHEAD] = state[UNITS_FREE]
        state[BLOCK] = b + 1
        now = max(now, there - LATENCY)
    b = state[WRITTEN]
    if b == blocks:
        return NEVER
    if state[BLOCK] < blocks and state[BLOCK] < b + AHEAD:
        return now
    return max(now, state[ENDS + b % AHEAD])


@numba.njit(cache=True)
def _sort_piece(jobs, piece, now, need, memory):
    """One piece of a job, asked for in cycle `now`, due in cycle `need`.

    Returns by how much it comes later than a memory of nominal latency would let it.
    """
    line = jobs.line[piece]
    late = np.int64(0)
    if jobs.write[piece]:
        for k in range(jobs.lines[piece]):
            late = max(late, answer(memory, now, line + k, True, SORTING) - (now + memory.write))
        return late
    last = now
    if line < 0:
        ring = np.full(OUTSTANDING, now, np.int64)
        for k in range(jobs.lines[piece]):
            ring[k % OUTSTANDING] = answer(memory, ring[k % OUTSTANDING], jobs.apart[k - 1 - line], False, SORTING)
        last = ring.max()
    else:
        for k in range(jobs.lines[piece]):
            last = max(last, answer(memory, now, line + k, False, SORTING))
    return last - max(need, now + memory.read)


@numba.njit(cache=True)
def only_blocks(begin, preprocess, memory, trace):
    """Preprocessing without tiles, from cycle `begin` on; returns the cycle behind the last thing."""
    state = np.full(PRE_N, begin, np.int64)
    state[BLOCK] = state[WRITTEN] = 0
    now = begin
    while len(preprocess.cycles) and now < NEVER:
        now = _preprocess(preprocess, now, memory, state)
    trace.preprocess[0] = begin
    trace.preprocess[1] = max(state[UNITS_FREE], state[PUT])
    return trace.preprocess[1]


@numba.njit(cache=True)
def run(begin, preprocess, order, jobs, raster, memory, slices, cores, trace):
    """One frame from cycle `begin` on; fills trace and raster's results; returns the cycle behind the last thing.

    Preprocessing and the tiles go on at the same time: for a frame in which one waits for the other, call it twice.
    order int64[T]: tiles as they are taken; jobs, raster: by tile. slices, cores: raster cores, and sorting cores of
    each.
    """
    tiles = len(order)
    blocks = len(preprocess.cycles)
    # Agents: 0 preprocess, then slices, lanes, raster lanes, writers
    at_lane = 1 + slices
    at_raster = at_lane + slices * cores
    at_writer = at_raster + slices
    time = np.full(at_writer + slices, NEVER, np.int64)
    time[0] = begin
    pre_state = np.full(PRE_N, begin, np.int64)
    pre_state[BLOCK] = pre_state[WRITTEN] = 0
    trace.preprocess[0] = begin
    trace.preprocess[1] = begin
    time[1:at_lane] = begin + OFFER
    if blocks == 0:
        time[0] = NEVER

    next_tile = 0
    mine = np.full((slices, tiles), -1, np.int64)  # places in order that a slice took
    taken = np.zeros(slices, np.int64)
    finish = np.full(tiles, NEVER, np.int64)
    trace.ready[:] = NEVER
    trace.started[:] = NEVER
    lane_piece = np.zeros(slices * cores, np.int64)
    lane_total = np.zeros(slices * cores, np.int64)  # weight of the job
    lane_done = np.zeros(slices * cores, np.int64)  # weight behind
    lane_slip = np.zeros(slices * cores, np.int64)
    lane_before = np.zeros(slices * cores, np.int64)
    drawn = np.zeros(slices, np.int64)  # tiles a raster lane has started
    end = begin

    while True:
        agent = np.argmin(time)
        now = time[agent]
        if now >= NEVER:
            break
        if agent == 0:
            time[0] = _preprocess(preprocess, now, memory, pre_state)
            trace.preprocess[1] = max(pre_state[UNITS_FREE], pre_state[PUT])
            end = max(end, trace.preprocess[1])
        elif agent < at_lane:
            s = agent - 1
            time[agent] = NEVER
            if next_tile == tiles:
                continue
            place = next_tile
            next_tile += 1
            k = taken[s]
            mine[s, k] = place
            taken[s] = k + 1
            trace.slice[place] = s
            trace.accepted[place] = now
            lane = s * cores + k % cores
            first, last = jobs.piece_at[order[place]], jobs.piece_at[order[place] + 1]
            lane_piece[lane] = first
            lane_total[lane] = max(jobs.weight[first:last].sum(), 1)
            lane_done[lane] = 0
            lane_slip[lane] = 0
            lane_before[lane] = 0
            time[at_lane + lane] = now
            if k + 1 < cores:
                time[agent] = now + 1
            elif trace.ready[mine[s, k + 1 - cores]] < NEVER:
                time[agent] = max(now + 1, trace.ready[mine[s, k + 1 - cores]])
        elif agent < at_raster:
            lane = agent - at_lane
            s = lane // cores
            k = taken[s] - 1
            k -= (k - lane % cores) % cores
            place = mine[s, k]
            tile = order[place]
            last, total = jobs.piece_at[tile + 1], lane_total[lane]
            piece = lane_piece[lane]
            if piece < last:
                length = jobs.cycles[tile] * jobs.weight[piece] // total
                behind = jobs.cycles[tile] * lane_done[lane] // total
                need = trace.accepted[place] + behind + lane_slip[lane]
                lane_slip[lane] += max(0, _sort_piece(jobs, piece, now, max(need, now), memory))
                lane_done[lane] += jobs.weight[piece]
                if jobs.weight[piece]:
                    lane_before[lane] = length
                lane_piece[lane] = piece + 1
                due = trace.accepted[place] + jobs.cycles[tile] * lane_done[lane] // total + lane_slip[lane]
                if piece + 1 < last and jobs.weight[piece + 1]:
                    due -= max(lane_before[lane], memory.read)
                elif piece + 1 < last and jobs.weight[piece]:
                    due -= length
                time[agent] = max(now, due)
            else:
                time[agent] = NEVER
                finish[place] = trace.accepted[place] + jobs.cycles[tile] + lane_slip[lane]
                trace.slip[place] = lane_slip[lane]
                _settle(s, k, cores, mine, finish, trace, time, at_raster, drawn, taken, next_tile < tiles)
        elif agent < at_writer:
            s = agent - at_raster
            if raster_state.full(raster, s):
                time[agent] = max(now, time[at_writer + s]) + 1
                continue
            place = mine[s, drawn[s]]
            tile = order[place]
            if trace.started[place] == NEVER:
                offered = max(trace.ready[place], trace.accepted[place] + QUEUE)
                trace.started[place] = raster_agent.begin(raster, s, tile, offered, memory)
                _settle(
                    s, drawn[s] + cores, cores, mine, finish, trace, time, at_raster, drawn, taken, next_tile < tiles
                )
                time[agent] = raster_agent.next_time(raster, s, trace.started[place])
            else:
                over = raster_agent.batch(raster, s, tile, now, memory)
                if over:
                    trace.done[place] = raster_agent.finish(raster, s, tile, memory)
                    end = max(end, trace.done[place] + 1)
                    drawn[s] += 1
                    time[agent] = NEVER
                    k = drawn[s]
                    if k < taken[s] and trace.ready[mine[s, k]] < NEVER:
                        time[agent] = max(trace.ready[mine[s, k]], now)
                else:
                    time[agent] = raster_agent.next_time(raster, s, now)
                if time[at_writer + s] == NEVER:
                    time[at_writer + s] = raster_state.next_write(raster, s)
        else:
            s = agent - at_writer
            taken_at = raster_state.write(raster, s, WRITES, now, memory)
            end = max(end, taken_at)
            time[agent] = max(raster_state.next_write(raster, s), taken_at)
    return end


@numba.njit(cache=True)
def _settle(s, k, cores, mine, finish, trace, time, at_raster, drawn, taken, more):
    """A lane's tile k is ready once it is sorted and the raster lane has begun the lane's last one; wakes who waits."""
    if k >= taken[s] or k < 0:
        return
    place = mine[s, k]
    if finish[place] == NEVER or trace.ready[place] < NEVER:
        return
    ready = finish[place]
    if k >= cores:
        before = trace.started[mine[s, k - cores]]
        if before == NEVER:
            return
        ready = max(ready, before + 1)
    trace.ready[place] = ready
    if drawn[s] == k:
        time[at_raster + s] = ready
    if k + cores == taken[s] and more:
        time[1 + s] = max(trace.accepted[mine[s, taken[s] - 1]] + 1, ready)
