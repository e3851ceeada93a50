"""gs_fifo: order kept, latency two, DEPTH + 1 beats deep."""

import cocotb
from cocotb.triggers import RisingEdge

from tb.lib.stream import Monitor, Scoreboard, Sink, Source, reset, rng, stall_pairs, start_clock

TOP = "gs_fifo"
PARAMETERS = [{"WIDTH": 48, "DEPTH": 8}, {"WIDTH": 1, "DEPTH": 2}]


async def bench(dut, source_stall="none", sink_stall="none"):
    start_clock(dut)
    source = Source(dut, "in", stall=source_stall)
    sink = Sink(dut, "out", stall=sink_stall)
    Monitor(dut, "out")
    await reset(dut)
    random = rng("fifo", source_stall, sink_stall)
    return source, sink, [(random.getrandbits(len(dut.in_data)),) for _ in range(200)]


@cocotb.test()
@stall_pairs
async def test_every_beat_arrives_once_and_in_order(dut, source_stall, sink_stall):
    source, sink, beats = await bench(dut, source_stall, sink_stall)
    board = Scoreboard(sink)
    for part in (beats[:3], beats[3:]):
        source.send(part)
        board.expect(part)
        await source.drained()
    await board.finish()


@cocotb.test()
async def test_latency_is_two_and_a_beat_moves_each_cycle(dut):
    source, sink, beats = await bench(dut)
    source.send(beats)
    await sink.wait(len(beats))
    assert source.cycles == list(range(source.cycles[0], source.cycles[0] + len(beats)))
    assert sink.cycles == [c + 2 for c in source.cycles]


@cocotb.test()
async def test_one_beat_more_than_its_depth_fits(dut):
    start_clock(dut)
    source = Source(dut, "in")
    dut.out_ready.value = 0
    await reset(dut)
    source.send([(k & 1,) for k in range(40)])
    for _ in range(40):
        await RisingEdge(dut.clk)
    assert len(source.cycles) == int(dut.DEPTH.value) + 1 and dut.in_ready.value == 0


@cocotb.test()
async def test_reset_in_flight_empties_it(dut):
    source, sink, beats = await bench(dut, sink_stall="burst")
    source.send(beats)
    await sink.wait(20)
    dut.rst.value = 1
    source.clear()
    await reset(dut)
    source.clear()
    sink.clear()
    source.send(beats[:5])
    board = Scoreboard(sink)
    board.expect(beats[:5])
    await board.finish()
