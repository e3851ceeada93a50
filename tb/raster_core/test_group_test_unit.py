"""gs_group_test_unit: the golden hits of a group's four subtiles, one Gaussian a cycle, also at the picture's end."""

import cocotb

from golden.formats import BUILD, record_fields, record_offsets
from golden.raster_core.group_test_unit import LATENCY, group_hits
from tb.lib import pipe
from tb.lib.footprints import gaussians
from tb.lib.stream import reset, rng, start_clock

TOP = "gs_group_test_unit"
SLOW = True
SIZE = (677, 331)  # the groups at x = 672 and y = 328 are cut
FIELDS = ("x", "y", "geometry")


def geometry(row) -> int:
    """The low fields of a record."""
    word = 0
    for value, (name, width) in zip(row, record_fields(BUILD)[:6], strict=True):
        word |= (int(value) & (1 << width) - 1) << record_offsets(BUILD)[name][0]
    return word


async def check(dut, rows, generator, gaps: bool = False) -> list[int]:
    """Each row of record codes at a random group: the hits."""
    beats, wanted = [], []
    for mean_x, mean_y, a, b, c, opacity in rows:
        if gaps and generator.random() < 0.5:
            beats.append(None)
        x, y = 640 + 32 * generator.randrange(3), 312 + 8 * generator.randrange(4)
        hits = group_hits(BUILD, a, b, c, mean_x, mean_y, opacity, x, y, *SIZE)
        wanted.append((len(beats) + LATENCY, (hits,)))
        beats.append((x, y, geometry((mean_x, mean_y, a, b, c, opacity))))
    found = await pipe.run(dut, FIELDS, beats, ("hits",), LATENCY + 3, generator)
    assert found == wanted
    return [hits for _, (hits,) in found]


async def bench(dut, name: str):
    start_clock(dut)
    dut.cfg_width.value, dut.cfg_height.value = SIZE
    dut.in_valid.value = 0
    await reset(dut)
    return rng("group", name)


@cocotb.test()
@cocotb.parametrize(kind=["mixed", "needle", "huge", "far", "small"])
async def test_it_is_the_golden_predicate(dut, kind):
    generator = await bench(dut, kind)
    hits = await check(dut, gaussians(1500, 7, 672, 324, kind)[:, :6], generator)
    assert 0 < sum(map(bool, hits)) < len(hits)


@cocotb.test()
async def test_gaps_and_reset(dut):
    generator = await bench(dut, "gaps")
    rows = gaussians(300, 10, 672, 324, "mixed")[:, :6]
    await check(dut, rows, generator, gaps=True)
    beats = [(640, 320, geometry(row)) for row in rows[: LATENCY + 2]]
    await pipe.run(dut, FIELDS, beats, ("hits",), 0, generator)
    await pipe.reset_full(dut)
    await check(dut, rows[:20], generator)
