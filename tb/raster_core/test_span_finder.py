"""gs_span_finder: the golden span of any rows, one ellipse a cycle, on time."""

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden import params
from golden.formats import BUILD
from golden.raster_core import span_finder
from golden.raster_core.row_reach import EMPTY
from tb.lib.stream import rng, start_clock

TOP = "gs_span_finder"
SLOW = True
ROWS = params.SUBTILE
ROW_W = BUILD.itu_f + 2
B_END = 1 << (BUILD.edge_f + 1)
OUT_W = BUILD.edge_f + 7
VOID = -12 << BUILD.edge_f  # above every span of nothing, below every other one's sum


def signed(signal) -> int:
    value = int(signal.value)
    return value - (1 << OUT_W) if value >> (OUT_W - 1) else value


async def check(dut, ellipses, generator) -> None:
    """ellipses of (b, reaches [8])."""
    start_clock(dut)
    edge = RisingEdge(dut.clk)
    for cycle in range(len(ellipses) + span_finder.LATENCY + 1):
        dut.in_b.value = ellipses[cycle % len(ellipses)][0] & (2 * B_END - 1)
        rows = ellipses[cycle - 1][1] if 0 < cycle <= len(ellipses) else [EMPTY] * ROWS
        dut.row_empty.value = sum(int(row == EMPTY) << j for j, row in enumerate(rows))
        shown = [generator.getrandbits(ROW_W) if row == EMPTY else int(row) for row in rows]  # an empty row's is any
        dut.row_reach.value = sum(row << j * ROW_W for j, row in enumerate(shown))
        await edge
        at = cycle - span_finder.LATENCY - 1
        if at >= 0:
            b, rows = ellipses[at]
            found = signed(dut.out_right), signed(dut.out_left)
            if max(rows) == EMPTY:
                assert sum(found) < 2 * VOID
            else:
                assert found == span_finder.reaches(BUILD, b, np.array(rows)), (at, b, rows)


def ellipse(generator) -> tuple[int, list[int]]:
    b = generator.randrange(-B_END, B_END)
    b = generator.choice((-B_END, B_END - 1, 0, -1, b, b >> 5))
    kind = generator.random()
    rows = [generator.choice((0, (1 << ROW_W) - 1, generator.getrandbits(ROW_W))) for _ in range(ROWS)]
    if kind < 0.5:  # some rows in the middle, as an ellipse has them
        first, end = sorted(generator.sample(range(ROWS + 1), 2))
        rows = [row if first <= j < end else EMPTY for j, row in enumerate(rows)]
    elif kind < 0.8:
        rows = [row if generator.random() < 0.5 else EMPTY for row in rows]
    elif kind < 0.9:
        rows = [EMPTY] * ROWS
    return b, rows


@cocotb.test()
async def test_it_is_the_largest_of_the_rows(dut):
    generator = rng("span")
    await check(dut, [ellipse(generator) for _ in range(6000)], generator)


@cocotb.test()
async def test_each_row_alone(dut):
    generator = rng("alone")
    ellipses = []
    for b in (-B_END, -B_END + 1, -1, 0, 1, B_END - 1):
        for j in range(ROWS):
            for reach in (0, 1, (1 << ROW_W) - 1):
                ellipses.append((b, [reach if at == j else EMPTY for at in range(ROWS)]))
    await check(dut, ellipses, generator)
