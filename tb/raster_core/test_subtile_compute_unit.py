"""gs_subtile_compute_unit: pixels, traces and saturation reports, bit for bit and in the right cycle."""

import math
from dataclasses import dataclass, field

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden import params
from golden.formats import BUILD, COLOUR_LIMIT
from golden.raster_core import subtile_compute_unit as scu
from tb.lib.footprints import COLOUR_MAX, gaussians
from tb.lib.pipe import unknown
from tb.lib.stream import STALLS, Source, cycle, reset, rng, start_clock

TOP = "gs_subtile_compute_unit"
SLOW = True
BLEND = ("mean_x", "mean_y", "a", "b", "c", "opacity", "red", "green", "blue")
FIELDS = ("swap", "store", "fresh", "group", "cols", "rows", "x0", "y0", *BLEND)
ORIGIN = (640, 320)


def blend(row, x0: int = ORIGIN[0], y0: int = ORIGIN[1]) -> dict:
    return {"swap": 0, "x0": x0, "y0": y0} | {name: int(value) for name, value in zip(BLEND, row, strict=True)}


def swap(group: int, store: int = 1, fresh: int = 0, cols: int = 8, rows: int = 8) -> dict:
    return {"swap": 1, "store": store, "fresh": fresh, "group": group} | ({"cols": cols, "rows": rows} if fresh else {})


@dataclass
class Bench:
    """The unit with a pixel buffer, and everything it was seen to do: lists of (cycle, ...)."""

    dut: object
    source: Source
    generator: object
    buffer: dict[int, int] = field(default_factory=dict)
    reads: list = field(default_factory=list)
    writes: list = field(default_factory=list)
    sats: list = field(default_factory=list)
    traces: list = field(default_factory=list)
    group: int = 0
    state: tuple = ()

    def send(self, ops: list[dict]) -> None:
        widths = {name: len(getattr(self.dut, f"op_{name}")) for name in FIELDS}
        masked = [{n: None if n not in op else op[n] & ((1 << widths[n]) - 1) for n in FIELDS} for op in ops]
        self.source.send(masked)

    async def watch(self) -> None:
        """The pixel buffer, a gs_ram, and the log."""
        dut, edge, shown = self.dut, RisingEdge(self.dut.clk), True
        while True:
            await edge
            word = None
            if dut.px_rd_en.value:
                self.reads.append((cycle(), int(dut.px_rd_addr.value)))
                word = self.buffer[int(dut.px_rd_addr.value)]
            if dut.px_wr_en.value:
                at = int(dut.px_wr_addr.value)
                self.buffer[at] = int(dut.px_wr_data.value)
                self.writes.append((cycle(), at, self.buffer[at]))
            if dut.sat_valid.value:
                stored = int(dut.sat_stored.value)
                full = int(dut.sat_all.value) if stored else None
                self.sats.append((cycle(), stored, int(dut.sat_group.value), full))
            if dut.trace_valid.value:
                self.traces.append((cycle(), int(dut.trace_blend.value)))
            if word is not None:
                dut.px_rd_data.value = word
            elif shown:
                dut.px_rd_data.value = unknown(dut.px_rd_data, self.generator)
            shown = word is not None

    def forget(self) -> None:
        for log in (self.reads, self.writes, self.sats, self.traces, self.source.cycles):
            log.clear()
        self.group, self.state = 0, ()

    def expect(self, ops: list[dict], buffer: dict[int, int]) -> tuple[list, list, list, list]:
        """What the golden model says, given the cycles in which the operations were taken. Buffer changes in place."""
        reads, writes, sats, traces = [], [], [], []
        beats = range(params.BEATS)
        for op, at in zip(ops, self.source.cycles, strict=True):
            if op["swap"]:
                low, held = op["group"] * params.BEATS, self.group * params.BEATS
                if op["store"]:
                    words = scu.pack(BUILD, *self.state)
                    writes += [(at + scu.BLEND_STAGE + k, held + k, words[k]) for k in beats]
                    buffer |= {held + k: words[k] for k in beats}
                full = int(self.state[2].all()) if op["store"] else None
                sats.append((at + scu.LATENCY, op["store"], self.group, full))
                if op["fresh"]:
                    self.state = scu.fresh(BUILD, op["cols"], op["rows"])
                else:
                    reads += [(at + scu.BLEND_STAGE - 1 + k, low + k) for k in beats]
                    self.state = scu.unpack(BUILD, [buffer[low + k] for k in beats])
                self.group = op["group"]
            else:
                row = np.array([[op[name] for name in BLEND]], np.int64)
                trace = np.zeros(1, np.uint64)
                scu.blend_subtile(BUILD, *self.state, op["x0"], op["y0"], row, trace)
                mask = (1 << params.LANES) - 1
                traces += [(at + scu.BLEND_STAGE + k, (int(trace[0]) >> (params.LANES * k)) & mask) for k in beats]
        return reads, writes, sats, traces

    async def check(self, ops: list[dict]) -> tuple[list, list, list, list]:
        buffer = dict(self.buffer)
        self.send(ops)
        await self.source.drained()
        for _ in range(scu.LATENCY + 2):
            await RisingEdge(self.dut.clk)
        wanted = self.expect(ops, buffer)
        for name, got, want in zip(("reads", "writes", "sats", "traces"), self.logs(), wanted, strict=True):
            assert len(got) == len(want), f"{name}: {len(got)}, want {len(want)}"
            for one, other in zip(got, want, strict=True):
                assert one == other, f"{name}: {one}, want {other}"
        assert self.buffer == buffer
        return wanted

    def logs(self) -> tuple[list, list, list, list]:
        return self.reads, self.writes, self.sats, self.traces


