"""gs_axi_block_writer: lists land packed in memory, an entry a cycle, and done waits for every B."""

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden import dma, records
from golden.formats import BUILD
from golden.records import entries_of, hardware
from tb.lib.axi import AxiMemory, Everywhere
from tb.lib.stream import Monitor, Scoreboard, Sink, Source, reset, rng, stall_pairs, start_clock

TOP = "gs_axi_block_writer"
SLOW = True
PARAMETERS = [{"DONES": 8}, {"DONES": 2}]
LENGTHS = (0, 1, 2, 3, 4, 0, 0, 5, 1, 1, 255, 256, 1, 257, 512, 0, 700, 2, 0, 3, 7, 1030)
SIZE = 1 << 16
FIELDS = ("entry", "len", "last")


def blocks(words) -> list[tuple]:
    """Beats of the block stream of a list."""
    n = len(words)
    result = []
    for k in range(n // 256 + 1):
        part = words[256 * k : 256 * k + 256]
        result += [(int(w), len(part), int(k == n // 256)) for w in part] or [(None, 0, 1)]
    return result


def lists(*names, lengths=LENGTHS):
    """(address, entries) for every length; the regions do not touch."""
    random = np.random.default_rng(rng(*names).getrandbits(32))
    result, at = [], 64
    for n in lengths:
        result.append((at, entries_of(BUILD, random.integers(0, 1 << BUILD.entry_w, n))))
        at += -(-BUILD.entry_bytes * n // 64) * 64 + 64
    assert at < SIZE
    return result


async def bench(dut, source_stall="none", sink_stall="none", write=20):
    start_clock(dut)
    memory = bytearray(b"\xa5" * SIZE)
    port = AxiMemory(dut, "m_axi", memory, write=write, stall=sink_stall, seed=source_stall)
    cmd = Source(dut, "cmd", ("addr",), stall=source_stall)
    source = Source(dut, "blk", FIELDS, stall=source_stall)
    sink = Sink(dut, "done", ("n",), stall=sink_stall)
    Monitor(dut, "done", ("n",))
    await reset(dut)
    return port, memory, cmd, source, sink


def image(items) -> bytearray:
    """What the memory should hold: tables padded with zeros to whole beats, everything else untouched."""
    memory = bytearray(b"\xa5" * SIZE)
    for at, words in items:
        size = 8 * dma.beats(len(words), BUILD.entry_bytes)
        memory[at : at + size] = bytes(size)
        memory[at : at + BUILD.entry_bytes * len(words)] = records.entry_bytes(BUILD, words).tobytes()
    return memory


def done(taken, at: int, n: int, write: int) -> int:
    """Cycle of the done of a list of n entries at an address, whose beats are taken in these cycles."""
    ports = dma.new_ports()
    for first in range(0, n, 256):
        place = at + BUILD.entry_bytes * first
        size = min(256, n - first)
        dma.write_block(taken[first], size, BUILD.entry_bytes, place, dma.PIXEL, ports, dma.Latency(write=write))
    return dma.written(taken[-1], dma.PIXEL, ports)


@cocotb.test()
@stall_pairs
async def test_every_list_lands_in_its_place(dut, source_stall, sink_stall):
    port, memory, cmd, source, sink = await bench(dut, source_stall, sink_stall)
    items = lists("block", source_stall, sink_stall)
    board = Scoreboard(sink)
    for at, words in items:
        cmd.send([(at,)])
        source.send(blocks(hardware(BUILD, words)))
        board.expect([(len(words),)])
    await board.finish()
    assert port.idle() and memory == image(items) and dut.error.value == 0


@cocotb.test()
async def test_addresses_of_32_bits(dut):
    port, _, cmd, source, sink = await bench(dut)
    port.memory = memory = Everywhere()
    random, board, want = rng("everywhere"), Scoreboard(sink), {}
    for _, words in lists("everywhere", lengths=[random.choice((1, 2, 5, 300)) for _ in range(60)]):
        at = 8 * random.randrange((len(memory) >> 3) - 300)
        data = records.entry_bytes(BUILD, words).tobytes()
        want |= enumerate(data.ljust(8 * dma.beats(len(words), BUILD.entry_bytes), b"\0"), at)
        cmd.send([(at,)])
        source.send(blocks(hardware(BUILD, words)))
        board.expect([(len(words),)])
    await board.finish()
    assert memory.written == want


@cocotb.test()
async def test_an_entry_a_cycle_across_blocks_and_lists(dut):
    _port, memory, cmd, source, sink = await bench(dut)
    items = lists("stream", lengths=(700, 256, 1, 2, 3, 4, 1030, 1, 1))
    for at, words in items:
        cmd.send([(at,)])
        source.send(blocks(hardware(BUILD, words)))
    await sink.wait(len(items))
    if int(dut.DONES.value) >= 8:  # fewer would have to wait for their responses
        assert source.cycles == list(range(source.cycles[0], source.cycles[0] + len(source.cycles)))
    assert memory == image(items)


@cocotb.test()
@cocotb.parametrize(write=[1, 20])
async def test_cycles_equal_golden(dut, write):
    _port, _memory, cmd, source, sink = await bench(dut, write=write)
    for k, (at, words) in enumerate(lists("cycles")):
        cmd.send([(at,)])
        source.send(blocks(hardware(BUILD, words)))
        await sink.wait(k + 1)
        taken = source.cycles[-len(blocks(words)) :]
        assert taken[-1] - taken[0] == len(taken) - 1
        assert sink.cycles[-1] == done(taken, at, len(words), write), len(words)


@cocotb.test()
async def test_a_late_end_waits_for_nothing(dut):
    _port, _memory, cmd, source, sink = await bench(dut)
    cmd.send([(64,)])
    beats = blocks(range(256))
    source.send(beats[:-1])
    await source.drained()
    for _ in range(50):
        await RisingEdge(dut.clk)
    source.send(beats[-1:])
    await sink.wait(1)
    assert sink.cycles == [done(source.cycles, 64, 256, 20)]


@cocotb.test()
async def test_done_waits_for_the_last_response(dut):
    port, _memory, cmd, source, sink = await bench(dut, write=300)
    items = lists("responses", lengths=(3, 512, 0, 9))
    for at, words in items:
        cmd.send([(at,)])
        source.send(blocks(hardware(BUILD, words)))
    await sink.wait(len(items))
    assert len(port.b) == len(port.aw) and [beat for (beat,) in sink.beats] == [3, 512, 0, 9]
    bursts = [address for _, address, _ in port.aw]
    ends = [sum(address <= at + BUILD.entry_bytes * len(w) for address in bursts) for at, w in items]
    for cycle, count in zip(sink.cycles, ends, strict=True):
        assert cycle > (port.b[count - 1] if count else 0)


@cocotb.test()
async def test_reset_in_flight_forgets_the_list(dut):
    _port, memory, cmd, source, sink = await bench(dut, "random", "random")
    for at, words in lists("before"):
        cmd.send([(at,)])
        source.send(blocks(hardware(BUILD, words)))
    while len(source.cycles) < 300:
        await RisingEdge(dut.clk)
    dut.rst.value = 1
    await RisingEdge(dut.clk)
    cmd.clear()
    source.clear()
    await reset(dut)
    cmd.clear()
    source.clear()
    sink.clear()
    memory[:] = b"\xa5" * SIZE
    items = lists("after", lengths=(5, 300))
    board = Scoreboard(sink)
    for at, words in items:
        cmd.send([(at,)])
        source.send(blocks(hardware(BUILD, words)))
        board.expect([(len(words),)])
    await board.finish()
    assert memory == image(items)


@cocotb.test()
async def test_an_error_answer_is_kept(dut):
    port, _memory, cmd, source, sink = await bench(dut)
    port.answer["b"] = 2
    for at, words in lists("error", lengths=(4, 4)):
        cmd.send([(at,)])
        source.send(blocks(hardware(BUILD, words)))
        await sink.wait(1)
        port.answer["b"] = 0
    await sink.wait(2)
    assert dut.error.value == 1
