"""gs_subtile_blender with lists, features and a resolver made of Python: pixels, phases and their cycles."""

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden import params
from golden.formats import BUILD, narrow
from golden.raster_core import subtile_blender as golden
from golden.raster_core import subtile_compute_unit as scu
from tb.lib.stream import cycle, reset, rng, start_clock
from tb.raster_core import pixel_buffers
from tb.raster_core.scenes import record_words, scene, walls

TOP = "gs_subtile_blender"
SLOW = True
SLOT_W = (params.CHUNK - 1).bit_length()
FEATURE_W = BUILD.geometry_w + 3 * BUILD.colour_w
UNITS = params.UNITS


class Bench:
    """The buffer, tester and resolver around the blender, and the golden state of a tile."""

    def __init__(self, dut, features, size) -> None:
        self.dut, self.features, self.size, self.edge = dut, features, size, RisingEdge(dut.clk)
        self.words = [word & (1 << FEATURE_W) - 1 for word in record_words(features)]
        self.columns = features.mean, features.chol, features.opacity, features.colour
        self.slots: list[int] = []  # Gaussian in each slot of the batch
        self.lists: list[list[int]] = [[]] * UNITS
        self.shown: tuple = ([], [[]] * UNITS)  # slots and lists as the memories hold them
        self.blends, self.random = 0, rng("slots")
        for name in ("blend_valid", "list_valid", "resolve_done", "pixel_en"):
            getattr(dut, name).value = 0
        cocotb.start_soon(self.memories())

    async def memories(self) -> None:
        """Lists and features, one cycle behind their addresses; counts what blends."""
        dut = self.dut
        while True:
            await self.edge
            if dut.rst.value:
                continue
            reading = int(dut.list_en.value)
            assert reading & (reading - 1) == 0, "two units read in one cycle"
            if dut.feature_en.value:
                dut.feature.value = self.words[self.shown[0][int(dut.feature_slot.value)]]
            for unit in range(UNITS):
                if reading >> unit & 1:
                    pos = int(dut.list_pos.value) >> unit * SLOT_W & (1 << SLOT_W) - 1
                    others = self.random.getrandbits(UNITS * SLOT_W) & ~((1 << SLOT_W) - 1 << unit * SLOT_W)
                    dut.list_slot.value = others | self.shown[1][unit][pos] << unit * SLOT_W
            self.shown = self.slots, self.lists
            valid = int(dut.trace_valid.value)
            for unit in range(UNITS):
                if valid >> unit & 1:
                    lanes = int(dut.trace_blend.value) >> unit * params.LANES & (1 << params.LANES) - 1
                    self.blends += lanes.bit_count()

    async def seen(self, signal) -> int:
        """The next cycle in which the signal is high."""
        while True:
            await self.edge
            if signal.value:
                return cycle()

    async def tile(self, x0: int, y0: int, batches: list, origin: int, free: int) -> int:
        """One tile; batches: (Gaussians of the slots, lists [GROUPS][UNITS] of slots). The cycle of resolve_start."""
        dut = self.dut
        state = np.empty((params.SUBTILES, 4, scu.PIXELS), np.int32 if narrow(BUILD) else np.int64)
        golden.fresh_tile(BUILD, state, x0, y0, *self.size)
        held, timed = np.full(UNITS, golden.NONE, np.int64), np.full(UNITS, golden.NONE, np.int64)
        known_done = np.zeros(params.SUBTILES, np.bool_)
        blends = 0
        self.blends = 0
        end = free - 1
        for at, (slots, lists) in enumerate(batches):
            self.slots = slots
            dut.blend_valid.value, dut.blend_n.value, dut.blend_last.value = 1, len(slots), at == len(batches) - 1
            dut.blend_x.value, dut.blend_y.value = x0, y0
            for group in range(params.GROUPS if slots else 0):
                self.lists = lists[group]
                dut.list_valid.value = 1
                dut.list_count.value = sum(len(one) << s * (SLOT_W + 1) for s, one in enumerate(self.lists))
                start = max(end + 1, cycle() + 1)
                counts = []
                for unit, one in enumerate(self.lists):
                    hits = np.array([slots[slot] for slot in one], np.int64)
                    subtile = group * UNITS + unit
                    worked, blended = golden.blend_subtile(
                        BUILD, state, subtile, x0, y0, hits, *self.columns, held, known_done
                    )
                    counts.append(worked)
                    blends += blended
                end = golden.phase_end(start, group, np.array(counts), timed, origin)
                assert await self.seen(dut.list_done) == end, f"batch {at} group {group}"
                assert bool(dut.blend_done.value) == (group == params.GROUPS - 1)
                dut.list_valid.value = 0
            if not slots:
                end = await self.seen(dut.blend_done)
            dut.blend_valid.value = 0
        end = golden.store_end(end + 1, held, origin)
        assert await self.seen(dut.resolve_start) == end
        assert (int(dut.resolve_x.value), int(dut.resolve_y.value)) == (x0, y0)
        await pixel_buffers.compare(dut, state)
        assert self.blends == blends
        return end


