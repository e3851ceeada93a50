"""gs_sorting_core: both commands against golden, in data and in cycles."""

from itertools import chain, repeat

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden import params
from golden.records import INVALID
from golden.sorting_core import bitonic_sort_unit
from golden.sorting_core import sorting_core as golden
from tb.lib.stream import Monitor, Scoreboard, Sink, Source, cycle, reset, rng, stall_pairs, start_clock
from tb.sorting_core import beats, blocks, entries, send_at

TOP = "gs_sorting_core"
SLOW = True
PARAMETERS = [{}, {"NETWORK": bitonic_sort_unit.BITONIC}]
C = params.CHUNK
IN, OUT = ("entry", "last"), ("entry", "len", "last")
LENGTHS = (0, 1, 2, 15, 16, 17, 127, 128, 129, 200, 255, 256, 257, 383, 384, 385, 511, 512, 513, 1000)
SORT, MERGE = 0, 1


class Bench:
    """Commands and lists in, blocks out."""

    def __init__(self, dut, source_stall="none", sink_stall="none"):
        start_clock(dut)
        self.dut = dut
        self.network = int(dut.NETWORK.value)
        self.cmd = Source(dut, "cmd", ("merge", "first"), source_stall)
        self.a = Source(dut, "a", IN, source_stall, "a")
        self.b = Source(dut, "b", IN, source_stall, "b")
        self.out = Sink(dut, "out", OUT, sink_stall)
        Monitor(dut, "out", OUT[1:])  # the entry of an empty block may change
        self.board = Scoreboard(self.out)

    def expect(self, a, b, merge, first):
        words = golden.merge(a, b) if merge else golden.sort(a, b, first)
        self.board.expect(blocks(words, C))

    def send(self, a, b, merge=SORT, first=C):
        self.cmd.send([(merge, first)])
        self.a.send(beats(a))
        self.b.send(beats(b))
        self.expect(a, b, merge, first)

    def clear(self):
        for source in (self.cmd, self.a, self.b):
            source.cycles.clear()
        self.out.clear()
        self.board.expected.clear()

    async def timed(self, a, b, merge, first, a_arrival, b_arrival):
        """One command on the idle core: every beat's cycle equals golden's."""
        self.clear()
        self.expect(a, b, merge, first)
        await self.out.edge
        self.cmd.send([(merge, first)])
        zero = cycle() + 1
        sends = [
            cocotb.start_soon(send_at(source, self.dut, words, arrival, zero))
            for source, words, arrival in ((self.a, a, a_arrival), (self.b, b, b_arrival))
        ]
        while not self.cmd.cycles or str(self.dut.cmd_ready.value) == "1":
            await self.out.edge
        assert self.cmd.cycles == [zero]
        while str(self.dut.cmd_ready.value) == "0":
            await self.out.edge
        ready = cycle() - zero
        for send in sends:
            await send
        await self.board.finish()
        want = golden.timing(a_arrival, b_arrival, a, b, first, bool(merge), self.network)
        assert [c - zero for c in self.a.cycles] == want.a_taken.tolist()
        assert [c - zero for c in self.b.cycles] == want.b_taken.tolist()
        beats_at = [f + i for f, k in zip(want.blocks, want.lengths, strict=True) for i in range(max(k, 1))]
        assert [c - zero for c in self.out.cycles] == beats_at
        assert beats_at[-1] == want.end and ready == want.ready


def table(n, kind, *names):
    words = entries(n, kind, *names, invalid=0.1 if kind == "random" else 0.0)
    if kind == "reversed":
        words = np.sort(words)[::-1].copy()
    elif kind == "equal":
        words[:] = 7 << 24
    elif kind == "invalid":
        words |= INVALID
    return words


def late(n, gap, *names):
    """Cycles in which the beats of a list of n entries come: bursts and holes."""
    generator = rng("late", n, gap, *names)
    return np.cumsum([generator.choice((0, 1, 1, gap)) for _ in range(n + 1)])


