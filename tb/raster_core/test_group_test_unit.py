"""gs_group_test_unit: the golden hits of a group's four subtiles, one Gaussian a cycle, also at the picture's end."""

import cocotb

from golden.formats import BUILD, record_fields, record_offsets
from golden.raster_core.group_test_unit import LATENCY, group_hits
from tb.lib import pipe
from tb.lib.footprints import edges, gaussians
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


def golden_hits(row, x: int, y: int, size: tuple[int, int] = SIZE) -> int:
    mean_x, mean_y, *chol, opacity = (int(code) for code in row)
    return group_hits(BUILD, *chol, mean_x, mean_y, opacity, x, y, *size)


async def check(dut, rows, generator, gaps: bool = False, at=None, size: tuple[int, int] = SIZE) -> list[int]:
    """Each row of record codes at that group, or at a random one: the hits."""
    beats, wanted = [], []
    for row in rows:
        if gaps and generator.random() < 0.5:
            beats.append(None)
        x, y = at or (640 + 32 * generator.randrange(3), 312 + 8 * generator.randrange(4))
        wanted.append((len(beats) + LATENCY, (golden_hits(row, x, y, size),)))
        beats.append((x, y, geometry(row)))
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
@cocotb.parametrize(kind=["mixed", "needle", "huge"])
async def test_where_one_code_changes_the_hits(dut, kind):
    generator = await bench(dut, f"edges {kind}")
    at = (640, 320)
    rows = edges(gaussians(400, 8, 656, 324, kind)[:, :6], lambda row: golden_hits(row, *at))
    assert len(rows) > 500
    await check(dut, rows, generator, at=at)


@cocotb.test()
async def test_a_picture_ends_anywhere(dut):
    generator = await bench(dut, "ends")
    random = generator.randrange
    for _ in range(200):
        at = (32 * random(250), 8 * random(1000))
        near = (at[0] + random(1, 40), at[1] + random(-4, 5))
        size = tuple(random(1, 8192) if random(4) == 0 else max(side, 1) for side in near)
        dut.cfg_width.value, dut.cfg_height.value = size
        everywhere = (at[0] << BUILD.mean_f, at[1] << BUILD.mean_f, 1, 0, 1, 0)
        await check(dut, [everywhere], generator, at=at, size=size)


@cocotb.test()
async def test_gaps_and_reset(dut):
    generator = await bench(dut, "gaps")
    rows = gaussians(300, 10, 672, 324, "mixed")[:, :6]
    await check(dut, rows, generator, gaps=True)
    beats = [(640, 320, geometry(row)) for row in rows[: LATENCY + 2]]
    await pipe.run(dut, FIELDS, beats, ("hits",), 0, generator)
    await pipe.reset_full(dut)
    await check(dut, rows[:20], generator)
