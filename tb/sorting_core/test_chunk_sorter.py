"""gs_chunk_sorter alone: its list beat by beat. Lengths, late input and resets are those of test_sorting_core.py."""

import cocotb
import numpy as np

from golden.sorting_core import bitonic_sort_unit
from golden.sorting_core import chunk_sorter as golden
from tb.lib.stream import Monitor, Scoreboard, Sink, Source, reset, stall_pairs, start_clock
from tb.sorting_core import beats, entries

TOP = "gs_chunk_sorter"
SLOW = True
PARAMETERS = [{}, {"CHUNK": 64}, {"CHUNK": 512}, {"SORT_N": 16}]
LIST = ("entry", "last")
SORT, MERGE = 0, 1


class Bench:
    """Commands and lists in, lists out."""

    def __init__(self, dut, source_stall="none", sink_stall="none"):
        start_clock(dut)
        self.chunk, self.sort_n = int(dut.CHUNK.value), int(dut.SORT_N.value)
        self.steps = bitonic_sort_unit.steps(int(dut.NETWORK.value), self.sort_n)
        self.cmd = Source(dut, "cmd", ("merge", "first"), source_stall)
        self.a = Source(dut, "a", LIST, source_stall, "a")
        self.b = Source(dut, "b", LIST, source_stall, "b")
        self.out = Sink(dut, "out", LIST, sink_stall)
        Monitor(dut, "out", LIST)
        self.board = Scoreboard(self.out)

    def send(self, a, b, merge, first):
        self.cmd.send([(merge, first)])
        self.a.send(beats(a))
        self.b.send(beats(b))
        self.board.expect(beats(golden.merge(a, b) if merge else golden.sort(a, b, first, self.chunk)))

    def sent(self, a, b, first):
        """Cycles of the beats of a SORT that cycle 0 accepts, everything offered from there on."""
        state = golden.new_state()
        a_time, b_time = np.zeros(len(a) + 1, np.int64), np.zeros(len(b) + 1, np.int64)
        merged, times = np.empty(len(a) + len(b), np.int64), np.empty(len(a) + len(b) + 1, np.int64)
        words, length = golden.sort_chunks(a, first, self.chunk), first
        lists, out = (words, b, a_time.copy(), b_time.copy()), (a_time, b_time, merged, times)
        while golden.step(state, *lists, length, self.steps, *out, self.sort_n):
            length = self.chunk
        return times[: state[golden.SENT]] + 1


@cocotb.test()
@stall_pairs
async def test_lists_pass_under_stalls(dut, source_stall, sink_stall):
    bench = Bench(dut, source_stall, sink_stall)
    await reset(dut)
    for merge, n_a, n_b in ((SORT, 0, 0), (SORT, 300, 9), (MERGE, 40, 50), (SORT, 128, 0), (SORT, 3, 90)):
        a, b = entries(n_a, invalid=0.1), np.sort(entries(n_b, "b", invalid=0.1))
        bench.send(np.sort(a) if merge else a, b, merge, bench.chunk // 2)
    await bench.board.finish(quiet_cycles=100)


@cocotb.test()
@cocotb.parametrize(part=[1, 2])
async def test_cycles_of_the_beats(dut, part):
    bench = Bench(dut)
    first = bench.chunk // part
    await reset(dut)
    run, chunk = bench.sort_n, bench.chunk
    lengths = [n + more for n in (*range(run, chunk + 1, run), 2 * chunk) for more in (-1, 0, 1)]
    for n_a, n_b in ((0, 0), (1, 0), (17, 3), (129, 40), (500, 300), *((n, n % 7) for n in lengths)):
        a, b = entries(n_a, first, invalid=0.1), np.sort(entries(n_b, first, "b", invalid=0.1))
        bench.out.clear()
        bench.cmd.cycles.clear()
        bench.board.expected.clear()
        bench.send(a, b, SORT, first)
        await bench.board.finish()
        want = bench.sent(a, b, first)
        assert [c - bench.cmd.cycles[0] for c in bench.out.cycles] == want.tolist()
