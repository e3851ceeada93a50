"""LPDDR4-3200 at bank level: when each 64-byte access of a frame is served (docs/dram.md).

Time inside is in DRAM clocks (1600 MHz), the callers' in core cycles (1 GHz). An access is placed for good when it is
asked for: at the first clock at which its bank, the ACT spacing and the data bus of its channel are free. All three are
calendars, not a "busy until", so that an access asked for late finds the gaps in front of those placed before it.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

LINE = 64  # bytes of an access: burst length 16 on 32 bits
PEAK = 12.8  # GB/s of a channel
CORE_TICKS, DRAM_TICKS = 8, 5  # a core cycle and a DRAM clock in units of 1/8 ns

# Clocks of LPDDR4-3200, 8 Gb x16 dies, one rank
BL = 8  # data on the bus; also CAS to CAS
RTRS = 2  # read data to written data
CL, DQSCK, CWL = 32, 3, 18
RCD, RPPB, RPAB, RAS = 29, 27, 32, 68  # RC = RAS + RPPB
RTP, WTR, WR = 14, 16, 28
RRD = 16  # FAW = 4 * RRD, so it never binds
RFCAB, REFI = 288, 6247
READ, WRITE = CL + DQSCK, CWL  # CAS to data
RECOVER = CWL + BL + WR  # CAS of a write to precharge
TURN = WTR + READ  # end of written data to read data
AFTER_REFRESH = RPAB + RFCAB  # begin of a refresh period to its first ACT

BANK_BITS, COLUMN_BITS = 3, 6
BANKS = 1 << BANK_BITS  # of a channel; a row has 1 << COLUMN_BITS lines

# The controller
QUEUE = 32  # writes that a channel holds
HIGH, LOW = 26, 6  # writes at which draining begins and ends: 0.8 and 0.2 of the queue
CAP = 16  # accesses of a group to one row while its others wait

SESSIONS = 8  # of a bank that are remembered
ROW, ACT, READY, FIELDS = range(4)  # a session: its row, its ACT, first clock for its precharge
BUS, ACTS = range(2)  # calendars
WORDS = 2048  # of 64 clocks: a calendar reaches back 82 us
READ_END, WRITE_END, WAITING, ACCEPTED = range(2, 6)  # of a channel, behind the calendars' heads
CHANNEL_FIELDS = 6
Q_LINE, Q_CLOCK, Q_FREED, Q_FIELDS = range(4)
PAST = -(1 << 40)
NEVER = 1 << 60

COUNTERS = ("reads", "writes", "row_hits", "row_misses", "row_conflicts", "turnarounds", "last_clock")
READS, WRITES, HITS, MISSES, CONFLICTS, TURNAROUNDS, LAST = range(len(COUNTERS))
LOG_FIELDS = 6  # channel, bank, row, ACT of the session, CAS, write


class DramState(NamedTuple):
    """C channels. Clocks are absolute; what is placed stays."""

    sessions: np.ndarray  # int64[C * BANKS, SESSIONS, FIELDS] in order of time; the last is open until its successor
    calendar: np.ndarray  # uint64[2, C, WORDS] bit k of word w: at clock 64*w + k no read data, no ACT may start
    channels: np.ndarray  # int64[C, CHANNEL_FIELDS] last word of each calendar in use, ends of data, writes
    queue: np.ndarray  # int64[C, QUEUE, Q_FIELDS] writes: waiting line and its clock; when place k was free again
    counters: np.ndarray  # int64[len(COUNTERS)]
    log: np.ndarray  # int64[L, LOG_FIELDS] the first L accesses, for tests


def new_state(channels: int = 4, log: int = 0) -> DramState:
    """An idle memory of `channels` (a power of two) with all banks closed; `log`: accesses to log."""
    if channels < 1 or channels & (channels - 1):
        raise ValueError(f"{channels} channels: wants a power of two")
    sessions = np.full((channels * BANKS, SESSIONS, FIELDS), PAST, np.int64)
    sessions[:, :, ROW] = -1
    state = np.zeros((channels, CHANNEL_FIELDS), np.int64)
    state[:, [READ_END, WRITE_END]] = PAST
    queue = np.full((channels, QUEUE, Q_FIELDS), PAST, np.int64)
    calendar = np.zeros((2, channels, WORDS), np.uint64)
    return DramState(
        sessions, calendar, state, queue, np.zeros(len(COUNTERS), np.int64), np.zeros((log, LOG_FIELDS), np.int64)
    )


@numba.njit(cache=True)
def to_clock(cycle):
    """First DRAM clock that does not begin before core cycle `cycle`."""
    return -(-cycle * CORE_TICKS // DRAM_TICKS)


@numba.njit(cache=True)
def to_cycle(clock):
    """First core cycle that does not begin before DRAM clock `clock`."""
    return -(-clock * DRAM_TICKS // CORE_TICKS)


_DEBRUIJN = 0x03F79D71B4CB0A89
_LOWEST = np.zeros(64, np.int64)
_LOWEST[[((_DEBRUIJN << k) & (2**64 - 1)) >> 58 for k in range(64)]] = np.arange(64)
_MULTIPLIER = np.uint64(_DEBRUIJN)


@numba.njit(cache=True)
def _first_free(calendar, channels, which, channel, clock):
    """First clock >= clock that a calendar has free."""
    at = clock >> 6
    head = channels[channel, which]
    shift = np.uint64(clock & 63)
    while at <= head:
        free = ~calendar[which, channel, at & (WORDS - 1)] >> shift << shift
        if free:
            lowest = free & (~free + np.uint64(1))
            return (at << 6) + _LOWEST[(lowest * _MULTIPLIER) >> np.uint64(58)]
        shift = np.uint64(0)
        at += 1
    return max(clock, at << 6)


@numba.njit(cache=True)
def _block(calendar, channels, which, channel, low, high):
    """Make clocks low .. high - 1 of a calendar busy."""
    first, last = low >> 6, (high - 1) >> 6
    head = channels[channel, which]
    if last > head:
        for at in range(max(head + 1, last - WORDS + 1), last + 1):
            calendar[which, channel, at & (WORDS - 1)] = 0
        channels[channel, which] = last
    full = ~np.uint64(0)
    mask = full << np.uint64(low & 63)
    for at in range(first, last):
        calendar[which, channel, at & (WORDS - 1)] |= mask
        mask = full
    calendar[which, channel, last & (WORDS - 1)] |= mask & (full >> np.uint64(63 - ((high - 1) & 63)))


@numba.njit(cache=True)
def _reach(channels, channel):
    """First clock that both calendars of a channel surely know."""
    return (max(channels[channel, BUS], channels[channel, ACTS]) - WORDS + 4) << 6


@numba.njit(cache=True)
def _data(calendar, channels, channel, clock, write, after):
    """First CAS >= clock whose data the bus can take; written data follow `after`, the end of those before."""
    if write:
        return max(clock, after - WRITE)
    return _first_free(calendar, channels, BUS, channel, clock + READ) - READ


@numba.njit(cache=True)
def _activate(calendar, channels, channel, act, late, write, after):
    """(ACT, CAS, first clock for the precharge) of a session that begins at `act` or later.

    An ACT that cannot be at once goes to a multiple of RRD: placed at the first free clock instead, those of one bank
    and another would leave gaps of less than 2 * RRD, which no ACT can use (docs/dram.md).
    """
    recover = RECOVER if write else RTP
    while True:
        if late:
            act = -(-act // RRD) * RRD
        free = _first_free(calendar, channels, ACTS, channel, act)
        if free > act:
            late = True
            act = free
            continue
        period = act // REFI
        if act >= period * REFI + AFTER_REFRESH:
            cas = _data(calendar, channels, channel, act + RCD, write, after)
            ready = max(act + RAS, cas + recover)
            if ready <= (period + 1) * REFI:
                return act, cas, ready
            period += 1
        late = False
        act = period * REFI + AFTER_REFRESH


@numba.njit(cache=True)
def _place(sessions, calendar, channels, counters, channel, bank, row, clock, write, after):
    """(CAS, ACT of its session) of an access that is there from `clock` on.

    A bank's accesses fall into sessions: ACT, CAS of that row, precharge. The access joins a session of its row or gets
    one of its own behind a session: the first that leaves enough time to the next session. Writes go behind all.
    """
    bank += channel * BANKS
    at = SESSIONS - 1
    while not write and at > 0 and sessions[bank, at, ACT] > clock:
        at -= 1
    recover = RECOVER if write else RTP
    while True:
        limit = sessions[bank, at + 1, ACT] - RPPB if at < SESSIONS - 1 else NEVER
        opened, ready = sessions[bank, at, ACT], sessions[bank, at, READY]
        period = opened // REFI
        if sessions[bank, at, ROW] == row:
            cas = _data(calendar, channels, channel, max(clock, opened + RCD), write, after)
            if cas + recover <= min(limit, (period + 1) * REFI):
                sessions[bank, at, READY] = max(ready, cas + recover)
                counters[HITS] += 1
                return cas, opened
        act = max(clock, ready) + RPPB
        late = ready > clock
        closed = act >= (period + 1) * REFI
        if closed:
            act = max(clock, (period + 1) * REFI + AFTER_REFRESH)
        act, cas, ready = _activate(calendar, channels, channel, act, late, write, after)
        if ready <= limit:
            break
        at += 1
    for k in range(at):
        for field in range(FIELDS):
            sessions[bank, k, field] = sessions[bank, k + 1, field]
    sessions[bank, at, ROW] = row
    sessions[bank, at, ACT] = act
    sessions[bank, at, READY] = ready
    _block(calendar, channels, ACTS, channel, act - RRD + 1, act + RRD)
    counters[MISSES if closed or act >= (period + 1) * REFI else CONFLICTS] += 1
    return cas, act


@numba.njit(cache=True)
def _log(log, counters, channel, bank, row, act, cas, write):
    k = counters[READS] + counters[WRITES]
    if k < len(log):
        log[k, 0], log[k, 1], log[k, 2] = channel, bank, row
        log[k, 3], log[k, 4], log[k, 5] = act, cas, write


@numba.njit(cache=True)
def _bank_of(rest):
    return (rest >> COLUMN_BITS) & (BANKS - 1)


@numba.njit(cache=True)
def _row_of(rest):
    return rest >> (COLUMN_BITS + BANK_BITS)


@numba.njit(cache=True)
def _soonest(sessions, channels, queue, channel, clock, after):
    """Place in the queue of the write that can have its CAS first; of equal ones the oldest."""
    pick, best = 0, NEVER
    for k in range(channels[channel, WAITING]):
        rest = queue[channel, k, Q_LINE]
        bank = channel * BANKS + _bank_of(rest)
        if sessions[bank, SESSIONS - 1, ROW] == _row_of(rest):
            cas = sessions[bank, SESSIONS - 1, ACT] + RCD
        else:
            cas = max(clock, sessions[bank, SESSIONS - 1, READY]) + RPPB + RCD
        cas = max(cas, after - WRITE)
        if cas < best:
            pick, best = k, cas
    return pick


@numba.njit(cache=True)
def _drain(state, channel, clock, count):
    """Write `count` waiting lines in one bunch from `clock` on, behind all read data that are placed."""
    sessions, calendar, channels, queue, counters, log = state
    if channels[channel, READ_END] > channels[channel, WRITE_END]:
        counters[TURNAROUNDS] += 1
    after = max(clock, channels[channel, WRITE_END], channels[channel, READ_END] + RTRS)
    first = NEVER
    for _ in range(count):
        pick = _soonest(sessions, channels, queue, channel, clock, after)
        rest = queue[channel, pick, Q_LINE]
        bank, row = _bank_of(rest), _row_of(rest)
        cas, act = _place(sessions, calendar, channels, counters, channel, bank, row, clock, True, after)
        _log(log, counters, channel, bank, row, act, cas, 1)
        counters[WRITES] += 1
        first = min(first, cas + WRITE)
        after = cas + WRITE + BL
        number = channels[channel, ACCEPTED] - channels[channel, WAITING]
        queue[channel, number & (QUEUE - 1), Q_FREED] = cas
        channels[channel, WAITING] -= 1
        for k in range(pick, channels[channel, WAITING]):
            queue[channel, k, Q_LINE] = queue[channel, k + 1, Q_LINE]
            queue[channel, k, Q_CLOCK] = queue[channel, k + 1, Q_CLOCK]
    channels[channel, WRITE_END] = after
    _block(calendar, channels, BUS, channel, first - RTRS - BL + 1, after + TURN)
    counters[LAST] = max(counters[LAST], after)


@numba.njit(cache=True)
def _drain_if_idle(state, channel, clock):
    """Write what waits if the channel had the time for it before `clock`."""
    channels = state.channels
    n = channels[channel, WAITING]
    begin = max(channels[channel, READ_END] + RTRS, channels[channel, WRITE_END], state.queue[channel, n - 1, Q_CLOCK])
    if begin + RPPB + RCD + WRITE + n * BL + TURN < clock:
        _drain(state, channel, begin, n)


@numba.njit(cache=True)
def _channel_bits(channels):
    bits = 0
    while 1 << bits < len(channels):
        bits += 1
    return bits


@numba.njit(cache=True)
def serve(state, cycle, line, write):
    """One 64-byte access, asked for at core cycle `cycle`: the cycle in which a read's data are there, or in which a
    write is accepted. line: byte address / 64. Callers come nearly in the order of time."""
    sessions, calendar, channels, queue, counters, log = state
    channel = line & (len(channels) - 1)
    rest = line >> _channel_bits(channels)
    clock = max(to_clock(cycle), _reach(channels, channel))
    if channels[channel, WAITING]:
        _drain_if_idle(state, channel, clock)
    if write:
        clock = max(clock, queue[channel, channels[channel, ACCEPTED] & (QUEUE - 1), Q_FREED])
        place = channels[channel, WAITING]
        queue[channel, place, Q_LINE] = rest
        queue[channel, place, Q_CLOCK] = clock
        channels[channel, WAITING] += 1
        channels[channel, ACCEPTED] += 1
        if channels[channel, WAITING] == HIGH:
            _drain(state, channel, clock, HIGH - LOW)
        return to_cycle(clock)
    bank, row = _bank_of(rest), _row_of(rest)
    cas, act = _place(sessions, calendar, channels, counters, channel, bank, row, clock, False, 0)
    _log(log, counters, channel, bank, row, act, cas, 0)
    end = cas + READ + BL
    _block(calendar, channels, BUS, channel, end - 2 * BL + 1, end)
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
            if hits and state.sessions[bank, SESSIONS - 1, ROW] != row:
                continue
            served = 0
            j = i
            while j >= 0 and served < CAP:
                if out[j] < 0 and _row_of(lines[j] >> bits) == row:
                    out[j] = serve(state, cycle, lines[j], write)
                    served += 1
                j = following[j]


@numba.njit(cache=True)
def flush(state, cycle):
    """Write everything that waits; the core cycle in which the last data are in the memory."""
    for channel in range(len(state.channels)):
        n = state.channels[channel, WAITING]
        if n:
            _drain(state, channel, to_clock(cycle), n)
    return max(cycle, to_cycle(state.counters[LAST]))


def counters(state: DramState) -> dict[str, int]:
    """What happened: COUNTERS, the clocks with data on a bus (busy_clocks) and refreshes, summed over the channels."""
    values = dict(zip(COUNTERS, state.counters.tolist()))
    values["busy_clocks"] = BL * (values["reads"] + values["writes"])
    values["refreshes"] = len(state.channels) * (values["last_clock"] // REFI + 1)
    return values
