"""gs_axi_record_reader: each index brings its record, in order, one every RECORD_BEATS cycles."""

import cocotb
import numpy as np

from golden import dma, params
from golden.formats import BUILD
from tb.lib.axi import AxiMemory, Everywhere
from tb.lib.stream import Monitor, Scoreboard, Sink, Source, reset, rng, stall_pairs, start_clock

TOP = "gs_axi_record_reader"
SLOW = True
BASE = 0x1238
COUNT = 2000
WHOLE = BUILD.record_bytes // dma.BEAT


def record(memory: bytearray, index: int) -> int:
    at = BASE + BUILD.record_bytes * index
    return int.from_bytes(memory[at : at + BUILD.record_bytes], "little")


async def bench(dut, source_stall="none", sink_stall="none", read=40):
    start_clock(dut)
    random = rng("record", source_stall, sink_stall)
    memory = bytearray(random.randbytes(BASE + BUILD.record_bytes * COUNT + 64))
    port = AxiMemory(dut, "m_axi", memory, read=read, stall=source_stall, seed=sink_stall)
    dut.cfg_addr.value = BASE
    source = Source(dut, "idx", ("index",), stall=source_stall)
    sink = Sink(dut, "rec", ("record",), stall=sink_stall)
    Monitor(dut, "rec", ("record",))
    await reset(dut)
    return random, memory, port, source, sink


def border() -> list[int]:
    """Indices whose record needs two bursts."""
    return [i for i in range(COUNT) if dma.record_head(i, BUILD.record_bytes, BASE) < WHOLE]


@cocotb.test()
@stall_pairs
async def test_every_index_brings_its_record(dut, source_stall, sink_stall):
    random, memory, port, source, sink = await bench(dut, source_stall, sink_stall)
    board = Scoreboard(sink)
    for _ in range(3):
        indices = [random.randrange(COUNT) for _ in range(80)] + border() + [0, 1, 2, 3, COUNT - 1]
        source.send([(i,) for i in indices])
        board.expect([(record(memory, i),) for i in indices])
        await source.drained()
    await board.finish()
    assert port.idle() and dut.error.value == 0 and len(border()) >= 5


@cocotb.test()
async def test_addresses_of_32_and_indices_of_24_bits(dut):
    random, _, port, source, sink = await bench(dut)
    port.memory = memory = Everywhere()
    board = Scoreboard(sink)
    size, bursts = BUILD.record_bytes, 0
    for _ in range(12):
        base = 8 * random.randrange((len(memory) - (size << params.INDEX_W)) // 8)
        dut.cfg_addr.value = base
        indices = [random.getrandbits(params.INDEX_W) for _ in range(80)] + [0, (1 << params.INDEX_W) - 1]
        bursts += sum(1 + (dma.record_head(i, size, base) < WHOLE) for i in indices)
        source.send([(i,) for i in indices])
        board.expect([(int.from_bytes(memory[base + size * i : base + size * (i + 1)], "little"),) for i in indices])
        await source.drained()
    await board.finish()
    assert len(port.ar) == bursts


@cocotb.test()
@cocotb.parametrize(read=[1, 40])
async def test_cycles_equal_golden(dut, read):
    random, _, _, source, sink = await bench(dut, read=read)
    indices = [random.randrange(COUNT) for _ in range(100)] + border()[:4] + [5] + border()[4:5] + [7, 8]
    source.send([(i,) for i in indices])
    await sink.wait(len(indices))
    heads = np.array([dma.record_head(index, BUILD.record_bytes, BASE) for index in indices])
    taken = source.cycles[0] + np.concatenate([[0], np.cumsum(1 + (heads < WHOLE))])
    done = dma.record_arrivals(taken[:-1] + 1, heads, WHOLE, dma.FEATURE, dma.new_ports(), dma.Latency(read=read))
    assert source.cycles == taken[:-1].tolist() and sink.cycles == done.tolist()


@cocotb.test()
async def test_reset_in_flight_forgets_all_records(dut):
    random, memory, _, source, sink = await bench(dut, "random", "random")
    source.send([(random.randrange(COUNT),) for _ in range(200)])
    await sink.wait(31)
    dut.rst.value = 1
    source.clear()
    await reset(dut)
    source.clear()
    sink.clear()
    source.send([(9,), (11,)])
    board = Scoreboard(sink)
    board.expect([(record(memory, 9),), (record(memory, 11),)])
    await board.finish()


@cocotb.test()
async def test_an_error_answer_is_kept(dut):
    _, _, port, source, sink = await bench(dut)
    port.answer["r"] = 3
    source.send([(1,)])
    await sink.wait(1)
    port.answer["r"] = 0
    source.send([(2,)])
    await sink.wait(2)
    assert dut.error.value == 1
