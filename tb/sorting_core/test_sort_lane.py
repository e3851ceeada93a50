"""gs_sort_lane: a tile's table is sorted from memory to memory, in golden's cycles."""

import cocotb
import numpy as np

from golden import dma, records
from golden.formats import BUILD
from golden.sorting_core import sort_lane, sort_sequencer
from tb.lib.axi import AxiMemory
from tb.lib.stream import Sink, Source, reset, rng, start_clock

TOP = "gs_sort_lane"
SLOW = True
JOB = ("table_addr", "table_n", "in_addr", "in_n", "scratch_addr", "out_addr", "first")
SIZE = 1 << 17
REGION = SIZE // 4
INCOMING = (0, 1, 255, 256, 257, 700, 1500)


def region(memory: bytearray, number: int, n: int) -> np.ndarray:
    part = memory[number * REGION : number * REGION + BUILD.entry_bytes * n]
    return records.entries_from_bytes(BUILD, np.frombuffer(bytes(part), np.uint8))


async def bench(dut, latency=dma.LATENCY, stall="none"):
    start_clock(dut)
    memory = bytearray(SIZE)
    ports = [AxiMemory(dut, f"m_axi_{p}", memory, latency.read, latency.write, stall=stall, seed=p) for p in "ab"]
    job = Source(dut, "job", JOB, stall=stall)
    done = Sink(dut, "done", ("n",), stall=stall)
    await reset(dut)
    return memory, ports, job, done


async def sort(dut, memory, job, done, table, incoming, first):
    """One job; returns (its cycles, the new table)."""
    memory[:] = bytes(SIZE)
    for number, words in ((0, table), (1, incoming)):
        data = records.entry_bytes(BUILD, words).tobytes()
        memory[number * REGION : number * REGION + len(data)] = data
    count = len(done.beats)
    job.send([(0, len(table), REGION, len(incoming), 2 * REGION, 3 * REGION, first)])
    await done.wait(count + 1)
    return done.cycles[-1] - job.cycles[-1], region(memory, 3, done.beats[-1][0])


def lists(random, table_n: int, in_n: int) -> tuple[np.ndarray, np.ndarray]:
    """A disordered table with invalid entries, and incoming entries; keys repeat."""
    words = records.entries(random.integers(0, 400, table_n + in_n), random.permutation(table_n + in_n))
    words[:table_n] |= np.where(random.random(table_n) < 0.3, records.INVALID, 0)
    return words[:table_n], words[table_n:]


@cocotb.test()
@cocotb.parametrize(in_n=INCOMING, latency=[dma.LATENCY, dma.Latency(3, 1)])
async def test_tables_and_cycles_equal_golden(dut, in_n, latency):
    random = np.random.default_rng(rng("lane", in_n).getrandbits(32))
    memory, ports, job, done = await bench(dut, latency)
    for table_n, first in ((0, 256), (1, 128), (300, 128), (1000, 256)):
        table, incoming = lists(random, table_n, in_n)
        cycles, got = await sort(dut, memory, job, done, table, incoming, first)
        want_cycles, want = sort_lane.job(BUILD, table, incoming, first, latency)
        assert np.array_equal(want, sort_sequencer.sort(table, incoming, first))
        assert np.array_equal(got, want)
        assert cycles == want_cycles, (table_n, in_n)
    assert all(port.idle() for port in ports)


@cocotb.test()
@cocotb.parametrize(stall=["random", "burst", "three_of_four"])
async def test_stalls_change_no_entry(dut, stall):
    random = np.random.default_rng(rng("stall", stall).getrandbits(32))
    memory, _, job, done = await bench(dut, stall=stall)
    for table_n, in_n in ((700, 300), (0, 0), (256, 512), (0, 600), (513, 0)):
        table, incoming = lists(random, table_n, in_n)
        _, got = await sort(dut, memory, job, done, table, incoming, 128)
        assert np.array_equal(got, sort_sequencer.sort(table, incoming, 128))


@cocotb.test()
async def test_a_table_of_invalid_entries_becomes_empty(dut):
    memory, _, job, done = await bench(dut)
    table = np.arange(300) | records.INVALID
    cycles, got = await sort(dut, memory, job, done, table, np.zeros(0, np.int64), 256)
    assert len(got) == 0 and cycles == sort_lane.job(BUILD, table, np.zeros(0, np.int64))[0]


@cocotb.test()
async def test_an_empty_job_touches_no_memory(dut):
    memory, ports, job, done = await bench(dut)
    empty = np.zeros(0, np.int64)
    cycles, _ = await sort(dut, memory, job, done, empty, empty, 256)
    assert cycles == sort_sequencer.EMPTY and done.beats == [(0,)]
    assert not any(port.ar or port.aw for port in ports)
