"""gs_block_buffer: blocks with their length at the first beat, an entry a cycle, cycles as golden says."""

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden.sorting_core import sorting_core as golden
from tb.lib.stream import Monitor, Scoreboard, Sink, Source, reset, rng, stall_pairs, start_clock
from tb.sorting_core import beats, blocks

TOP = "gs_block_buffer"
SLOW = True
PARAMETERS = [{"WIDTH": 48, "DEPTH": 16}, {"WIDTH": 48, "DEPTH": 2}, {"WIDTH": 48, "DEPTH": 256}]
OUT = ("data", "len", "last")


class Bench:
    """Source, sink, and the blocks that are expected."""

    def __init__(self, dut, source_stall="none", sink_stall="none"):
        start_clock(dut)
        self.depth = 1 << (len(dut.out_len) - 1)
        self.source = Source(dut, "in", ("data", "last"), source_stall)
        self.sink = Sink(dut, "out", OUT, sink_stall)
        Monitor(dut, "out", OUT[1:])
        self.board = Scoreboard(self.sink)

    def send(self, n, *names):
        generator = rng(n, *names)
        words = [generator.getrandbits(48) for _ in range(n)]
        self.source.send(beats(words))
        self.board.expect(blocks(words, self.depth))


@cocotb.test()
@stall_pairs
async def test_lists_become_blocks_under_stalls(dut, source_stall, sink_stall):
    bench = Bench(dut, source_stall, sink_stall)
    await reset(dut)
    d = min(bench.depth, 64)
    for n in (0, 0, 1, d - 1, d, d + 1, 0, 3 * d, 1, 1, 2, bench.depth, 3):
        bench.send(n)
    await bench.board.finish()


@cocotb.test()
async def test_cycles_of_single_lists(dut):
    bench = Bench(dut)
    await reset(dut)
    d = bench.depth
    for n in (0, 1, d - 1, d, d + 1, 2 * d, 3 * d + d // 2, 0):
        bench.source.cycles.clear()
        bench.sink.clear()
        bench.board.expected.clear()
        bench.send(n, "cycles")
        await bench.board.finish()
        taken = np.array(bench.source.cycles)
        assert taken.tolist() == list(range(taken[0], taken[0] + n + 1)), "the source was stalled"
        first, length = golden.blocks(taken, d, -1)
        want = [int(f) + i for f, k in zip(first, length, strict=True) for i in range(max(int(k), 1))]
        assert bench.sink.cycles == want
        assert want[-1] - taken[0] + 1 == golden.block_buffer_cycles(n, d)


@cocotb.test()
async def test_cycles_of_lists_that_follow_each_other(dut):
    bench = Bench(dut, "burst")
    await reset(dut)
    d = bench.depth
    lengths = [0, 1, d, d - 1, 3, 0, 0, 2 * d, 2 * d + 1, 1, 5 * d]
    for n in lengths:
        bench.send(n)
    await bench.board.finish()
    taken, want, busy = bench.source.cycles, [], -1
    for n in lengths:
        first, length = golden.blocks(np.array(taken[: n + 1]), d, busy)
        want += [int(f) + i for f, k in zip(first, length, strict=True) for i in range(max(int(k), 1))]
        taken, busy = taken[n + 1 :], want[-1]
    assert bench.sink.cycles == want


@cocotb.test()
async def test_a_block_and_a_head_fit_under_a_stall(dut):
    bench = Bench(dut)
    dut.out_ready.value = 0
    bench.sink.go = iter(lambda: False, True)
    await reset(dut)
    bench.send(4 * bench.depth)
    for _ in range(5 * bench.depth + 10):
        await RisingEdge(dut.clk)
    assert len(bench.source.cycles) == min(bench.depth + 1, 2 * bench.depth)


@cocotb.test()
async def test_reset_in_flight_forgets_everything(dut):
    bench = Bench(dut, sink_stall="random")
    await reset(dut)
    for n in (1, bench.depth, 3 * bench.depth):
        bench.send(n, "before")
        for _ in range(rng(n).randint(1, 2 * n)):
            await RisingEdge(dut.clk)
        dut.rst.value = 1
        bench.source.clear()
        await reset(dut)
        bench.sink.clear()
        bench.board.expected.clear()
        bench.send(bench.depth + 3, "behind")
        await bench.board.finish()
