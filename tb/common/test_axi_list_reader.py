"""gs_axi_list_reader: every table of any length at any place comes as a list, an entry a cycle."""

import cocotb
import numpy as np

from golden import dma, records
from golden.formats import BUILD
from golden.records import entries_of, hardware
from tb.lib.axi import AxiMemory, Everywhere
from tb.lib.stream import Monitor, Scoreboard, Sink, Source, reset, rng, stall_pairs, start_clock

TOP = "gs_axi_list_reader"
SLOW = True
LENGTHS = (0, 1, 2, 3, 4, 5, 0, 0, 255, 256, 257, 341, 342, 700, 1)
SIZE = 1 << 16


def tables(*names) -> tuple[bytearray, list[tuple[int, np.ndarray]]]:
    """A memory of noise with tables of LENGTHS in it, some of them just before a border."""
    random = np.random.default_rng(rng(*names).getrandbits(32))
    memory = bytearray(random.integers(0, 256, SIZE, np.uint8).tobytes())
    result, at = [], 4096 - 64
    for n in LENGTHS:
        words = entries_of(BUILD, random.integers(0, 1 << BUILD.entry_w, n))
        data = records.entry_bytes(BUILD, words).tobytes()
        memory[at : at + len(data)] = data
        result.append((at, words))
        at += -(-len(data) // 64) * 64 + 64 * int(random.integers(0, 3))
        if random.random() < 0.3:
            at = (at | 4095) + 1 - 8 * int(random.integers(0, 4))
    assert at < SIZE
    return memory, result


async def bench(dut, source_stall="none", sink_stall="none", read=40):
    start_clock(dut)
    memory, result = tables("list", source_stall, sink_stall)
    port = AxiMemory(dut, "m_axi", memory, read=read, stall=source_stall, seed=sink_stall)
    cmd = Source(dut, "cmd", ("addr", "n"), stall=source_stall)
    sink = Sink(dut, "list", ("entry", "last"), stall=sink_stall)
    Monitor(dut, "list", ("entry", "last"))
    await reset(dut)
    return port, result, cmd, sink


def beats(words) -> list[tuple]:
    return [(int(w), 0) for w in words] + [(None, 1)]


@cocotb.test()
@stall_pairs
async def test_every_table_comes_as_a_list(dut, source_stall, sink_stall):
    port, result, cmd, sink = await bench(dut, source_stall, sink_stall)
    board = Scoreboard(sink)
    for at, words in result:
        cmd.send([(at, len(words))])
        board.expect(beats(hardware(BUILD, words)))
    await board.finish()
    assert port.idle() and dut.error.value == 0
    assert sum(count for _, _, count in port.ar) == sum(dma.beats(len(words), BUILD.entry_bytes) for _, words in result)


@cocotb.test()
async def test_addresses_of_32_bits(dut):
    port, _, cmd, sink = await bench(dut)
    port.memory = memory = Everywhere()
    random, board, size = rng("everywhere"), Scoreboard(sink), BUILD.entry_bytes
    for _ in range(60):
        at, n = 8 * random.randrange((len(memory) >> 3) - 300), random.choice((1, 2, 5, 300))
        cmd.send([(at, n)])
        board.expect(beats(int.from_bytes(memory[a : a + size], "little") for a in range(at, at + n * size, size)))
    await board.finish()


@cocotb.test()
@cocotb.parametrize(read=[1, 2, 40])
async def test_cycles_equal_golden(dut, read):
    _, result, cmd, sink = await bench(dut, read=read)
    for at, words in result:
        sink.clear()
        cmd.send([(at, len(words))])
        await sink.wait(len(words) + 1)
        latency = dma.Latency(read=read)
        want = dma.list_arrival(cmd.cycles[-1], len(words), BUILD.entry_bytes, at, dma.TABLE, dma.new_ports(), latency)
        assert sink.cycles == want.tolist()


@cocotb.test()
async def test_the_next_command_is_taken_behind_the_end_beat(dut):
    _, result, cmd, sink = await bench(dut)
    cmd.send([(at, len(words)) for at, words in result])
    await sink.wait(sum(len(words) + 1 for _, words in result))
    ends = [t for t, beat in zip(sink.cycles, sink.beats, strict=True) if beat[1]]
    assert cmd.cycles[1:] == [dma.list_next(end) for end in ends[:-1]]


@cocotb.test()
async def test_addresses_do_not_wait_for_data(dut):
    port, result, cmd, sink = await bench(dut, read=500)
    at, words = result[13]  # three bursts or more
    cmd.send([(at, len(words))])
    await sink.wait(len(words) + 1)
    first = cmd.cycles[0] + 1
    assert len(port.ar) >= 3 and [t for t, _, _ in port.ar] == list(range(first, first + len(port.ar)))


@cocotb.test()
async def test_reset_in_flight_forgets_the_table(dut):
    port, result, cmd, sink = await bench(dut, "random", "random")
    cmd.send([(at, len(words)) for at, words in result])
    await sink.wait(300)
    dut.rst.value = 1
    cmd.clear()
    await reset(dut)
    sink.clear()
    cmd.clear()
    at, words = result[4]
    cmd.send([(at, len(words))])
    board = Scoreboard(sink)
    board.expect(beats(hardware(BUILD, words)))
    await board.finish()
    assert port.idle()


@cocotb.test()
async def test_an_error_answer_is_kept(dut):
    port, result, cmd, sink = await bench(dut)
    port.answer["r"] = 2
    cmd.send([(result[1][0], 1)])
    await sink.wait(2)
    port.answer["r"] = 0
    cmd.send([(result[2][0], 2)])
    await sink.wait(5)
    assert dut.error.value == 1
    await reset(dut)
    assert dut.error.value == 0
