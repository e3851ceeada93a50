"""gs_intersection_test_unit: hit from the lowest to the highest column, both included, and only while live."""

import cocotb
from cocotb.triggers import RisingEdge

from golden.formats import BUILD
from golden.raster_core import intersection_test_unit as itu
from tb.lib.stream import rng, start_clock

TOP = "gs_intersection_test_unit"
SLOW = True
COLUMN_END = 1 << (BUILD.edge_f + 6)
END = 1 << (BUILD.edge_f + 8)  # SQ8


async def check(dut, beats) -> list[int]:
    """beats of (column, low, high, live): the hits, equal to golden's."""
    start_clock(dut)
    edge = RisingEdge(dut.clk)
    found = []
    for cycle, beat in enumerate([*beats, *[(0, 0, 0, 0)] * itu.UNIT_LATENCY]):
        column, low, high, live = beat
        dut.in_column.value, dut.in_live.value = column, live
        dut.in_low.value, dut.in_high.value = low & (2 * END - 1), high & (2 * END - 1)
        await edge
        if cycle >= itu.UNIT_LATENCY:
            found.append(int(dut.out_hit.value))
    assert found == [int(live and itu.hit(column, low, high)) for column, low, high, live in beats]
    return found


@cocotb.test()
async def test_both_ends_are_inside(dut):
    generator = rng("ends")
    beats = []
    for column in (0, 1, COLUMN_END - 1, *(generator.randrange(COLUMN_END) for _ in range(500))):
        for low in (-END, column - 1, column, column + 1):
            for high in (column - 1, column, column + 1, END - 1):
                beats.append((column, low, high, 1))
    hits = await check(dut, beats)
    assert 0 < sum(hits) < len(hits)


@cocotb.test()
async def test_anything(dut):
    generator = rng("anything")

    def end() -> int:
        code = generator.randrange(-END, END)
        return generator.choice((-END, END - 1, code, code >> 3))

    beats = [(generator.randrange(COLUMN_END), end(), end(), generator.getrandbits(1)) for _ in range(4000)]
    hits = await check(dut, beats)
    assert 100 < sum(hits) < len(hits) - 100
