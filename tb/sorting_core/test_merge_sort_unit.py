"""gs_merge_sort_unit: order, ties, deletion, one beat a cycle."""

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden.formats import BUILD
from golden.records import INVALID
from golden.sorting_core import merge_sort_unit as golden
from tb.lib.stream import Monitor, Scoreboard, Sink, Source, reset, rng, stall_pairs, start_clock
from tb.sorting_core import beats, entries

TOP = "gs_merge_sort_unit"
SLOW = True
FIELDS = ("entry", "last")
HEADS = "abcd"
LENGTHS = (0, 1, 15, 16, 17, 255, 256, 257)
PAIRS = [(0, 1), (0, 2), (1, 3), (2, 3)]
NONE = np.zeros(0, np.int64)


class Bench:
    """Four sources, one sink, and the lists that are expected."""

    def __init__(self, dut, source_stall="none", sink_stall="none"):
        start_clock(dut)
        self.dut = dut
        self.heads = [Source(dut, name, FIELDS, source_stall, name) for name in HEADS]
        self.out = Sink(dut, "out", FIELDS, sink_stall)
        Monitor(dut, "out", FIELDS)
        self.board = Scoreboard(self.out)

    async def start(self, keep=0):
        self.dut.cfg_keep.value = keep
        await reset(self.dut)

    def send(self, lists, keep=0):
        lists = [np.asarray(words, np.int64) for words in lists]
        for head, words in zip(self.heads, lists, strict=True):
            head.send(beats(words))
        self.board.expect(beats(golden.merge4(*lists, bool(keep))))

    def on(self, pair, *two, keep=0):
        """Two lists at two of the heads, the others empty."""
        self.send([two[pair.index(head)] if head in pair else NONE for head in range(4)], keep)


def lists(lengths, *names, invalid=0.2):
    return [np.sort(entries(n, head, *names, invalid=invalid)) for head, n in zip(HEADS, lengths, strict=True)]


@cocotb.test()
@stall_pairs
async def test_lists_are_merged_under_stalls(dut, source_stall, sink_stall):
    bench = Bench(dut, source_stall, sink_stall)
    await bench.start()
    for lengths in ((0, 0, 0, 0), (0, 3, 0, 9), (16, 17, 20, 2), (1, 40, 0, 0), (0, 0, 40, 7), (0, 0, 0, 20)):
        bench.send(lists(lengths, lengths))
    await bench.board.finish()


@cocotb.test()
@cocotb.parametrize(keep=[0, 1], pair=PAIRS)
async def test_every_pair_of_lengths(dut, keep, pair):
    bench = Bench(dut)
    await bench.start(keep)
    for n_a in LENGTHS:
        for n_b in LENGTHS:
            a, b, _, _ = lists((n_a, n_b, 0, 0), n_a, n_b)
            bench.on(pair, a, b, keep=keep)
    await bench.board.finish(500_000)


@cocotb.test()
@cocotb.parametrize(keep=[0, 1])
async def test_random_lengths_of_four_lists(dut, keep):
    bench = Bench(dut, "random", "random")
    await bench.start(keep)
    generator = rng("four", keep)
    for turn in range(60):
        lengths = [generator.choice((0, 1, 2, 3, 16, 40)) for _ in HEADS]
        bench.send(lists(lengths, turn, invalid=generator.choice((0.0, 0.3, 1.0))), keep)
    await bench.board.finish(500_000)


@cocotb.test()
async def test_long_lists(dut):
    bench = Bench(dut)
    await bench.start()
    for lengths in ((4095, 0, 4095, 2), (4095, 0, 0, 0), (10, 10, 10, 3000), (0, 4095, 0, 0), (0, 0, 4095, 0)):
        bench.send(lists(lengths, lengths))
    await bench.board.finish()


