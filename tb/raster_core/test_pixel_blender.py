"""gs_pixel_blender: four pixels in turn, each state and blend in the beat it is due, with gaps and without."""

from dataclasses import dataclass

import cocotb
from cocotb.triggers import RisingEdge

from golden.formats import BUILD
from golden.raster_core import pixel_blender
from tb.lib.footprints import COLOUR_MAX
from tb.lib.pipe import unknown
from tb.lib.stream import rng, start_clock

TOP = "gs_pixel_blender"
SLOW = True
INPUTS = ("in_p", "in_load", "in_open", "in_state", "in_colours", "in_triples")


@dataclass
class Beat:
    """A blend with its power and colours, or a swap to a state (t, red, green, blue)."""

    p: int
    colours: tuple[int, int, int]
    swap: tuple[int, int, int, int] | None = None
    load: bool = False


def packed(values, width: int) -> int:
    return sum(int(value) << (width * at) for at, value in enumerate(values))


def word(state) -> int:
    t, *acc = state
    return (t - 1) | packed(acc, BUILD.acc_w) << BUILD.t_f


def beats(generator, n: int) -> list[Beat]:
    """Swaps in one of 12 beats and in the first four; powers of all sizes, opaque ones and some beyond the cut."""
    found = []
    for at in range(n):
        p = min(int(2 ** generator.uniform(0, BUILD.power_w)), (1 << BUILD.power_w) - 1)
        if generator.random() < 0.3:
            p = generator.randrange(BUILD.cut - 1, BUILD.cut + 2)
        beat = Beat(p, tuple(generator.randint(0, COLOUR_MAX) for _ in range(3)))
        if at < pixel_blender.BEATS or generator.random() < 1 / 12:
            t = min(int(2 ** generator.uniform(0, BUILD.t_f + 0.1)), 1 << BUILD.t_f)
            left = ((1 << BUILD.t_f) - t) << (BUILD.acc_f - BUILD.t_f) if BUILD.acc_f > BUILD.t_f else 0
            loaded = (t, *(generator.randint(0, left) for _ in range(3)))
            fresh = (generator.choice((1, 1 << BUILD.t_f)), 0, 0, 0)
            beat.load = generator.random() < 0.5
            beat.swap = loaded if beat.load else fresh
        found.append(beat)
    return found


async def check(dut, given: list[Beat], gaps: list[int], generator) -> int:
    """Drive the beats with gaps[n] idle cycles in front of beat n; returns how many blended."""
    schedule = [None]
    for beat, gap in zip(given, gaps, strict=True):
        schedule += [None] * gap + [beat]
    edge, states, moved, blends = RisingEdge(dut.clk), [], 0, 0
    for now, later in zip(schedule, [*schedule[1:], None], strict=True):
        values = {name: unknown(getattr(dut, name), generator) for name in INPUTS}
        if later:
            values["in_p"] = later.p
        if now and moved >= pixel_blender.COLOUR_DELAY:
            colours = given[moved - pixel_blender.COLOUR_DELAY].colours
            values["in_colours"] = packed(colours, BUILD.colour_w)
            values["in_triples"] = packed((3 * c for c in colours), BUILD.colour_w + 2)
        if now and now.swap:
            values["in_load"], values["in_open"] = int(now.load), int(not now.load and now.swap[0] > 1)
            if now.load:
                values["in_state"] = word(now.swap)
        for name, value in values.items():
            getattr(dut, name).value = value
        dut.in_blend.value, dut.in_swap.value = int(bool(now and not now.swap)), int(bool(now and now.swap))
        await edge
        if not now:
            continue
        if moved >= pixel_blender.BEATS:
            state = states[moved % pixel_blender.BEATS]
            assert int(dut.out_state.value) == word(state), f"beat {moved}"
            live = state[0] >= BUILD.t_stop
            assert int(dut.out_open.value) == live
            blend = live and not now.swap and now.p <= BUILD.cut
            assert int(dut.trace_blend.value) == blend
            blends += blend
            if blend:
                state = tuple(int(x) for x in pixel_blender.blend_pixel(BUILD, now.p, *state, *now.colours))
            states[moved % pixel_blender.BEATS] = now.swap or state
        else:
            states.append(now.swap)
        moved += 1
    return blends


@cocotb.test()
async def test_beat_after_beat(dut):
    generator = rng("pixel")
    start_clock(dut)
    given = beats(generator, 6000)
    assert await check(dut, given, [0] * len(given), generator) > 500


@cocotb.test()
async def test_gaps_change_nothing(dut):
    generator = rng("pixel gaps")
    start_clock(dut)
    given = beats(generator, 2000)
    await check(dut, given, [generator.choice((0, 0, 0, 1, 2, 7)) for _ in given], generator)
