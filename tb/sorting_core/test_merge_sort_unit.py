"""gs_merge_sort_unit: order, ties, deletion, one beat a cycle."""

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden.records import INVALID
from golden.sorting_core import merge_sort_unit as golden
from tb.lib.stream import Monitor, Scoreboard, Sink, Source, reset, rng, stall_pairs, start_clock
from tb.sorting_core import beats, entries

TOP = "gs_merge_sort_unit"
SLOW = True
FIELDS = ("entry", "last")
LENGTHS = (0, 1, 15, 16, 17, 255, 256, 257)


class Bench:
    """Two sources, one sink, and the lists that are expected."""

    def __init__(self, dut, source_stall="none", sink_stall="none"):
        start_clock(dut)
        self.dut = dut
        self.a = Source(dut, "a", FIELDS, source_stall, "a")
        self.b = Source(dut, "b", FIELDS, source_stall, "b")
        self.out = Sink(dut, "out", FIELDS, sink_stall)
        Monitor(dut, "out", FIELDS)
        self.board = Scoreboard(self.out)

    async def start(self, keep=0):
        self.dut.cfg_keep.value = keep
        await reset(self.dut)

    def send(self, a, b, keep=0):
        self.a.send(beats(a))
        self.b.send(beats(b))
        self.board.expect(beats(golden.merge(np.asarray(a, np.int64), np.asarray(b, np.int64), bool(keep))))


def lists(n_a, n_b, *names, invalid=0.2):
    return np.sort(entries(n_a, "a", *names, invalid=invalid)), np.sort(entries(n_b, "b", *names, invalid=invalid))


@cocotb.test()
@stall_pairs
async def test_lists_are_merged_under_stalls(dut, source_stall, sink_stall):
    bench = Bench(dut, source_stall, sink_stall)
    await bench.start()
    for n_a, n_b in ((0, 0), (0, 3), (16, 17), (1, 40), (40, 0)):
        bench.send(*lists(n_a, n_b, n_a, n_b))
    await bench.board.finish()


@cocotb.test()
@cocotb.parametrize(keep=[0, 1])
async def test_every_pair_of_lengths(dut, keep):
    bench = Bench(dut)
    await bench.start(keep)
    for n_a in LENGTHS:
        for n_b in LENGTHS:
            bench.send(*lists(n_a, n_b, n_a, n_b), keep)
    await bench.board.finish(500_000)


@cocotb.test()
async def test_long_lists(dut):
    bench = Bench(dut)
    await bench.start()
    for n_a, n_b in ((4095, 4095), (4095, 0), (10, 3000), (0, 4095)):
        bench.send(*lists(n_a, n_b, n_a, n_b))
    await bench.board.finish()


@cocotb.test()
@cocotb.parametrize(keep=[0, 1])
async def test_a_beat_moves_each_cycle(dut, keep):
    bench = Bench(dut)
    await bench.start(keep)
    for n_a, n_b in ((0, 0), (1, 0), (100, 57), (0, 40), (17, 17)):
        bench.send(*lists(n_a, n_b, n_a), keep)
        await bench.board.finish()
        taken = sorted({*bench.a.cycles[-n_a - 1 :], *bench.b.cycles[-n_b - 1 :]})
        assert taken == list(range(taken[0], taken[0] + golden.cycles(n_a, n_b)))
        assert bench.out.cycles[-1] == taken[-1] + 1


@cocotb.test()
@stall_pairs
async def test_holes_do_not_end_a_list(dut, source_stall, sink_stall):
    bench = Bench(dut, source_stall, sink_stall)
    await bench.start()
    words = np.arange(10, 58)
    b = np.array([5, 30, 70])
    for dropped in (slice(0, None, 2), slice(1, None, 2), slice(0, 1), slice(-1, None), slice(8, 25), slice(0, None)):
        a = words.copy()
        a[dropped] |= INVALID
        bench.send(a, b)
        bench.send(b, a)
    bench.send(words | INVALID, words[:0])
    bench.send(words | INVALID, words | INVALID)
    await bench.board.finish()


@cocotb.test()
@stall_pairs
async def test_equal_keys_follow_the_index(dut, source_stall, sink_stall):
    bench = Bench(dut, source_stall, sink_stall)
    await bench.start()
    key = 7 << 24
    bench.send(key + np.arange(0, 200, 2)[:40], key + np.arange(1, 201, 2)[:40])
    await bench.board.finish()


@cocotb.test()
async def test_a_wins_ties(dut):
    bench = Bench(dut)
    await bench.start()
    bench.send([5, 5, 9], [5, 9, 9])
    await bench.board.finish()
    # of six entries, a's are taken first among equals
    order = sorted([(c, "a") for c in bench.a.cycles] + [(c, "b") for c in bench.b.cycles[:-1]])
    assert "".join(side for _, side in order) == "aababba"


@cocotb.test()
async def test_reset_in_flight_forgets_everything(dut):
    bench = Bench(dut, sink_stall="random")
    await bench.start()
    for n in (1, 7, 20):
        bench.a.send(beats(lists(50, 50, n)[0]))
        bench.b.send(beats(lists(50, 50, n)[1]))
        for _ in range(rng(n).randint(5, 40)):
            await RisingEdge(dut.clk)
        dut.rst.value = 1
        bench.a.clear()
        bench.b.clear()
        await reset(dut)
        bench.out.clear()
        bench.board.expected.clear()
        bench.send(*lists(30, 30, n))
        await bench.board.finish()
