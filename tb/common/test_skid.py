"""gs_skid: nothing lost, nothing reordered, two beats deep, latency one."""

import cocotb
from cocotb.triggers import RisingEdge

from tb.lib.stream import Monitor, Scoreboard, Sink, Source, reset, rng, stall_pairs, start_clock

TOP = "gs_skid"
PARAMETERS = [{"WIDTH": 1}, {"WIDTH": 48}]


def values(dut, n: int, *names: object) -> list[tuple[int]]:
    generator = rng("skid", *names)
    return [(generator.getrandbits(len(dut.in_data)),) for _ in range(n)]


async def bench(dut, source_stall: str = "none", sink_stall: str = "none") -> tuple[Source, Sink]:
    start_clock(dut)
    source = Source(dut, "in", stall=source_stall)
    sink = Sink(dut, "out", stall=sink_stall)
    Monitor(dut, "in")
    Monitor(dut, "out")
    await reset(dut)
    return source, sink


@cocotb.test()
@stall_pairs
async def test_every_beat_arrives_once_and_in_order(dut, source_stall, sink_stall):
    source, sink = await bench(dut, source_stall, sink_stall)
    board = Scoreboard(sink)
    for burst in range(3):
        beats = values(dut, 100, burst)
        source.send(beats)
        board.expect(beats)
        await source.drained()
    await board.finish()


@cocotb.test()
async def test_latency_is_one_and_a_beat_moves_each_cycle(dut):
    source, sink = await bench(dut)
    source.send(values(dut, 50))
    await sink.wait(50)
    assert source.cycles == list(range(source.cycles[0], source.cycles[0] + 50))
    assert sink.cycles == [c + 1 for c in source.cycles]


@cocotb.test()
async def test_two_beats_fit_under_a_stall_and_ready_is_a_register(dut):
    start_clock(dut)
    source = Source(dut, "in")
    dut.out_ready.value = 0
    await reset(dut)
    source.send(values(dut, 5))
    for _ in range(10):
        await RisingEdge(dut.clk)
    assert len(source.cycles) == 2 and dut.in_ready.value == 0
    dut.out_ready.value = 1
    for before, after in ((0, 0), (0, 1)):
        assert dut.in_ready.value == before  # out_ready has been high, yet only the edge shows it
        await RisingEdge(dut.clk)
        assert dut.in_ready.value == after
    await source.drained()


@cocotb.test()
async def test_reset_in_flight_forgets_both_beats(dut):
    source, sink = await bench(dut, sink_stall="burst")
    source.send(values(dut, 30))
    await sink.wait(7)
    dut.rst.value = 1
    source.clear()
    await reset(dut)
    sink.clear()
    beats = values(dut, 3, "after")
    source.send(beats)
    board = Scoreboard(sink)
    board.expect(beats)
    await board.finish()


@cocotb.test()
async def test_one_cycle_of_reset_is_enough(dut):
    start_clock(dut)
    source = Source(dut, "in")
    dut.out_ready.value = 0
    await reset(dut)
    source.send(values(dut, 2))
    await source.drained()
    await reset(dut, cycles=1)
    assert dut.out_valid.value == 0 and dut.in_ready.value == 1
