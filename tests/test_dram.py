"""The DRAM model: its commands keep LPDDR4's rules, its bandwidth is that of the peers' simulators (docs/dram.md)."""

import time

import numba
import numpy as np
import pytest

from golden.timing import dram, lpddr4

OPEN = 43  # clocks: CL + DQSCK + BL
FAW = 64
ROW = 4 << lpddr4.COLUMN_BITS  # lines from a row of a bank to the next bank, four channels
BANK = ROW << lpddr4.BANK_BITS  # lines from a row of a bank to its next row


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def streams(count: int, written: int, seed: int, lines: int = 24, n: int = 60000) -> tuple[np.ndarray, np.ndarray]:
    """Lines and writes of `count` tables that are worked on in turn, `lines` at a time; `written` of them written."""
    r = rng(seed)
    base = r.integers(0, 1 << 20, count) * 16
    turns = np.arange(n // count // lines)
    line = base[None, :, None] + turns[:, None, None] * lines + np.arange(lines)
    write = np.broadcast_to(r.permutation(np.arange(count) < written)[None, :, None], line.shape)
    return line.ravel(), write.ravel()


def mixture(gap: float, span: int, n: int = 20000, seed: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(cycles, lines, writes) of several agents: three lines in a row each, up to 400 cycles out of order."""
    r = rng(seed)
    cycles = 1000 + np.cumsum(r.exponential(gap, n)) + r.integers(0, 400, n)
    lines = np.repeat(r.integers(0, span, n), 3)[:n] + np.arange(n) % 3 * 4
    return cycles.astype(np.int64), lines, r.random(n) < 0.3


@numba.njit
def serve_all(state, cycles, lines, writes, done):
    for i in range(len(lines)):
        done[i] = dram.serve(state, cycles[i], lines[i], writes[i])


def breaches(log: np.ndarray, channels: int) -> list[str]:
    """Rules of LPDDR4 that the accesses of a log break. Address map: row, bank, 64 lines, channel."""
    broken = []

    def rule(name: str, kept) -> None:
        if not np.all(kept):
            broken.append(name)

    for channel in range(channels):
        _, line, write, act, cas = log[log[:, dram.LOG_LINE] % channels == channel].T
        bank, row = line // channels // 64 % 8, line // channels // 64 // 8
        ready = np.maximum(act + lpddr4.RAS, cas + np.where(write == 1, lpddr4.CWL + lpddr4.BL + lpddr4.WR, lpddr4.RTP))
        period = act // lpddr4.REFI
        rule("RCD", cas >= act + lpddr4.RCD)
        rule("refresh to ACT", act >= period * lpddr4.REFI + lpddr4.RPAB + lpddr4.RFCAB)
        rule("precharge before refresh", ready <= (period + 1) * lpddr4.REFI)
        opened = []
        for b in range(lpddr4.BANKS):
            acts, session = np.unique(act[bank == b], return_inverse=True)
            last, rows = np.zeros(len(acts), np.int64), np.zeros(len(acts), np.int64)
            np.maximum.at(last, session, ready[bank == b])
            rows[session] = row[bank == b]
            rule("one row open", rows[session] == row[bank == b])
            same = np.diff(acts // lpddr4.REFI) == 0
            rule("precharge to ACT", (acts[1:] >= last[:-1] + lpddr4.RPPB)[same])
            opened.append(acts)
        acts = np.sort(np.concatenate(opened))
        rule("RRD", np.diff(acts) >= lpddr4.RRD)
        rule("FAW", acts[4:] - acts[:-4] >= FAW)
        data = cas + np.where(write == 1, lpddr4.CWL, lpddr4.CL + lpddr4.DQSCK)
        order = np.argsort(data)
        data, cas, write = data[order], cas[order], write[order]
        rule("bus", np.diff(data) >= lpddr4.BL)
        to_write = (write[:-1] == 0) & (write[1:] == 1)
        to_read = (write[:-1] == 1) & (write[1:] == 0)
        rule("RTRS", np.diff(data)[to_write] >= lpddr4.BL + lpddr4.RTRS)
        rule("WTR", (cas[1:] - data[:-1])[to_read] >= lpddr4.BL + lpddr4.WTR)
    return broken


@pytest.mark.parametrize("gap", [0.3, 3, 20], ids=lambda gap: f"gap{gap}")
@pytest.mark.parametrize("span", [1 << 12, 1 << 22], ids=["hot", "wide"])
@pytest.mark.parametrize("channels", [1, 4])
def test_every_command_is_legal(gap, span, channels):
    cycles, lines, writes = mixture(gap, span)
    state = dram.recording(dram.new_state(channels), len(lines))
    serve_all(state, cycles, lines, writes, np.zeros(len(lines), np.int64))
    dram.flush(state, cycles.max())
    counted = dram.counters(state)
    assert counted["reads"] == np.count_nonzero(~writes) and counted["writes"] == np.count_nonzero(writes)
    assert counted["row_hits"] + counted["row_misses"] + counted["row_conflicts"] == len(lines)
    log = dram.recorded(state)
    assert np.array_equal(log[:, : dram.LOG_ACT], np.stack([cycles, lines, writes], 1))
    assert breaches(log, channels) == []


@pytest.mark.parametrize(
    "field, shift, rule",
    [
        (dram.LOG_CAS, -1, "RCD"),
        (dram.LOG_ACT, -1, "RRD"),
        (dram.LOG_CAS, 1, "bus"),
        (dram.LOG_ACT, -lpddr4.AFTER_REFRESH, "refresh to ACT"),
    ],
)
def test_the_check_of_the_commands_sees_one_clock_too_few(field, shift, rule):
    state = dram.recording(dram.new_state(), 8000)
    dram.run(rng().integers(0, 1 << 22, 8000), state=state)
    log = dram.recorded(state)
    assert breaches(log, 4) == []
    log[:, field] += shift * (rng().random(8000) < 0.5)
    assert rule in breaches(log, 4)


def test_an_idle_read_takes_cl_then_rcd_then_rp():
    state = dram.new_state()
    closed = dram.serve(state, 2000, 0, False) - 2000  # these cycles begin with a DRAM clock
    opened = dram.serve(state, 2500, 4, False) - 2500
    conflict = dram.serve(state, 3000, BANK, False) - 3000
    assert closed == dram.to_cycle(lpddr4.RCD + OPEN)
    assert opened == dram.to_cycle(OPEN) == 27
    assert conflict == dram.to_cycle(lpddr4.RPPB + lpddr4.RCD + OPEN)


def test_a_cycle_and_its_clock():
    for cycle in range(100):
        clock = dram.to_clock(cycle)
        assert (clock - 1) * dram.DRAM_TICKS < cycle * dram.CORE_TICKS <= clock * dram.DRAM_TICKS
        cycle = dram.to_cycle(clock)
        assert (cycle - 1) * dram.CORE_TICKS < clock * dram.DRAM_TICKS <= cycle * dram.CORE_TICKS


def test_who_asks_for_an_earlier_time_does_not_wait_for_later_ones():
    alone = dram.serve(dram.new_state(), 1000, 0, False)
    for other in (0, 4, ROW, BANK, 5 * ROW + 8):
        state = dram.new_state()
        for k in range(4):
            dram.serve(state, 1250 + 60 * k, other + k * BANK, False)
        assert dram.serve(state, 1000, 0, False) == alone


def test_callers_out_of_order_wait_little_longer():
    cycles, lines, writes = mixture(5, 1 << 22, 40000)
    mean = []
    for order in (np.arange(len(cycles)), np.argsort(cycles, kind="stable")):
        done = np.zeros(len(cycles), np.int64)
        serve_all(dram.new_state(), cycles[order], lines[order], writes[order], done)
        mean.append((done - cycles[order])[~writes[order]].mean())
    assert mean[0] < 1.3 * mean[1]


def test_sequential_reads_lose_little_but_the_refresh():
    result = dram.run(np.arange(200000))
    assert 0.93 < result.share < 1 - lpddr4.RFCAB / lpddr4.REFI
    assert result.counters["row_hits"] > 0.97 * 200000
    assert result.counters["refreshes"] == 4 * (result.counters["last_clock"] // lpddr4.REFI + 1)
    assert result.counters["busy_clocks"] == 8 * 200000


def test_streams_read_and_written_reach_what_the_peers_measured():
    shares = [
        dram.run(*streams(count, written, seed)).share
        for count, written in ((16, 8), (20, 7), (36, 16))
        for seed in range(3)
    ]
    assert 0.76 <= np.mean(shares) <= 0.81
    assert min(shares) > 0.7 and max(shares) < 0.86


def test_scattered_lines_are_held_by_the_act_spacing():
    result = dram.run(rng().integers(0, 1 << 22, 100000))
    assert 0.43 <= result.share <= 0.48  # BL / RRD = 0.5 but for the refresh
    assert result.counters["row_hits"] < 0.01 * 100000


def test_no_pattern_is_above_the_peak():
    one_row = np.tile(np.arange(ROW), 200)
    for lines in (one_row, np.zeros(20000, np.int64), np.arange(30000)):
        for writes in (np.zeros(len(lines), bool), np.ones(len(lines), bool), np.arange(len(lines)) % 2 == 0):
            assert dram.run(lines, writes).share < 1


def test_channels_multiply_the_bandwidth():
    lines = rng().integers(0, 1 << 22, 100000)
    for pattern in (np.arange(100000), lines):
        four, sixteen = (dram.run(pattern, channels=c) for c in (4, 16))
        assert 3.6 < four.cycles / sixteen.cycles < 4.1
    with pytest.raises(ValueError, match="power of two"):
        dram.new_state(3)


def test_a_turn_of_the_bus_is_paid_once_a_bunch():
    lines, writes = streams(16, 8, 0)
    mixed = dram.run(lines, writes)
    bunch = dram.HIGH - dram.LOW
    assert mixed.counters["writes"] / mixed.counters["turnarounds"] > 0.99 * bunch
    reads = dram.run(lines)
    assert reads.counters["turnarounds"] == 0
    lost = (mixed.cycles - reads.cycles) * dram.CORE_TICKS / dram.DRAM_TICKS * 4 / mixed.counters["turnarounds"]
    assert lost > lpddr4.TURN + lpddr4.RTRS


def test_a_write_is_accepted_at_once_until_the_queue_is_full():
    state = dram.new_state(1)
    accepted = np.array([dram.serve(state, 1000, k * BANK // 4, True) for k in range(200)])  # one bank: drains slowly
    assert (accepted[: dram.QUEUE] == 1000).all()
    assert accepted[dram.QUEUE] > 1000
    waits = np.diff(accepted[dram.QUEUE :]) * dram.CORE_TICKS / dram.DRAM_TICKS
    assert waits.mean() > 0.9 * (lpddr4.RCD + lpddr4.RECOVER + lpddr4.RPPB)
    assert dram.flush(state, accepted[-1]) > accepted[-1]
    assert dram.counters(state)["writes"] == 200


def test_an_idle_channel_writes_what_waits():
    state = dram.new_state(1)
    for k in range(5):
        dram.serve(state, 1000, k, True)
    dram.serve(state, 1010, 10 * BANK, False)
    assert dram.counters(state)["writes"] == 0
    dram.serve(state, 3000, 10 * BANK, False)
    assert dram.counters(state)["writes"] == 5


def test_a_read_waits_for_the_refresh():
    clock = 3 * lpddr4.REFI
    cycle = dram.to_cycle(clock)
    done = dram.serve(dram.new_state(), cycle, 0, False)
    assert done == dram.to_cycle(clock + lpddr4.AFTER_REFRESH + lpddr4.RCD + OPEN)


def test_a_group_takes_row_hits_first_and_then_row_by_row():
    lines = (np.arange(64) % 4) * BANK + np.arange(64) // 4 * 4  # four rows of one bank, in turn
    out = np.zeros(64, np.int64)
    state = dram.new_state()
    dram.serve(state, 500, 2 * BANK, False)
    dram.serve_group(state, 1000, lines, False, out)
    one_by_one = dram.new_state()
    single = [dram.serve(one_by_one, 1000, line, False) for line in lines]
    assert dram.counters(state)["row_conflicts"] == 3
    assert out.max() - 1000 < (max(single) - 1000) / 2
    assert out[2::4].max() < min(out[k::4].min() for k in (0, 1, 3))


def test_a_log_begins_when_it_is_asked_for():
    state = dram.new_state()
    for k in range(10):
        dram.serve(state, 1000 + k, k, True)
    state = dram.recording(state, 5)
    dram.serve(state, 2000, 77, False)
    dram.flush(state, 3000)
    log = dram.recorded(state)
    assert log[:, : dram.LOG_ACT].tolist() == [[2000, 77, 0]] and (state.log[1:] == 0).all()
    for k in range(5):
        dram.serve(state, 4000 + k, k, False)
    with pytest.raises(ValueError, match="6 accesses"):
        dram.recorded(state)


def test_a_trace_keeps_its_times():
    cycles = np.arange(1000) * 100
    result = dram.run(np.arange(1000), cycles=cycles)
    assert np.array_equal(result.asked, cycles)
    assert np.median(result.done - result.asked) == dram.to_cycle(OPEN)


@pytest.mark.parametrize(
    "name, lines, writes",
    [
        ("reads", np.arange(400000), 0),
        ("scattered", rng().integers(0, 1 << 22, 400000), 0),
        ("writes", np.arange(400000), 1),
    ],
)
def test_millions_of_accesses_a_second(name, lines, writes):
    writes = np.full(len(lines), bool(writes))
    dram.run(lines[:10])
    begin = time.thread_time()
    dram.run(lines, writes)
    rate = len(lines) / (time.thread_time() - begin)
    print(f"{name}: {rate / 1e6:.1f} M accesses a second")
    assert rate > 2e6  # 6 to 13 M on an idle core