@cocotb.test()
@cocotb.parametrize(keep=[0, 1])
async def test_a_beat_moves_each_cycle(dut, keep):
    bench = Bench(dut)
    await bench.start(keep)
    for lengths in ((0, 0, 0, 0), (1, 0, 0, 0), (100, 57, 3, 20), (0, 40, 0, 1), (17, 17, 17, 17), (0, 0, 5, 0)):
        for head in bench.heads:
            head.cycles.clear()
        bench.send(lists(lengths, lengths), keep)
        await bench.board.finish()
        taken = sorted({at for head in bench.heads for at in head.cycles})
        assert taken == list(range(taken[0], taken[0] + golden.cycles(sum(lengths))))
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
        for pair in PAIRS[1:]:
            valid = np.sort(np.concatenate([a[a < INVALID], b]))
            assert np.array_equal(golden.merge4(a, NONE, b, NONE), valid)
            bench.on(pair, a, b)
            bench.on(pair, b, a)
    bench.on((2, 3), words | INVALID, words[:0])
    bench.on((1, 2), words | INVALID, words | INVALID)
    bench.send([words | INVALID] * 4)
    await bench.board.finish()


@cocotb.test()
async def test_what_is_dropped_overtakes_the_other_list(dut):
    bench = Bench(dut)
    await bench.start()
    for pair in PAIRS[1:]:
        for head in bench.heads:
            head.cycles.clear()
        bench.on(pair, [5, 7], [9 | INVALID, 6])
        await bench.board.finish()
        one, two = (bench.heads[k].cycles for k in pair)
        assert two[0] < one[0] < two[1] < one[1], "dropped, 5, 6, 7"


@cocotb.test()
async def test_a_run_of_invalid_entries_waits_for_the_other_run(dut):
    bench = Bench(dut)
    await bench.start()
    bench.send([[5, 9 | INVALID], [7, 8], [6], [9]])
    await bench.board.finish()
    at = [head.cycles for head in bench.heads]
    assert [at[0][0], at[2][0], *at[1][:2], at[0][1], at[3][0]] == list(range(at[0][0], at[0][0] + 6))


@cocotb.test()
@stall_pairs
async def test_equal_keys_follow_the_index(dut, source_stall, sink_stall):
    bench = Bench(dut, source_stall, sink_stall)
    await bench.start()
    bench.send([(7 << 24) + np.arange(head, 160, 4) for head in (2, 0, 3, 1)])
    await bench.board.finish()


@cocotb.test()
@cocotb.parametrize(pair=[(one, two) for two in range(4) for one in range(two)])
async def test_the_first_list_wins_ties(dut, pair):
    bench = Bench(dut)
    await bench.start()
    bench.on(pair, [5, 5, 9], [5, 9, 9])
    await bench.board.finish()
    # of six entries, the first list's are taken first among equals
    a, b = (bench.heads[k].cycles for k in pair)
    order = sorted([(c, "a") for c in a] + [(c, "b") for c in b[:-1]])
    assert "".join(side for _, side in order) == "aababba"


@cocotb.test()
@cocotb.parametrize(keep=[0, 1], pair=[(one, two) for two in range(4) for one in range(two)])
async def test_every_bit_is_compared(dut, keep, pair):
    """Entries that differ in one bit only."""
    bench = Bench(dut)
    await bench.start(keep)
    generator = rng("bits", pair)
    for place in [*(1 << bit for bit in range(BUILD.entry_w - 1)), INVALID]:
        for _ in range(4):
            word = generator.getrandbits(BUILD.entry_w - 1)
            bench.on(pair, [word], [word ^ place], keep=keep)
            bench.on(pair, [word ^ place], [word], keep=keep)
    await bench.board.finish()


@cocotb.test()
async def test_reset_in_flight_forgets_everything(dut):
    bench = Bench(dut, sink_stall="random")
    await bench.start()
    for n in (1, 7, 20):
        for head, words in zip(bench.heads, lists((50, 50, 50, 50), n), strict=True):
            head.send(beats(words))
        for _ in range(rng(n).randint(5, 40)):
            await RisingEdge(dut.clk)
        dut.rst.value = 1
        for head in bench.heads:
            head.clear()
        await reset(dut)
        bench.out.clear()
        bench.board.expected.clear()
        bench.send(lists((30, 30, 3, 9), n))
        await bench.board.finish()
