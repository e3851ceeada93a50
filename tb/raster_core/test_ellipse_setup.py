"""gs_ellipse_setup: exact and on time for ordinary and extreme footprints, one a cycle."""

import cocotb

from golden.formats import BUILD
from golden.raster_core import ellipse_setup
from tb.lib import pipe
from tb.lib.stream import reset, rng, start_clock

TOP = "gs_ellipse_setup"
SLOW = True
FIELDS = ("a", "b", "c", "mean_x", "mean_y", "x0", "y0")
RANGES = (  # lowest and highest code of each field
    (0, (1 << BUILD.chol_w) - 1),
    (-(1 << BUILD.chol_w), (1 << BUILD.chol_w) - 1),
    (0, (1 << BUILD.chol_w) - 1),
    (-(1 << (BUILD.mean_w - 1)), (1 << (BUILD.mean_w - 1)) - 1),
    (-(1 << (BUILD.mean_w - 1)), (1 << (BUILD.mean_w - 1)) - 1),
    (0, (1 << (BUILD.mean_w - BUILD.mean_f - 1)) - 1),
    (0, (1 << (BUILD.mean_w - BUILD.mean_f - 1)) - 1),
)


def near(generator) -> tuple[int, ...]:
    """A footprint whose mean is at most some hundred pixels away: mostly not saturated."""
    x0, y0 = (generator.randrange(0, 4096, 8) for _ in range(2))
    a, c = (int(2 ** generator.uniform(4, BUILD.chol_w)) for _ in range(2))
    b = int(generator.choice((-1, 1)) * 2 ** generator.uniform(0, BUILD.chol_w))
    mean_x, mean_y = (((at << BUILD.mean_f) + generator.randint(-300_000, 300_000)) for at in (x0, y0))
    return a, b, c, mean_x, mean_y, x0, y0


def corner(generator) -> tuple[int, ...]:
    """Lowest, highest, or almost: the ends of every field."""
    return tuple(generator.choice((low, low + 1, 0, high - 1, high)) for low, high in RANGES)


def expected(beats) -> list[tuple[int, tuple[int, int]]]:
    mask = (1 << BUILD.step_w) - 1
    return [
        (cycle + ellipse_setup.LATENCY, tuple(int(value) & mask for value in ellipse_setup.setup(BUILD, *beat)))
        for cycle, beat in enumerate(beats)
        if beat is not None
    ]


async def check(dut, beats, generator) -> None:
    found = await pipe.run(dut, FIELDS, beats, ("u0", "v0"), ellipse_setup.LATENCY + 3, generator)
    assert found == expected(beats)


@cocotb.test()
async def test_ordinary_and_extreme_footprints_one_a_cycle(dut):
    generator = rng("setup")
    start_clock(dut)
    dut.in_valid.value = 0
    await reset(dut)
    anything = [tuple(generator.randint(low, high) for low, high in RANGES) for _ in range(500)]
    beats = [near(generator) for _ in range(2000)] + [corner(generator) for _ in range(2000)] + anything
    values = [value for _, pair in expected(beats) for value in pair]
    assert (1 << (BUILD.step_w - 1)) - 1 in values and 1 << (BUILD.step_w - 1) in values  # it saturates both ways
    await check(dut, beats, generator)


@cocotb.test()
async def test_gaps_pass_through(dut):
    generator = rng("gaps")
    start_clock(dut)
    dut.in_valid.value = 0
    await reset(dut)
    await check(dut, [near(generator) if generator.random() < 0.4 else None for _ in range(500)], generator)


@cocotb.test()
async def test_reset_forgets_what_is_under_way(dut):
    generator = rng("reset")
    start_clock(dut)
    dut.in_valid.value = 0
    await reset(dut)
    await pipe.run(dut, FIELDS, [near(generator) for _ in range(5)], ("u0", "v0"), 0, generator)
    await pipe.reset_full(dut)
    await check(dut, [near(generator) for _ in range(5)], generator)
