"""LPDDR4-3200: banks, ACT spacing and data bus of a channel, and where one more access fits (docs/dram.md).

Times are DRAM clocks (1600 MHz). An access is placed for good when it is asked for: at the first clock at which its
bank, the ACT spacing and the data bus are free. All three are calendars, not a "busy until", so that an access asked
for late finds the gaps in front of those placed before it.
"""

from __future__ import annotations

import numba
import numpy as np

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

SESSIONS = 8  # of a bank that are remembered
ROW, ACT, READY, FIELDS = range(4)  # a session: its row, its ACT, first clock for its precharge
BUS, ACTS = range(2)  # calendars
WORDS = 2048  # of 64 clocks: a calendar reaches back 82 us
PAST = -(1 << 40)
NEVER = 1 << 60

COUNTERS = ("row_hits", "row_misses", "row_conflicts")
HITS, MISSES, CONFLICTS = range(len(COUNTERS))

njit = numba.njit(cache=True, _nrt=False)  # nothing is allocated below: twice as fast without reference counts


def new_banks(channels: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(sessions, calendar, heads) of idle channels with all banks closed.

    sessions int64[C * BANKS, SESSIONS, FIELDS] in order of time, the last one open until its successor; calendar
    uint64[2, C, WORDS]: bit k of word w is set when no read data (BUS), no ACT (ACTS) may start at clock 64 * w + k;
    heads int64[C, 2]: last word of each calendar in use, behind which all is free.
    """
    sessions = np.full((channels * BANKS, SESSIONS, FIELDS), PAST, np.int64)
    sessions[:, :, ROW] = -1
    return sessions, np.zeros((2, channels, WORDS), np.uint64), np.zeros((channels, 2), np.int64)


_DEBRUIJN = 0x03F79D71B4CB0A89
_LOWEST = np.zeros(64, np.int64)
_LOWEST[[((_DEBRUIJN << k) & (2**64 - 1)) >> 58 for k in range(64)]] = np.arange(64)
_MULTIPLIER = np.uint64(_DEBRUIJN)


@njit
def _first_free(calendar, heads, which, channel, clock):
    """First clock >= clock that a calendar has free."""
    at = clock >> 6
    head = heads[channel, which]
    shift = np.uint64(clock & 63)
    while at <= head:
        free = ~calendar[which, channel, at & (WORDS - 1)] >> shift << shift
        if free:
            lowest = free & (~free + np.uint64(1))
            return (at << 6) + _LOWEST[(lowest * _MULTIPLIER) >> np.uint64(58)]
        shift = np.uint64(0)
        at += 1
    return max(clock, at << 6)


@njit
def block(calendar, heads, which, channel, low, high):
    """Make clocks low .. high - 1 of a calendar busy."""
    first, last = low >> 6, (high - 1) >> 6
    head = heads[channel, which]
    if last > head:
        for at in range(max(head + 1, last - WORDS + 1), last + 1):
            calendar[which, channel, at & (WORDS - 1)] = 0
        heads[channel, which] = last
    full = ~np.uint64(0)
    mask = full << np.uint64(low & 63)
    for at in range(first, last):
        calendar[which, channel, at & (WORDS - 1)] |= mask
        mask = full
    calendar[which, channel, last & (WORDS - 1)] |= mask & (full >> np.uint64(63 - ((high - 1) & 63)))


@njit
def reach(heads, channel):
    """First clock that both calendars of a channel surely know."""
    return (max(heads[channel, BUS], heads[channel, ACTS]) - WORDS + 4) << 6


@njit
def _data(calendar, heads, channel, clock, write, after):
    """First CAS >= clock whose data the bus can take; written data follow `after`, the end of those before."""
    if write:
        return max(clock, after - WRITE)
    return _first_free(calendar, heads, BUS, channel, clock + READ) - READ


@njit
def _activate(calendar, heads, channel, act, late, write, after):
    """(ACT, CAS, first clock for the precharge) of a session that begins at `act` or later.

    An ACT that cannot be at once goes to a multiple of RRD: placed at the first free clock instead, those of one bank
    and another would leave gaps of less than 2 * RRD, which no ACT can use (docs/dram.md).
    """
    recover = RECOVER if write else RTP
    while True:
        if late:
            act = -(-act // RRD) * RRD
        free = _first_free(calendar, heads, ACTS, channel, act)
        if free > act:
            late = True
            act = free
            continue
        period = act // REFI
        if act >= period * REFI + AFTER_REFRESH:
            cas = _data(calendar, heads, channel, act + RCD, write, after)
            ready = max(act + RAS, cas + recover)
            if ready <= (period + 1) * REFI:
                return act, cas, ready
            period += 1
        late = False
        act = period * REFI + AFTER_REFRESH


@njit
def place(sessions, calendar, heads, counters, channel, bank, row, clock, write, after):
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
        soonest = max(clock, opened + RCD)
        if sessions[bank, at, ROW] == row and soonest + recover <= limit:
            cas = _data(calendar, heads, channel, soonest, write, after)
            if cas + recover <= min(limit, (period + 1) * REFI):
                sessions[bank, at, READY] = max(ready, cas + recover)
                counters[HITS] += 1
                return cas, opened
        act = max(clock, ready) + RPPB
        late = ready > clock
        closed = act >= (period + 1) * REFI
        if closed:
            act = max(clock, (period + 1) * REFI + AFTER_REFRESH)
        if act + RAS <= limit:
            act, cas, ready = _activate(calendar, heads, channel, act, late, write, after)
            if ready <= limit:
                break
        at += 1
    for k in range(at):
        for field in range(FIELDS):
            sessions[bank, k, field] = sessions[bank, k + 1, field]
    sessions[bank, at, ROW] = row
    sessions[bank, at, ACT] = act
    sessions[bank, at, READY] = ready
    block(calendar, heads, ACTS, channel, act - RRD + 1, act + RRD)
    counters[MISSES if closed or act >= (period + 1) * REFI else CONFLICTS] += 1
    return cas, act
