"""gs_group_finder: the golden masks of ordinary and extreme footprints, a record in three cycles, on time."""

import cocotb
import numpy as np

from golden import params
from golden.formats import BUILD, record_fields, record_offsets
from golden.raster_core import group_finder
from tb.lib import pipe
from tb.lib.footprints import edges, gaussians
from tb.lib.stream import reset, rng, start_clock

TOP = "gs_group_finder"
SLOW = True
FIELDS = ("geometry", "x0", "y0")
SIZES = [(1280, 704), (8191, 8191), (64, 64), (1000, 1000), (97, 33), (96, 32), (1, 1)]
KINDS = ["mixed", "needle", "huge", "far", "small", "codes"]
GAP = group_finder.INTERVAL - 1


def geometry(row) -> int:
    """The geometry bits of a record from its codes (mean_x, mean_y, a, b, c, opacity)."""
    offsets = record_offsets(BUILD).values()
    return sum((int(code) & (1 << width) - 1) << low for code, (low, width) in zip(row, offsets, strict=False))


def seen(kind: str, n: int, seed: int, width: int, height: int) -> list[tuple]:
    """n footprints (codes as gaussians() gives them) each with a tile of the picture: around it, or near it."""
    generator = np.random.default_rng([seed, width])
    tiles = generator.integers(0, [-(-width // params.TILE), -(-height // params.TILE)], (n, 2)) * params.TILE
    rows = gaussians(n, seed, 28, 28, kind)[:, :6]
    if kind == "codes":
        rows[:, :2] >>= generator.integers(0, 8, (n, 1))
    rows[:, :2] += tiles << BUILD.mean_f
    top = 1 << (BUILD.mean_w - 1)
    rows[:, :2] = rows[:, :2].clip(-top, top - 1)
    return list(zip(rows, tiles, strict=True))


def corner(generator) -> tuple:
    """A footprint with every field at an end of its range, or almost, in the tile at the origin."""
    signed = {"mean_x", "mean_y", "chol_b"}
    row = []
    for name, width in record_fields(BUILD)[:6]:
        low, high = (-(1 << (width - 1)), (1 << (width - 1)) - 1) if name in signed else (0, (1 << width) - 1)
        row.append(generator.choice((low, low + 1, 0, high - 1, high)))
    if generator.random() < 0.5:
        row[:2] = (generator.randint(-40_000, 110_000) for _ in range(2))
    return row, (0, 0)


def golden_mask(row, tile, size) -> int:
    mean_x, mean_y, *chol, opacity = (int(code) for code in row)
    return group_finder.mask(BUILD, *chol, mean_x, mean_y, opacity, *(int(at) for at in tile), *size)


def expected(beats, size) -> list[tuple[int, tuple[int]]]:
    """(cycle, mask) of each result."""
    masks = [(cycle, golden_mask(*beat, size)) for cycle, beat in enumerate(beats) if beat is not None]
    return [(cycle + group_finder.LATENCY, (mask,)) for cycle, mask in masks]


async def check(dut, beats, size, generator) -> list[int]:
    """Masks of the beats, which are spread over the cycles already."""
    dut.cfg_width.value, dut.cfg_height.value = size
    driven = [beat and (geometry(beat[0]), *beat[1]) for beat in beats]
    found = await pipe.run(dut, FIELDS, driven, ("mask",), group_finder.LATENCY + 3, generator)
    assert found == expected(beats, size)
    return [mask for _, (mask,) in found]


def spread(beats, gaps) -> list:
    """The beats, each followed by its number of idle cycles."""
    return [one for beat in beats for one in (beat, *[None] * next(gaps))]


async def bench(dut, *names):
    start_clock(dut)
    dut.in_valid.value = 0
    await reset(dut)
    return rng("group_finder", *names)


@cocotb.test()
@cocotb.parametrize(kind=KINDS)
async def test_masks_are_those_of_the_golden_model(dut, kind):
    generator = await bench(dut, kind)
    masks = []
    for seed, size in enumerate(SIZES):
        masks += await check(dut, spread(seen(kind, 250, seed, *size), iter(lambda: GAP, None)), size, generator)
    assert 0 in masks and len(set(masks)) > 5


@cocotb.test()
@cocotb.parametrize(kind=["mixed", "needle", "huge"])
async def test_where_one_code_changes_the_mask(dut, kind):
    generator = await bench(dut, "edges", kind)
    size, tile = (1000, 1000), (704, 960)
    rows = gaussians(2000, 21, tile[0] + 28, tile[1] + 12, kind)[:, :6]
    beats = [(row, tile) for row in edges(rows, lambda row: golden_mask(row, tile, size))]
    assert len(beats) > 1000
    await check(dut, spread(beats, iter(lambda: GAP, None)), size, generator)


@cocotb.test()
async def test_fields_at_the_ends_of_their_ranges(dut):
    generator = await bench(dut, "ends")
    beats = [corner(generator) for _ in range(1500)]
    masks = await check(dut, spread(beats, iter(lambda: GAP, None)), (64, 64), generator)
    assert 0 in masks and 0xFFFF in masks


@cocotb.test()
async def test_a_tile_outside_the_picture_has_no_groups(dut):
    generator = await bench(dut, "outside")
    everywhere = np.array([40_000, 40_000, 1, 0, 1, 0])
    for tile in ((64, 0), (0, 64), (64, 64), (4096, 0)):
        for size in ((64, 64), (33, 64), (1, 1)):
            assert set(
                await check(dut, spread([(everywhere, tile)] * 3, iter(lambda: GAP, None)), size, generator)
            ) == {0}


@cocotb.test()
async def test_any_gaps_of_two_cycles_and_more(dut):
    generator = await bench(dut, "gaps")
    beats = seen("mixed", 400, 9, 640, 384)
    gaps = iter(lambda: generator.choice((GAP, GAP, GAP + 1, GAP + 2, 5, 9, 20)), None)
    await check(dut, spread(beats, gaps), (640, 384), generator)


@cocotb.test()
async def test_reset_forgets_what_is_under_way(dut):
    generator = await bench(dut, "reset")
    size = (640, 384)
    beats = spread(seen("mixed", 5, 10, *size), iter(lambda: GAP, None))
    for after in range(1, 12):
        dut.cfg_width.value, dut.cfg_height.value = size
        driven = [beat and (geometry(beat[0]), *beat[1]) for beat in beats[:after]]
        await pipe.run(dut, FIELDS, driven, ("mask",), 0, generator)
        await pipe.reset_full(dut)
        await check(dut, beats, size, generator)