async def bench(dut, *names, stall: str = "none") -> Bench:
    start_clock(dut)
    generator = rng("scu", *names)
    one = Bench(dut, Source(dut, "op", FIELDS, stall), generator)
    one.buffer |= {4 * group + k: word for group in range(16) for k, word in enumerate(any_state(generator))}
    await reset(dut)
    cocotb.start_soon(one.watch())
    return one


def any_state(generator) -> list[int]:
    """A subtile's words: T from 1 to 1.0, sums of colours up to COLOUR_MAX for the rest of it, some pixels done."""
    t, acc, done = scu.fresh(BUILD)
    for at in range(scu.PIXELS):
        t[at] = min(int(2 ** generator.uniform(0, BUILD.t_f + 0.1)), (1 << BUILD.t_f))
        top = int(COLOUR_LIMIT * ((1 << BUILD.t_f) - int(t[at]))) << (BUILD.acc_f - BUILD.t_f)
        acc[:, at] = [generator.randint(0, top) for _ in range(3)]
        done[at] = generator.random() < 0.2
    return scu.pack(BUILD, t, acc, done)


def session(generator, kind: str, blends: int, seed: int) -> list[dict]:
    """Subtiles in turn, fresh and loaded, whole and cut by the picture's edge, with none to some Gaussians each."""
    rows = list(gaussians(blends, seed, *ORIGIN, kind))
    ops = [swap(generator.randrange(16), store=0, fresh=1)]
    while rows:
        n = generator.choice((0, 1, 2, 5, 20))
        ops += [blend(row) for row in rows[:n]]
        rows = rows[n:]
        group = generator.choice([g for g in range(16) if g != ops_group(ops)])
        kind_of_load = generator.random()
        if kind_of_load < 0.3:
            ops.append(swap(group, fresh=1, cols=generator.randint(0, 8), rows=generator.randint(0, 8)))
        else:
            ops.append(swap(group, store=int(kind_of_load < 0.9)))
    return ops


def ops_group(ops: list[dict]) -> int:
    return next(op["group"] for op in reversed(ops) if op["swap"])


@cocotb.test()
@cocotb.parametrize(kind=["mixed", "needle", "huge", "far", "small", "codes"])
async def test_gaussians_of_all_kinds(dut, kind):
    one = await bench(dut, kind)
    _, _, _, traces = await one.check(session(one.generator, kind, 200, seed=21))
    if kind != "codes":
        assert any(mask for _, mask in traces)
    takes = one.source.cycles
    assert takes == list(range(takes[0], takes[0] + params.BEATS * len(takes), params.BEATS))


@cocotb.test()
@cocotb.parametrize(stall=STALLS[1:])
async def test_gaps_between_operations_change_nothing(dut, stall):
    one = await bench(dut, stall, stall=stall)
    await one.check(session(one.generator, "mixed", 200, seed=22))


