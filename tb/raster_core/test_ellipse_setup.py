"""gs_ellipse_setup: the golden codes, on time, for ordinary and extreme footprints, one a cycle."""

from collections.abc import Iterator

import cocotb
from cocotb.triggers import RisingEdge

from golden.formats import BUILD
from golden.raster_core import ellipse_setup
from tb.lib import pipe
from tb.lib.stream import reset, rng, start_clock

TOP = "gs_ellipse_setup"
SLOW = True
FIELDS = ("a", "b", "c", "mean_x", "mean_y", "x0", "y0")
V_F = BUILD.edge_f + ellipse_setup.GUARD
U_MASK, HIGH_MASK, LOW_MASK = (1 << (BUILD.edge_f + 8)) - 1, (1 << (V_F + 6)) - 1, (1 << (V_F + 3)) - 1
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


def ends_of(field: str, generator) -> Iterator[tuple[int, ...]]:
    """Footprints of one factor whose u or v is next to the largest or the smallest that fits."""
    top = 1 << (BUILD.edge_f + (5 if field == "c" else 7))
    for _ in range(100):
        beat = dict.fromkeys(FIELDS, 0)
        beat[field] = generator.randrange(1 << (BUILD.chol_w - 3), 1 << BUILD.chol_w)
        scale = BUILD.chol_f + BUILD.mean_f - BUILD.edge_f
        wanted = generator.choice((-top, top)) + generator.randint(-2, 2)
        offset = (wanted << scale) // beat[field]
        mean = "mean_x" if field == "a" else "mean_y"
        low, high = RANGES[FIELDS.index(mean)]
        beat[mean] = min(max((1 << (BUILD.mean_f - 1)) - offset, low), high)
        yield tuple(beat[name] for name in FIELDS)


def expected(beats) -> list[tuple]:
    """(cycle, u0, (v_high, v_low), far) of each result; u0 and v mean nothing where far is set."""
    found = []
    for cycle, beat in enumerate(beats):
        if beat is not None:
            u, high, low, far = ellipse_setup.corner(BUILD, *beat)
            at = cycle + ellipse_setup.LATENCY
            v = int(high) & HIGH_MASK, int(low) & LOW_MASK
            found.append((at, -1, -1, 1) if far else (at, int(u) & U_MASK, v, 0))
    return found


async def check(dut, beats, generator) -> list[int]:
    """Compare; `far` of each result."""
    edge = RisingEdge(dut.clk)
    inputs = [getattr(dut, f"in_{field}") for field in FIELDS]
    found, v = [], (0, 0)
    for cycle, beat in enumerate([*beats, *[None] * (ellipse_setup.LATENCY + 3)]):
        dut.in_valid.value = beat is not None
        for at, signal in enumerate(inputs):
            signal.value = pipe.unknown(signal, generator) if beat is None else pipe.code(beat[at], signal)
        await edge
        if dut.out_valid.value:
            far = int(dut.out_far.value)
            found.append((cycle, -1, -1, 1) if far else (cycle, int(dut.out_u0.value), v, 0))
        parts = dut.out_v_high.value, dut.out_v_low.value  # of the next cycle's result
        v = tuple(int(part) if part.is_resolvable else 0 for part in parts)
    assert found == expected(beats)
    return [far for *_, far in found]


@cocotb.test()
async def test_ordinary_and_extreme_footprints_one_a_cycle(dut):
    generator = rng("setup")
    start_clock(dut)
    dut.in_valid.value = 0
    await reset(dut)
    anything = [tuple(generator.randint(low, high) for low, high in RANGES) for _ in range(500)]
    beats = [near(generator) for _ in range(2000)] + [corner(generator) for _ in range(2000)] + anything
    far = await check(dut, beats, generator)
    assert len(far) // 10 < sum(far) < len(far) * 9 // 10
    for field in ("a", "b", "c"):  # both ends of what fits, one code at a time
        await check(dut, list(ends_of(field, generator)), generator)


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
    await pipe.run(dut, FIELDS, [near(generator) for _ in range(5)], ("u0", "far"), 0, generator)
    await pipe.reset_full(dut)
    await check(dut, [near(generator) for _ in range(5)], generator)