@cocotb.test()
@stall_pairs
async def test_lists_pass_under_stalls(dut, source_stall, sink_stall):
    bench = Bench(dut, source_stall, sink_stall)
    await reset(dut)
    for merge, n_a, n_b in (
        (SORT, 0, 0),
        (SORT, 70, 9),
        (MERGE, 40, 50),
        (SORT, 300, 20),
        (MERGE, 0, 0),
        (SORT, 3, 90),
    ):
        a = table(n_a, "random", n_a)
        b = np.sort(table(n_b, "random", n_b, "b"))
        bench.send(np.sort(a) if merge else a, b, merge, C // 2)
    await bench.board.finish(quiet_cycles=100)


@cocotb.test()
@cocotb.parametrize(kind=["reversed", "random", "equal", "invalid"])
async def test_every_length_in_data_and_cycles(dut, kind):
    bench = Bench(dut)
    await reset(dut)
    for n in LENGTHS:
        for first in (C, C // 2):
            n_b = rng(n, first, kind).choice((0, 0, 1, 16, 100, 300))
            a, b = table(n, kind, first), np.sort(entries(n_b, n, first, invalid=0.1))
            there = np.zeros(n + 1, np.int64), np.zeros(n_b + 1, np.int64)
            await bench.timed(a, b, SORT, first, *there)


@cocotb.test()
@cocotb.parametrize(merge=[SORT, MERGE], gap=[2, 8, 100])
async def test_cycles_with_late_input(dut, merge, gap):
    bench = Bench(dut)
    await reset(dut)
    for n_a, n_b, first in ((0, 0, C), (0, 40, C), (5, 300, C // 2), (300, 40, 100), (513, 1, 200), (700, 300, C // 2)):
        a, b = entries(n_a, n_b, gap, invalid=0.2), np.sort(entries(n_b, n_a, gap, invalid=0.2))
        a = np.sort(a) if merge else a
        await bench.timed(a, b, merge, first, late(n_a, gap, n_b), late(n_b, gap, n_a))


@cocotb.test()
async def test_more_incoming_than_table(dut):
    bench = Bench(dut)
    await reset(dut)
    a, b = table(10, "random"), np.sort(entries(3000))
    there = np.zeros(11, np.int64), np.zeros(3001, np.int64)
    await bench.timed(a, b, SORT, C, *there)
    await bench.timed(b, np.sort(a), MERGE, C, *there[::-1])


@cocotb.test()
async def test_merge_crosses_the_borders_of_chunks(dut):
    bench = Bench(dut)
    await reset(dut)
    a = np.concatenate([np.arange(400, 100, -1), np.arange(1000, 600, -1)])
    for b in (np.arange(250, 900, 7), np.array([0, 9000]), np.full(300, 256)):
        bench.send(a, b)
    invalid = a.copy()
    invalid[:256] |= INVALID
    bench.send(invalid, np.arange(5))
    await bench.board.finish()


@cocotb.test()
@cocotb.parametrize(n_b=[0, 1, 2, 3])
async def test_the_end_of_a_chunk_waits_for_the_sink(dut, n_b):
    bench = Bench(dut)
    held = 10 * C  # cycles; the block buffer takes C + 1 entries meanwhile, the MSU+ holds the next
    bench.out.go = chain(repeat(False, held), repeat(True))
    await reset(dut)
    bench.send(np.arange(600, 0, -1), np.arange(n_b))
    await bench.board.finish()


@cocotb.test()
async def test_a_list_that_waits_for_its_predecessor_delays_the_next_command(dut):
    bench = Bench(dut)
    await reset(dut)
    a, b = np.arange(255), np.arange(1)
    for _ in range(3):
        bench.send(a[:200], a[:55], MERGE)
        bench.send(a[:0], a[:0], MERGE)
        bench.send(b, b, MERGE)
    await bench.board.finish()


@cocotb.test()
async def test_cycles_of_commands_that_follow_each_other(dut):
    bench = Bench(dut)
    await reset(dut)
    jobs = []
    for merge, n_a, n_b in (
        (MERGE, 200, 55),
        (MERGE, 0, 0),
        (MERGE, 3, 0),
        (SORT, 20, 255),
        (SORT, 1, 1),
        (SORT, 600, 9),
    ):
        a, b = entries(n_a, merge), np.sort(entries(n_b, "b"))
        a = np.sort(a) if merge else a
        jobs.append((a, b, merge))
        bench.send(a, b, merge)
    await bench.board.finish()
    starts, sent, busy, ready = bench.cmd.cycles, bench.out.cycles, -1, None
    for (a, b, merge), zero in zip(jobs, starts, strict=True):
        assert ready is None or zero == ready
        there = np.zeros(len(a) + 1, np.int64), np.zeros(len(b) + 1, np.int64)
        want = golden.timing(*there, a, b, C, bool(merge), bench.network, busy - zero)
        beats_at = [f + i + zero for f, k in zip(want.blocks, want.lengths, strict=True) for i in range(max(k, 1))]
        assert sent[: len(beats_at)] == beats_at
        sent, busy, ready = sent[len(beats_at) :], beats_at[-1], zero + want.ready


@cocotb.test()
async def test_reset_in_flight_forgets_everything(dut):
    bench = Bench(dut, sink_stall="random")
    await reset(dut)
    for wait in (1, 30, 300, 700, 1500, 2500):
        bench.send(table(600, "random", wait), np.sort(entries(100, wait)))
        for _ in range(wait):
            await RisingEdge(dut.clk)
        dut.rst.value = 1
        for source in (bench.cmd, bench.a, bench.b):
            source.clear()
        await reset(dut)
        bench.clear()
        bench.a.send(beats(()))
        for _ in range(10):
            await RisingEdge(dut.clk)
        assert not bench.a.cycles, "a beat without a command"
        bench.cmd.send([(SORT, C)])
        bench.b.send(beats(()))
        bench.board.expect(blocks((), C))
        bench.send(table(40, "random", wait), np.sort(entries(5, wait)), SORT, C // 2)
        await bench.board.finish()