@cocotb.test()
async def test_ready_again_four_cycles_later_and_at_once_when_idle(dut):
    one = await bench(dut, "ready")
    ops = [swap(3, store=0, fresh=1)]
    ready = []
    one.send(ops)
    for _ in range(20):
        await RisingEdge(dut.clk)
        ready.append((cycle(), int(dut.op_ready.value)))
    taken = one.source.cycles[0]
    assert [value for at, value in ready if at >= taken] == [1, 0, 0, 0] + [1] * (ready[-1][0] - taken - 3)


@cocotb.test()
async def test_a_thousand_faint_layers(dut):
    """Hard case D-S02, and the cycle formula."""
    one = await bench(dut, "faint")
    opacity = BUILD.cut >> (BUILD.power_f - BUILD.opacity_f)
    faint = [*(c << BUILD.mean_f for c in ORIGIN), 0, 0, 0, opacity]
    white = (1 << BUILD.colour_f) - 1
    ops = [swap(0, store=0, fresh=1)]
    ops += [blend([*faint, *[white if n < 500 else 0] * 3]) for n in range(1000)] + [swap(1)]
    _, _, sats, traces = await one.check(ops)
    assert all(mask == (1 << params.LANES) - 1 for _, mask in traces) and len(traces) == 4000
    assert sats[-1][0] - one.source.cycles[0] == scu.cycles(len(ops))


@cocotb.test()
async def test_stop_rule_clamp_and_dead_pixels(dut):
    """Opaque and half opaque layers until all is done; then nothing blends; pixels outside the picture never do."""
    one = await bench(dut, "stop")
    ops = [swap(0, store=0, fresh=1, cols=5, rows=7)]
    one_pixel = 1 << BUILD.chol_f
    clamp = round(-math.log2(0.99) * 2**BUILD.opacity_f)
    for opacity in (0, 1, clamp - 1, clamp, clamp + 1, 1 << BUILD.opacity_f):  # around the clamp at 0.99, and one half
        row = [
            ORIGIN[0] + 4 << BUILD.mean_f,
            ORIGIN[1] + 4 << BUILD.mean_f,
            one_pixel // 524,
            3,
            one_pixel // 524,
            opacity,
            COLOUR_MAX,
            7,
            1 << BUILD.colour_f,
        ]
        ops += [blend(row)] * 30 + [swap(1 + opacity % 7, fresh=1, cols=8, rows=8)]
    _, _, sats, traces = await one.check(ops)
    assert [full for _, stored, _, full in sats if stored] == [1] * 6
    assert traces[0][1] == 0x1F1F and traces[3][1] == 0x001F
    assert traces[4 * 29][1] == 0 and sum(mask == 0 for _, mask in traces) > 200


@cocotb.test()
async def test_one_open_pixel_is_not_saturated(dut):
    one = await bench(dut, "open")
    for at in (0, 15, 16, 37, 63):
        t, acc, done = scu.fresh(BUILD)
        done[:] = 1
        full = scu.pack(BUILD, t, acc, done)
        done[at] = 0
        one.buffer |= dict(enumerate(scu.pack(BUILD, t, acc, done))) | {4 + k: word for k, word in enumerate(full)}
        held = one.group
        one.forget()
        one.group, one.state = held, one.state or scu.fresh(BUILD)
        _, _, sats, _ = await one.check([swap(0, store=0), swap(1), swap(2), swap(3, store=0)])
        assert [sat[3] for sat in sats] == [None, 0, 1, None]


@cocotb.test()
async def test_reset_in_mid_flight(dut):
    """At every distance behind an operation: nothing of it is left, and the ring starts anew."""
    one = await bench(dut, "reset")
    for distance in range(24):
        ops = session(one.generator, "mixed", 5 + distance, seed=distance)
        one.send(ops)
        while len(one.source.cycles) < 4:
            await RisingEdge(dut.clk)
        for _ in range(distance):
            await RisingEdge(dut.clk)
        dut.rst.value = 1
        one.source.clear()
        await reset(dut, cycles=1)
        assert dut.sat_valid.value == dut.trace_valid.value == 0
        one.forget()
        await one.check(session(one.generator, "mixed", 6, seed=100 + distance))
        dut.rst.value = 1
        await reset(dut, cycles=1)
        one.forget()
