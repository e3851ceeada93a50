"""gs_power_unit: p of all 64 pixels, exact and on time, for Gaussians back to back and with gaps."""

from itertools import product

import cocotb
from cocotb.triggers import RisingEdge

from golden import params
from golden.formats import BUILD
from golden.raster_core import power_unit
from tb.lib.footprints import gaussians
from tb.lib.pipe import code, unknown
from tb.lib.stream import reset, rng, start_clock

TOP = "gs_power_unit"
SLOW = True
ORIGIN = (640, 320)
CORNER = (8184, 8184)  # of the last subtile
OTHERS = ((5456, 2728), (2728, 5456))  # every second bit
FIELDS = ("mean_x", "mean_y", "a", "b", "c", "opacity", "x0", "y0")


def words(beat) -> list[int]:
    """out_p at the four beats of one Gaussian."""
    p = power_unit.powers(BUILD, *beat).reshape(params.BEATS, params.LANES)
    return [word(row) for row in p.tolist()]


def word(lanes: list[int]) -> int:
    """out_p of the lanes; of a p that is far the top bit alone."""
    top = 1 << (BUILD.power_w - 1)
    return sum((top if p & top else p) << (lane * BUILD.power_w) for lane, p in enumerate(lanes))


def seen_word(dut) -> int:
    """out_p as `word` gives it."""
    out, mask = int(dut.out_p.value), (1 << BUILD.power_w) - 1
    return word([out >> (lane * BUILD.power_w) & mask for lane in range(params.LANES)])


async def check(dut, beats, gaps, generator) -> None:
    """Offer each Gaussian gaps[n] cycles after the first moment the unit allows it."""
    expected = {}
    edge = RisingEdge(dut.clk)
    schedule = []
    for beat, gap in zip(beats, gaps, strict=True):
        schedule += [None] * gap + [beat] + [None] * (params.BEATS - 1)
    signals = [getattr(dut, f"in_{field}") for field in FIELDS]
    for cycle, beat in enumerate(schedule + [None] * (power_unit.LATENCY + params.BEATS)):
        dut.in_valid.value = beat is not None
        for signal, value in zip(signals, beat or [None] * len(signals), strict=True):
            signal.value = unknown(signal, generator) if value is None else code(value, signal)
        if beat is not None:
            expected |= {cycle + power_unit.LATENCY + k: word for k, word in enumerate(words(beat))}
        await edge
        if cycle in expected:
            assert seen_word(dut) == expected.pop(cycle), f"cycle {cycle}"
    assert not expected


def seen(kind: str, n: int, seed: int, origin: tuple[int, int] = ORIGIN) -> list[tuple[int, ...]]:
    return [(*(int(v) for v in row[:6]), *origin) for row in gaussians(n, seed, *origin, kind)]


@cocotb.test()
@cocotb.parametrize(kind=["mixed", "needle", "huge", "far", "small", "codes"])
async def test_all_pixels_back_to_back(dut, kind):
    start_clock(dut)
    dut.in_valid.value = 0
    await reset(dut)
    beats = seen(kind, 300, seed=11) + seen(kind, 700 if kind == "mixed" else 100, seed=13, origin=CORNER)
    beats += [beat for origin in OTHERS for beat in seen(kind, 60, seed=14, origin=origin)]
    await check(dut, beats, [0] * len(beats), rng("power", kind))


def next_to_saturation() -> list[tuple[int, ...]]:
    """u or v of a column or row within some codes of -4 and 4, where |u| rounds to the end of UQ2.DIST_F."""
    beats, half = [], 1 << (BUILD.mean_f - 1)
    for pixel in range(params.SUBTILE):
        for near, distance in product(range(-24, 25, 3), (-4, 4)):
            step = (1 << BUILD.chol_f) + near
            x, y = (((at + pixel - distance) << BUILD.mean_f) + half for at in ORIGIN)
            middle = ((ORIGIN[0] + 4) << BUILD.mean_f) + half
            beats += [(x, y, step, 0, 0, 0, *ORIGIN), (middle, y, 0, 0, step, 0, *ORIGIN)]
    return beats


def steep(n: int) -> list[tuple[int, ...]]:
    """Any a, b, c and opacity, the mean less than a pixel from the centre of one: |u| and |v| stay small around it."""
    random = rng("steep").randrange
    beats, one = [], 1 << BUILD.mean_f
    for _ in range(n):
        x, y = (((at + random(8)) << BUILD.mean_f) + random(one) for at in ORIGIN)
        a, c = (random(1 << random(1, BUILD.chol_w + 1)) for _ in range(2))
        b = random(-(1 << BUILD.chol_w), 1 << BUILD.chol_w) >> random(BUILD.chol_w)
        beats.append((x, y, a, b, c, random(1 << BUILD.opacity_w), *ORIGIN))
    return beats


@cocotb.test()
async def test_steep_ones(dut):
    start_clock(dut)
    dut.in_valid.value = 0
    await reset(dut)
    beats = steep(4000)
    await check(dut, beats, [0] * len(beats), rng("power steep"))


@cocotb.test()
async def test_both_sides_of_the_saturation(dut):
    start_clock(dut)
    dut.in_valid.value = 0
    await reset(dut)
    beats = next_to_saturation()
    await check(dut, beats, [0] * len(beats), rng("power saturation"))


@cocotb.test()
async def test_gaps_and_reset(dut):
    generator = rng("power gaps")
    start_clock(dut)
    dut.in_valid.value = 0
    await reset(dut)
    beats = seen("mixed", 150, seed=12)
    await check(dut, beats, [generator.choice((0, 0, 1, 2, 3, 4, 9)) for _ in beats], generator)
    for signal, value in zip([getattr(dut, f"in_{field}") for field in FIELDS], beats[0], strict=True):
        signal.value = code(value, signal)
    for phase in range(6):
        dut.in_valid.value = 1
        await RisingEdge(dut.clk)
        dut.in_valid.value = 0
        for _ in range(phase):
            await RisingEdge(dut.clk)
        await reset(dut, cycles=1)
        await check(dut, beats[:5], [0] * 5, generator)
