"""gs_exp2_unit: every code of p, one a cycle; of formats with very many, evenly spread ones."""

import cocotb
from cocotb.triggers import RisingEdge

from golden.formats import BUILD
from golden.raster_core import exp2_unit
from tb.lib.stream import rng, start_clock

TOP = "gs_exp2_unit"
SLOW = True


async def run(dut, codes: list[int]) -> list[int]:
    """Results of codes offered one a cycle, taken LATENCY edges behind each."""
    start_clock(dut)
    edge = RisingEdge(dut.clk)
    results = []
    for cycle, p in enumerate([*codes, *[0] * exp2_unit.LATENCY]):
        dut.in_p.value = p
        await edge
        if cycle >= exp2_unit.LATENCY:
            results.append(int(dut.out_alpha.value))
    return results


@cocotb.test()
async def test_every_code(dut):
    step = (1 << max(0, BUILD.power_w - 18)) - 1 | 1  # of more than 2^17 codes some, odd ones and even ones
    codes = list(range(0, 1 << (BUILD.power_w - 1), step))
    assert await run(dut, codes) == [exp2_unit.alpha(BUILD, p) for p in codes]


@cocotb.test()
async def test_codes_do_not_see_their_neighbours(dut):
    generator = rng("exp2")
    codes = [generator.getrandbits(BUILD.power_w - 1) for _ in range(5000)]
    assert await run(dut, codes) == [exp2_unit.alpha(BUILD, p) for p in codes]
