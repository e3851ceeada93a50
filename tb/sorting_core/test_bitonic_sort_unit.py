"""gs_bitonic_sort_unit: groups in order, nothing lost, nothing invented, cycles as golden says."""

from functools import partial

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden.formats import BUILD
from golden.sorting_core import bitonic_sort_unit as golden
from tb.lib.stream import Monitor, Scoreboard, Sink, Source, cycle, reset, rng, stall_pairs, start_clock
from tb.sorting_core import beats, entries, send_at

TOP = "gs_bitonic_sort_unit"
SLOW = True
PARAMETERS = [{"NETWORK": golden.RING}, {"NETWORK": golden.BITONIC}, {"SORT_N": 16}]
FIELDS = ("entry", "last")
ONES = (1 << BUILD.entry_w) - 1


class Bench:
    """Source, sink, and the groups that are expected."""

    def __init__(self, dut, source_stall="none", sink_stall="none"):
        start_clock(dut)
        self.n = int(dut.SORT_N.value)
        self.cycles = partial(golden.cycles, network=int(dut.NETWORK.value), sort_n=self.n)
        self.steps = golden.steps(int(dut.NETWORK.value), self.n)
        self.source = Source(dut, "in", FIELDS, source_stall)
        self.sink = Sink(dut, "out", FIELDS, sink_stall)
        Monitor(dut, "out", FIELDS)
        self.board = Scoreboard(self.sink)

    def send(self, words):
        self.source.send(beats(words))
        self.expect(words)

    def expect(self, words):
        self.board.expect(beats(golden.sort_groups(np.asarray(words, np.int64), self.n)))


@cocotb.test()
@stall_pairs
async def test_short_groups_follow_long_ones_under_stalls(dut, source_stall, sink_stall):
    bench = Bench(dut, source_stall, sink_stall)
    await reset(dut)
    g = bench.n
    for turn, n in enumerate((g, 3, 0, 1, g - 1, g, 0, 0, g // 2 - 1, 2 * g + 1, 3 * g, 2)):
        falling = (20 - turn) << BUILD.entry_w - 8
        bench.send(falling + np.sort(entries(n, turn) >> 10)[::-1])
    await bench.board.finish()


@cocotb.test()
async def test_every_length(dut):
    bench = Bench(dut, "random", "random")
    await reset(dut)
    for n in range(50):
        bench.send(entries(n, n, invalid=0.2))
    await bench.board.finish()


@cocotb.test()
async def test_equal_keys_lose_nothing(dut):
    bench = Bench(dut)
    await reset(dut)
    for n in range(1, 2 * bench.n):
        bench.send(entries(n, n, keys=2))
        bench.send([7] * n)
    await bench.board.finish()


@cocotb.test()
@stall_pairs
async def test_entries_of_all_ones_are_not_padding(dut, source_stall, sink_stall):
    bench = Bench(dut, source_stall, sink_stall)
    await reset(dut)
    for ones in range(6):
        bench.send([ONES] * ones + [5, 3, 1, 4, 2][: 5 - ones])
    bench.send([ONES] * bench.n)
    await bench.board.finish()


@cocotb.test()
async def test_a_sorted_group_leaves_without_more_input(dut):
    bench = Bench(dut)
    await reset(dut)
    g = bench.n
    for k in (0, 1, 5, g - 1):
        bench.sink.clear()
        bench.board.expected.clear()
        words = entries(g + k, "wait", k)
        bench.source.send(beats(words)[:-1])
        await bench.sink.wait(g, 200)
        assert [entry for entry, _ in bench.sink.beats] == np.sort(words[:g]).tolist()
        bench.expect(words)
        bench.source.send(beats(words)[-1:])
        await bench.board.finish()


@cocotb.test()
async def test_cycles_without_stalls(dut):
    bench = Bench(dut)
    await reset(dut)
    for n in (0, 1, 15, 16, 17, 31, 32, 33, 100, 256):
        bench.source.cycles.clear()
        bench.send(entries(n, n))
        await bench.board.finish()
        assert bench.sink.cycles[-1] - bench.source.cycles[0] + 1 == bench.cycles(n)


@cocotb.test()
@cocotb.parametrize(gap=[1, 2, 5, 40])
async def test_cycles_with_late_input(dut, gap):
    bench = Bench(dut)
    await reset(dut)
    for n in (1, 15, 16, 17, 40, 100):
        generator = rng("late", gap, n)
        arrival = np.cumsum([generator.randint(0, gap) for _ in range(n + 1)])
        bench.source.cycles.clear()
        bench.sink.cycles.clear()
        zero = cycle() + 3
        words = entries(n, n, gap)
        bench.expect(words)
        await send_at(bench.source, dut, words, arrival, zero)
        await bench.board.finish()
        taken, sent = golden.timing(arrival, bench.steps, bench.n)
        assert [c - zero for c in bench.source.cycles] == taken.tolist()
        assert [c - zero for c in bench.sink.cycles[-n - 1 :]] == sent.tolist()


@cocotb.test()
async def test_behind_an_end_beat_the_unit_takes_an_entry_a_cycle(dut):
    bench = Bench(dut)
    await reset(dut)
    for n in (0, 1, 3, 15, 16, 18):
        bench.source.cycles.clear()
        bench.sink.clear()
        bench.source.send(beats(entries(n, n)))
        await bench.sink.wait(n + 1)
        assert [c - bench.source.cycles[0] for c in bench.sink.cycles[-1:]] == [bench.cycles(n) - 1]
        bench.source.cycles.clear()
        bench.source.send(beats([5, 4]))
        start = cycle() + 1
        await bench.sink.wait(n + 4)
        assert bench.source.cycles == [start, start + 1, start + 2]


@cocotb.test()
async def test_reset_in_flight_forgets_everything(dut):
    bench = Bench(dut, sink_stall="random")
    await reset(dut)
    for n in (1, 10, 40, 70):
        bench.source.send(beats(entries(60, "before", n)))
        for _ in range(n):
            await RisingEdge(dut.clk)
        dut.rst.value = 1
        bench.source.clear()
        await reset(dut)
        bench.sink.clear()
        bench.board.expected.clear()
        bench.send(entries(20, "behind", n))
        await bench.board.finish()
