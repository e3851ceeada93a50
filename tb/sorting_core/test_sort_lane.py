"""gs_sort_lane: a tile's table is sorted from memory to memory, in golden's cycles."""

import cocotb
import numpy as np

from golden import dma, params, records
from golden.formats import BUILD
from golden.sorting_core import sort_lane, sort_sequencer
from tb.lib.axi import AxiMemory, Everywhere
from tb.lib.stream import Sink, Source, reset, rng, start_clock

TOP = "gs_sort_lane"
SLOW = True
JOB = ("table_addr", "table_n", "in_addr", "in_n", "scratch_addr", "out_addr", "first")
SIZE = 1 << 17
REGIONS = tuple(range(0, SIZE, SIZE // 4))  # table, incoming, scratch, out
EMPTY = np.zeros(0, np.int64)
INCOMING = (0, 1, 255, 256, 257, 700, 1500)


async def bench(dut, latency=dma.LATENCY, stall="none", memory=None):
    start_clock(dut)
    memory = memory or bytearray(SIZE)
    ports = [AxiMemory(dut, f"m_axi_{p}", memory, latency.read, latency.write, stall=stall, seed=p) for p in "ab"]
    job = Source(dut, "job", JOB, stall=stall)
    done = Sink(dut, "done", ("n",), stall=stall)
    await reset(dut)
    return memory, ports, job, done


async def sort(memory, job, done, table, incoming, first, at=REGIONS):
    """One job; returns (its cycles, the new table)."""
    for begin, words in zip(at, (table, incoming), strict=False):
        for k, byte in enumerate(records.entry_bytes(BUILD, words).tobytes()):
            memory[begin + k] = byte
    count = len(done.beats)
    job.send([(at[0], len(table), at[1], len(incoming), *at[2:], first)])
    await done.wait(count + 1)
    size = BUILD.entry_bytes * done.beats[-1][0]
    got = np.frombuffer(bytes(memory[at[3] : at[3] + size]), np.uint8)
    return done.cycles[-1] - job.cycles[-1], records.entries_from_bytes(BUILD, got)


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
    for table_n, first in ((0, 256), (1, 128), (300, 200), (1000, 37)):
        table, incoming = lists(random, table_n, in_n)
        cycles, got = await sort(memory, job, done, table, incoming, first)
        want_cycles, want = sort_lane.job(BUILD, table, incoming, first, latency)
        assert np.array_equal(want, sort_sequencer.sort(table, incoming, first))
        assert np.array_equal(got, want)
        assert cycles == want_cycles, (table_n, in_n)
        assert dut.error.value == 0
    assert all(port.idle() for port in ports)


@cocotb.test()
@cocotb.parametrize(stall=["random", "burst", "three_of_four"])
async def test_stalls_change_no_entry(dut, stall):
    random = np.random.default_rng(rng("stall", stall).getrandbits(32))
    memory, _, job, done = await bench(dut, stall=stall)
    for table_n, in_n in ((700, 300), (0, 0), (256, 512), (0, 600), (513, 0)):
        table, incoming = lists(random, table_n, in_n)
        _, got = await sort(memory, job, done, table, incoming, 128)
        assert np.array_equal(got, sort_sequencer.sort(table, incoming, 128))


@cocotb.test()
async def test_long_lists_anywhere_in_memory(dut):
    generator = rng("anywhere")
    random = np.random.default_rng(generator.getrandbits(32))
    memory, _, job, done = await bench(dut, memory=Everywhere())
    for table_n, in_n in ((300, 260), (20, 700), (13000, 0), (600, 300)):
        table, incoming = lists(random, table_n, in_n)
        at = [region << 30 | 8 * generator.randrange((1 << 27) - (1 << 14)) for region in generator.sample(range(4), 4)]
        cycles, got = await sort(memory, job, done, table, incoming, 256, at)
        job_of = table, incoming, BUILD.entry_bytes, np.array([256]), np.array(at), 0
        want_cycles, want = sort_lane.run_job(*job_of, dma.LATENCY, dma.new_ports(), params.CHUNK)
        assert np.array_equal(got, want) and cycles == want_cycles


@cocotb.test()
@cocotb.parametrize(failing=[(0, "r"), (1, "r"), (0, "b")])
async def test_an_error_of_a_memory_is_told_and_stays(dut, failing):
    memory, ports, job, done = await bench(dut)
    table, incoming = lists(np.random.default_rng(1), 40, 30)
    port, channel = failing
    for answer in (2, 0):
        ports[port].answer[channel] = answer
        await sort(memory, job, done, table, incoming, 256)
        assert dut.error.value == 1


@cocotb.test()
async def test_a_table_of_invalid_entries_becomes_empty(dut):
    memory, _, job, done = await bench(dut)
    table = np.arange(300) | records.INVALID
    cycles, got = await sort(memory, job, done, table, EMPTY, 256)
    assert len(got) == 0 and cycles == sort_lane.job(BUILD, table, EMPTY)[0]


@cocotb.test()
async def test_an_empty_job_touches_no_memory(dut):
    memory, ports, job, done = await bench(dut)
    cycles, _ = await sort(memory, job, done, EMPTY, EMPTY, 256)
    assert cycles == sort_sequencer.EMPTY and done.beats == [(0,)]
    assert not any(port.ar or port.aw for port in ports)
