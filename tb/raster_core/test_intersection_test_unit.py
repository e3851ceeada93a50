"""gs_intersection_test_unit: the golden predicate for ordinary, thin, huge and far ellipses, one entry a cycle."""

import cocotb
import numpy as np

from golden import params
from golden.formats import BUILD
from golden.raster_core import intersection_test_unit as itu
from golden.raster_core.ellipse_setup import setup
from tb.lib import pipe
from tb.lib.footprints import gaussians
from tb.lib.stream import reset, rng, start_clock

TOP = "gs_intersection_test_unit"
SLOW = True
FIELDS = ("u0", "v0", "a", "b", "c", "limit")
LOW, HIGH = -(1 << (BUILD.step_w - 1)), (1 << (BUILD.step_w - 1)) - 1
TOP_A = (1 << BUILD.chol_w) - 1


def seen(kind: str, n: int, seed: int) -> list[tuple[int, ...]]:
    """Gaussians as unit s of a group at pixel (640, 320) sees them, s in turn."""
    beats = []
    for at, (mean_x, mean_y, a, b, c, opacity, *_) in enumerate(gaussians(n, seed, 656, 320, kind)):
        u0, v0 = setup(BUILD, a, b, c, mean_x, mean_y, 640, 320)
        beats.append((u0 + at % params.UNITS * params.SUBTILE * a, v0, a, b, c, itu.bound(BUILD, opacity)))
    return [tuple(int(value) for value in beat) for beat in beats]


def ends(generator) -> tuple[int, ...]:
    """Fields at the ends of their ranges; u0 as the fourth unit of a group may see it."""
    a = generator.choice((0, 1, TOP_A))
    u0 = generator.choice((LOW, LOW + 1, -7 * a, -7 * a - 1, -1, 0, 1, HIGH)) + generator.choice((0, 24 * a))
    b = generator.choice((-TOP_A - 1, -TOP_A, -1, 0, 1, TOP_A))
    limit = generator.choice((itu.bound(BUILD, 0), itu.bound(BUILD, (1 << BUILD.opacity_w) - 1), -1, 0, 1))
    return u0, generator.choice((LOW, -1, 0, 1, HIGH)), a, b, generator.choice((0, 1, TOP_A)), limit


def nearest(u0, v0, a, b, c) -> int:
    """The limit at which the subtile is just hit."""
    low, high = 0, (1 << (2 * BUILD.itu_w - 1)) - 1
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if itu.subtile_hit(BUILD, u0, v0, a, b, c, middle) else (middle + 1, high)
    return low


def expected(beats) -> list[tuple[int, tuple[int]]]:
    return [
        (cycle + itu.UNIT_LATENCY, (int(itu.subtile_hit(BUILD, *beat)),))
        for cycle, beat in enumerate(beats)
        if beat is not None
    ]


async def check(dut, beats, generator) -> list[int]:
    found = await pipe.run(dut, FIELDS, beats, ("hit",), itu.UNIT_LATENCY + 3, generator)
    assert found == expected(beats)
    return [hit for _, (hit,) in found]


async def bench(dut, *names):
    start_clock(dut)
    dut.in_valid.value = 0
    await reset(dut)
    return rng("itu", *names)


@cocotb.test()
@cocotb.parametrize(kind=["mixed", "needle", "huge", "far", "small"])
async def test_it_is_the_golden_predicate(dut, kind):
    generator = await bench(dut, kind)
    hits = await check(dut, seen(kind, 3000, seed=7), generator)
    assert 0 < sum(hits) < 3000


@cocotb.test()
async def test_fields_at_the_ends_of_their_ranges(dut):
    generator = await bench(dut, "ends")
    hits = await check(dut, [ends(generator) for _ in range(4000)], generator)
    assert 0 < sum(hits) < 4000


@cocotb.test()
async def test_the_limit_is_exact(dut):
    generator = await bench(dut, "limit")
    beats = []
    for *beat, _ in seen("mixed", 700, seed=8) + seen("needle", 300, seed=9):
        limit = nearest(*beat)
        beats += [(*beat, limit), (*beat, limit - 1)]
    hits = np.array(await check(dut, beats, generator)).reshape(-1, 2)
    assert hits[:, 0].sum() > 200 and not hits[:, 1].any()


@cocotb.test()
async def test_distances_next_to_a_whole_code_truncate_alike_on_both_sides(dut):
    generator = await bench(dut, "whole")
    beats = []
    for k in (1, 2, 3, 777, 2895, 2896, 4094, 4095, 4096):
        for delta in (-1, 0, 1):
            step = (k << (BUILD.step_f - BUILD.itu_f)) + delta
            for sign in (-1, 1):
                for square in ((k - 1) ** 2, k * k - 1, k * k):
                    limit = min(square, (1 << (2 * BUILD.itu_w - 1)) - 1)
                    beats += [(sign * step, 0, 0, 0, 0, limit), (0, sign * step, 0, 0, 0, limit)]
    hits = await check(dut, beats, generator)
    assert 0 < sum(hits) < len(hits)


@cocotb.test()
async def test_gaps_and_reset(dut):
    generator = await bench(dut, "gaps")
    beats = seen("mixed", 300, seed=10)
    await check(dut, [beat if generator.random() < 0.5 else None for beat in beats], generator)
    await pipe.run(dut, FIELDS, beats[:9], ("hit",), 0, generator)
    await pipe.reset_full(dut)
    await check(dut, beats[:20], generator)
