"""The memory of a frame: LPDDR4-3200 channels behind a controller, an access at a time (docs/dram.md).

The callers' time is in core cycles (1 GHz), the time inside in DRAM clocks (1600 MHz). Address map, from the top:
row, bank, column, channel. Reads are placed when they are asked for; writes are accepted into a queue and drained in
bunches, behind the reads that are already placed, so that the bus turns once a bunch.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from golden.timing import lpddr4
from golden.timing.lpddr4 import BANKS, BL, BUS, NEVER, READ, RTRS, SESSIONS, TURN, WRITE, njit

LINE = 64  # bytes of an access: burst length 16 on 32 bits
PEAK = 12.8  # GB/s of a channel
CORE_TICKS, DRAM_TICKS = 8, 5  # a core cycle and a DRAM clock in units of 1/8 ns

QUEUE = 32  # writes that a channel holds
HIGH, LOW = 26, 6  # writes at which draining begins and ends: 0.8 and 0.2 of the queue
CAP = 16  # accesses of a group to one row while its others wait
READ_END, WRITE_END, WAITING, ACCEPTED, CHANNEL_FIELDS = range(5)
Q_LINE, Q_CLOCK, Q_NUMBER, Q_FREED, Q_FIELDS = range(5)

COUNTERS = (*lpddr4.COUNTERS, "asked", "reads", "writes", "turnarounds", "last_clock")
ASKED, READS, WRITES, TURNAROUNDS, LAST = range(len(lpddr4.COUNTERS), len(COUNTERS))
LOG_CYCLE, LOG_LINE, LOG_WRITE, LOG_ACT, LOG_CAS, LOG_FIELDS = range(6)


class DramState(NamedTuple):
    """C channels. Clocks are absolute; what is placed stays."""

    sessions: np.ndarray  # these three: lpddr4.new_banks
    calendar: np.ndarray
    heads: np.ndarray
    channels: np.ndarray  # int64[C, CHANNEL_FIELDS] ends of read and of written data, writes waiting, writes accepted
    queue: np.ndarray  # int64[C, QUEUE, Q_FIELDS] writes: line, clock, number of those waiting; when a place was freed
    counters: np.ndarray  # int64[len(COUNTERS)]
    log: np.ndarray  # int64[L, LOG_FIELDS] the first L accesses: as asked for, and the clocks of its ACT and CAS


def new_state(channels: int = 4) -> DramState:
    """An idle memory of `channels` (a power of two) with all banks closed."""
    if channels < 1 or channels & (channels - 1):
        raise ValueError(f"{channels} channels: wants a power of two")
    ends = np.zeros((channels, CHANNEL_FIELDS), np.int64)
    ends[:, [READ_END, WRITE_END]] = lpddr4.PAST
    queue = np.full((channels, QUEUE, Q_FIELDS), lpddr4.PAST, np.int64)
    counters, log = np.zeros(len(COUNTERS), np.int64), np.zeros((0, LOG_FIELDS), np.int64)
    return DramState(*lpddr4.new_banks(channels), ends, queue, counters, log)


def recording(state: DramState, count: int) -> DramState:
    """The same memory, with a log of the next `count` accesses; `asked` counts them from 0."""
    state.queue[:, :, Q_NUMBER] = NEVER
    state.counters[ASKED] = 0
    return state._replace(log=np.zeros((count, LOG_FIELDS), np.int64))


def recorded(state: DramState) -> np.ndarray:
    """int64[n, LOG_FIELDS]: the log of a `recording` memory."""
    asked = int(state.counters[ASKED])
    if asked > len(state.log):
        raise ValueError(f"{asked} accesses; the log holds {len(state.log)}")
    return state.log[:asked]


@njit
def to_clock(cycle):
    """First DRAM clock that does not begin before core cycle `cycle`."""
    return -(-cycle * CORE_TICKS // DRAM_TICKS)


@njit
def to_cycle(clock):
    """First core cycle that does not begin before DRAM clock `clock`."""
    return -(-clock * DRAM_TICKS // CORE_TICKS)


@njit
def _bank_of(rest):
    return (rest >> lpddr4.COLUMN_BITS) & (BANKS - 1)


@njit
def _row_of(rest):
    return rest >> (lpddr4.COLUMN_BITS + lpddr4.BANK_BITS)


@njit
def _soonest(sessions, channels, queue, channel, clock, after):
    """Place in the queue of the write that can have its CAS first; of equal ones the oldest."""
    pick, best = 0, NEVER
    for k in range(channels[channel, WAITING]):
        rest = queue[channel, k, Q_LINE]
        bank = channel * BANKS + _bank_of(rest)
        if sessions[bank, SESSIONS - 1, lpddr4.ROW] == _row_of(rest):
            cas = sessions[bank, SESSIONS - 1, lpddr4.ACT] + lpddr4.RCD
        else:
            cas = max(clock, sessions[bank, SESSIONS - 1, lpddr4.READY]) + lpddr4.RPPB + lpddr4.RCD
        cas = max(cas, after - WRITE)
        if cas < best:
            pick, best = k, cas
    return pick


@njit
def _drain(state, channel, clock, count):
    """Write `count` waiting lines in one bunch from `clock` on, behind all read data that are placed."""
    sessions, calendar, heads, channels, queue, counters, log = state
    if channels[channel, READ_END] > channels[channel, WRITE_END]:
        counters[TURNAROUNDS] += 1
    after = max(clock, channels[channel, WRITE_END], channels[channel, READ_END] + RTRS)
    first = NEVER
    for _ in range(count):
        pick = _soonest(sessions, channels, queue, channel, clock, after)
        rest = queue[channel, pick, Q_LINE]
        bank, row = _bank_of(rest), _row_of(rest)
        cas, act = lpddr4.place(sessions, calendar, heads, counters, channel, bank, row, clock, True, after)
        entry = queue[channel, pick, Q_NUMBER]
        if entry < len(log):
            log[entry, LOG_ACT], log[entry, LOG_CAS] = act, cas
        counters[WRITES] += 1
        first = min(first, cas + WRITE)
        after = cas + WRITE + BL
        number = channels[channel, ACCEPTED] - channels[channel, WAITING]
        queue[channel, number & (QUEUE - 1), Q_FREED] = cas
        channels[channel, WAITING] -= 1
        for k in range(pick, channels[channel, WAITING]):
            for field in (Q_LINE, Q_CLOCK, Q_NUMBER):
                queue[channel, k, field] = queue[channel, k + 1, field]
    channels[channel, WRITE_END] = after
    lpddr4.block(calendar, heads, BUS, channel, first - RTRS - BL + 1, after + TURN)
    counters[LAST] = max(counters[LAST], after)


@njit
def _drain_if_idle(state, channel, clock):
    """Write what waits if the channel had the time for it before `clock`."""
    channels = state.channels
    n = channels[channel, WAITING]
    begin = max(channels[channel, READ_END] + RTRS, channels[channel, WRITE_END], state.queue[channel, n - 1, Q_CLOCK])
    if begin + lpddr4.RPPB + lpddr4.RCD + WRITE + n * BL + TURN < clock:
        _drain(state, channel, begin, n)


@njit
def _channel_bits(channels):
    bits = 0
    while 1 << bits < len(channels):
        bits += 1
    return bits


@njit
def serve(state, cycle, line, write):
    """One 64-byte access, asked for at core cycle `cycle`: the cycle in which a read's data are there, or in which a
    write is accepted. line: byte address / 64. Callers come nearly in the order of time."""
    sessions, calendar, heads, channels, queue, counters, log = state
    channel = line & (len(channels) - 1)
    rest = line >> _channel_bits(channels)
    clock = max(to_clock(cycle), lpddr4.reach(heads, channel))
    if channels[channel, WAITING]:
        _drain_if_idle(state, channel, clock)
    number = counters[ASKED]
    counters[ASKED] += 1
    if number < len(log):
        log[number, LOG_CYCLE], log[number, LOG_LINE], log[number, LOG_WRITE] = cycle, line, write
    if write:
        freed = queue[channel, channels[channel, ACCEPTED] & (QUEUE - 1), Q_FREED]
        clock = max(clock, freed)
        place = channels[channel, WAITING]
        queue[channel, place, Q_LINE] = rest
        queue[channel, place, Q_CLOCK] = clock
        queue[channel, place, Q_NUMBER] = number
        channels[channel, WAITING] += 1
        channels[channel, ACCEPTED] += 1
        if channels[channel, WAITING] == HIGH:
            _drain(state, channel, clock, HIGH - LOW)
        return max(cycle, to_cycle(freed))
    bank, row = _bank_of(rest), _row_of(rest)
    cas, act = lpddr4.place(sessions, calendar, heads, counters, channel, bank, row, clock, False, 0)
    if number < len(log):
        log[number, LOG_ACT], log[number, LOG_CAS] = act, cas
    end = cas + READ + BL
    lpddr4.block(calendar, heads, BUS, channel, end - 2 * BL + 1, end)
    channels[channel, READ_END] = max(channels[channel, READ_END], end)
    counters[READS] += 1
    counters[LAST] = max(counters[LAST], end)
    return to_cycle(end)


@numba.njit(cache=True)
def serve_group(state, cycle, lines, write, out):
    """k accesses asked for at once: out int64[k] as `serve` would return them.

    Row hits go first, then the oldest and with it the others of its row, at most CAP of a row in a turn.
    """
    channels = state.channels
    bits = _channel_bits(channels)
    k = len(lines)
    last = np.full(len(channels) * BANKS, -1, np.int64)
    following = np.full(k, -1, np.int64)
    out[:] = -1
    for i in range(k - 1, -1, -1):
        rest = lines[i] >> bits
        bank = (lines[i] & (len(channels) - 1)) * BANKS + _bank_of(rest)
        following[i] = last[bank]
        last[bank] = i
    for hits in (True, False):
        for i in range(k):
            if out[i] >= 0:
                continue
            row = _row_of(lines[i] >> bits)
            bank = (lines[i] & (len(channels) - 1)) * BANKS + _bank_of(lines[i] >> bits)
            if hits and state.sessions[bank, SESSIONS - 1, lpddr4.ROW] != row:
                continue
            served = 0
            j = i
            while j >= 0 and served < CAP:
                if out[j] < 0 and _row_of(lines[j] >> bits) == row:
                    out[j] = serve(state, cycle, lines[j], write)
                    served += 1
                j = following[j]


@njit
def flush(state, cycle):
    """Write everything that waits; the core cycle in which the last data are in the memory."""
    for channel in range(len(state.channels)):
        n = state.channels[channel, WAITING]
        if n:
            _drain(state, channel, max(to_clock(cycle), state.queue[channel, n - 1, Q_CLOCK]), n)
    return max(cycle, to_cycle(state.counters[LAST]))


def counters(state: DramState) -> dict[str, int]:
    """What happened: COUNTERS, the clocks with data on a bus (busy_clocks) and refreshes, summed over the channels."""
    values = dict(zip(COUNTERS, state.counters.tolist()))
    values["busy_clocks"] = BL * (values["reads"] + values["writes"])
    values["refreshes"] = len(state.channels) * (values["last_clock"] // lpddr4.REFI + 1)
    return values


class Result(NamedTuple):
    """Of `run`: n accesses."""

    asked: np.ndarray  # int64[n] core cycles
    done: np.ndarray  # int64[n] core cycles, as `serve` gives them
    cycles: int  # from the first to the last data
    share: float  # of the peak bandwidth
    counters: dict[str, int]


@numba.njit(cache=True)
def _run(state, lines, writes, cycles, queue, asked, done):
    busy = np.zeros((len(state.channels), queue), np.int64)  # reads of a channel: when their data come
    now = np.int64(0)
    for i in range(len(lines)):
        now = max(now, cycles[i])
        channel = lines[i] & (len(state.channels) - 1)
        place = 0
        if not writes[i]:
            place = np.argmin(busy[channel])
            now = max(now, busy[channel, place])
        asked[i] = now
        done[i] = serve(state, now, lines[i], writes[i])
        if writes[i]:
            now = done[i]
        else:
            busy[channel, place] = done[i]


def run(
    lines, writes=None, cycles=None, channels: int = 4, queue: int = QUEUE, state: DramState | None = None
) -> Result:
    """A whole trace, in order, from one source that has at most `queue` reads in each channel.

    lines int64[n]; writes bool[n], default reads; cycles int64[n]: not asked for before, default as soon as possible.
    """
    lines = np.ascontiguousarray(lines, np.int64)
    n = len(lines)
    writes = np.zeros(n, np.bool_) if writes is None else np.ascontiguousarray(writes, np.bool_)
    cycles = np.zeros(n, np.int64) if cycles is None else np.ascontiguousarray(cycles, np.int64)
    state = new_state(channels) if state is None else state
    asked, done = np.zeros((2, n), np.int64)
    _run(state, lines, writes, cycles, queue, asked, done)
    end = flush(state, asked[-1] if n else 0)
    span = end - int(asked[0]) if n else 0
    share = n * LINE / (max(span, 1) * PEAK * len(state.channels))
    return Result(asked, done, span, share, counters(state))