def random_batch(
    generator, features, n: int, share: float, seen=(params.TILE, params.TILE), groups=range(params.GROUPS)
) -> tuple[list[int], list]:
    """n slots, each listed with this probability, whether it touches or not, by the subtiles that begin in `seen`."""
    slots = [generator.randrange(len(features.opacity)) for _ in range(n)]
    lists = [[[] for _ in range(UNITS)] for _ in range(params.GROUPS)]
    for group in groups:
        for unit in range(UNITS):
            x, y = params.SUBTILE * (group % 2 * UNITS + unit), params.SUBTILE * (group // 2)
            if x < seen[0] and y < seen[1]:
                lists[group][unit] = [k for k in range(n) if generator.random() < share]
    return slots, lists


async def prepare(dut, features, size) -> tuple[Bench, int]:
    start_clock(dut)
    dut.cfg_width.value, dut.cfg_height.value = size
    bench = Bench(dut, features, size)
    await reset(dut)
    return bench, cycle()


@cocotb.test(timeout_time=500_000, timeout_unit="step")
async def test_random_lists_over_several_tiles(dut):
    """Sparse lists, so that units keep a subtile over groups; a tile without an entry; one of a single entry."""
    generator = rng("lists")
    features = scene(40, 64, 64, seed=1, sigma=6.0)
    bench, origin = await prepare(dut, features, (64, 64))
    batches = [random_batch(generator, features, n, share) for n, share in ((30, 0.1), (12, 0.05), (2, 0.2))]
    await bench.tile(0, 0, batches, origin, origin + 1)
    await bench.tile(0, 0, [([], [])], origin, 0)
    await bench.tile(0, 0, [random_batch(generator, features, 1, 0.5)], origin, 0)


@cocotb.test(timeout_time=2_000_000, timeout_unit="step")
@cocotb.parametrize(cut=[(20, 13), (45, 38), (59, 1), (34, 50), (10, 23)])
async def test_long_lists_where_a_picture_ends(dut, cut):
    """The last tile of a row, then the first of the next one, in the far corner."""
    generator = rng("cut", cut)
    far = np.array([8000, 3968])
    features = scene(300, 128, 128, seed=2, sigma=6.0)
    features.mean += far << BUILD.mean_f
    bench, origin = await prepare(dut, features, tuple((far + 64 + cut).tolist()))
    free = origin + 1
    for corner, batches in (
        ((64, 0), ((256, 0.7), (128, 0.1), (70, 0.9))),
        ((0, 64), ((9, 0.5),)),
        ((64, 64), ((100, 0.7), (0, 0))),
    ):
        tile = tuple((far + corner).tolist())
        seen = tuple(end - at for end, at in zip(bench.size, tile, strict=True))
        batches = [random_batch(generator, features, n, share, seen) for n, share in batches]
        await bench.tile(*tile, batches, origin, free)
        free = 0


@cocotb.test(timeout_time=500_000, timeout_unit="step")
async def test_a_subtile_stays_over_batches(dut):
    generator = rng("stays")
    features = scene(40, 64, 64, seed=3, sigma=6.0)
    bench, origin = await prepare(dut, features, (64, 64))
    order = [group for first in range(8) for group in (first, first, first + 8)]
    batches = [random_batch(generator, features, 3, 0.7, groups=[group]) for group in order]
    await bench.tile(0, 0, batches, origin, origin + 1)


@cocotb.test(timeout_time=500_000, timeout_unit="step")
@cocotb.parametrize(size=[(61, 35), (64, 64)])
async def test_done_subtiles_sit_out_until_the_tile_ends(dut, size):
    """Walls finish every subtile; the partial ones too, whose dead pixels count as done."""
    features = walls(10)
    bench, origin = await prepare(dut, features, size)
    inside = range((size[1] + 7) // 8 * 2)
    lists = [[list(range(10)) if group in inside else []] * UNITS for group in range(params.GROUPS)]
    batch = list(range(10)), lists
    free = origin + 1
    for _ in range(2):
        await bench.tile(0, 0, [batch, batch, batch], origin, free)
        free = 0
