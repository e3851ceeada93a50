"""gs_row_reach: the golden reach of every kind of row, one a cycle, on time."""

import cocotb
from cocotb.triggers import RisingEdge

from golden.formats import BUILD
from golden.raster_core import row_reach
from golden.raster_core.ellipse_setup import GUARD
from tb.lib.stream import rng, start_clock

TOP = "gs_row_reach"
SLOW = True
V_END = 1 << (BUILD.edge_f + GUARD + 5)  # of v, SQ5
LOW_END = V_END >> 3
STEP_END = 1 << (BUILD.edge_f + GUARD + 4)
ONE = 1 << (2 * BUILD.itu_f)  # of the limit
DIGITS = 1 << (BUILD.itu_f + 2)
LEAST = -16 * ONE  # opacities far below the cut


async def check(dut, rows) -> list[int]:
    """rows of (v0, step, limit): their reaches, those of empty rows EMPTY; equal to golden's."""
    start_clock(dut)
    generator = rng("parts")
    edge = RisingEdge(dut.clk)
    found = []
    for cycle in range(len(rows) + row_reach.LATENCY):
        v0, step, _ = rows[cycle % len(rows)]
        low = generator.randrange(max(-LOW_END, v0 - V_END + 1), min(LOW_END, v0 + V_END + 1))
        dut.in_v_high.value, dut.in_v_low.value = (v0 - low) & (2 * V_END - 1), low & (2 * LOW_END - 1)
        dut.in_step.value = step
        dut.in_limit.value = rows[(cycle or 1) - 1][2] & ((1 << len(dut.in_limit)) - 1) if cycle <= len(rows) else 0
        await edge
        if cycle >= row_reach.LATENCY:
            found.append(row_reach.EMPTY if dut.out_empty.value else int(dut.out_reach.value))
    wanted = [row_reach.reach(BUILD, v0 + step, limit) for v0, step, limit in rows]
    assert found == wanted
    return found


@cocotb.test()
async def test_every_distance(dut):
    generator = rng("distance")
    fine = 1 << (BUILD.edge_f + GUARD - BUILD.itu_f)
    rows = []
    for d in range(DIGITS + 3):
        for v in (d * fine, d * fine - 1, -d * fine, -d * fine - 1):
            step = generator.randrange(min(STEP_END, V_END))
            limit = generator.choice((8 * ONE, 15 * ONE, d * d, d * d - 1, d * d + 2 * d))
            rows.append((v - step, step, min(limit, 16 * ONE - 1)))
    found = await check(dut, rows)
    assert 0 in found and row_reach.EMPTY in found


@cocotb.test()
async def test_every_root_and_the_codes_beside_it(dut):
    squares = [root * root + beside for root in range(DIGITS) for beside in (-1, 0, 1)]
    found = await check(dut, [(0, 0, square) for square in squares])
    assert set(found) == {row_reach.EMPTY, *range(DIGITS)}


@cocotb.test()
async def test_anything(dut):
    generator = rng("anything")
    rows = []
    for _ in range(4000):
        v0, step = generator.randrange(-V_END, V_END), generator.randrange(STEP_END)
        v0, step = (
            generator.choice((-V_END, V_END - 1, v0, v0 >> 4)),
            generator.choice((0, STEP_END - 1, step, step >> 4)),
        )
        rows.append((v0, step, generator.choice((LEAST, 8 * ONE, 15 * ONE, generator.randrange(LEAST, 15 * ONE)))))
    found = await check(dut, rows)
    assert 200 < found.count(row_reach.EMPTY) < len(found) - 200
