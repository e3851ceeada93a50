"""gs_queue_blender with a tester, features and a resolver made of Python: pixels, and the cycle of every read."""

from collections import deque

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden import params
from golden.formats import BUILD, narrow
from golden.raster_core import queue_blender as golden
from golden.raster_core import subtile_blender
from golden.raster_core import subtile_compute_unit as scu
from golden.raster_core.hit_queue import MARK_DELAY
from tb.lib.stream import cycle, reset, rng, start_clock
from tb.raster_core.scenes import record_words, scene, walls

TOP = "gs_queue_blender"
SLOW = True
FEATURE_W = BUILD.geometry_w + 3 * BUILD.colour_w
WORD_W = params.LANES * scu.state_w(BUILD)
UNITS = params.UNITS
BANKS = 3


class Tile:
    """What to blend. batches: (Gaussians of the slots, hits [GROUPS] of (slot, units)); the last one may be empty."""

    def __init__(self, x0: int, y0: int, batches: list) -> None:
        self.x0, self.y0, self.batches = x0, y0, batches
        self.hits: list = []  # of each batch: [GROUPS, UNITS] hits
        self.operations: list = []
        self.blends = 0
        self.state = np.empty((params.SUBTILES, 4, scu.PIXELS), np.int32 if narrow(BUILD) else np.int64)

    def blend(self, features, size) -> None:
        """Everything that does not depend on time."""
        subtile_blender.fresh_tile(BUILD, self.state, self.x0, self.y0, *size)
        held = np.full(UNITS, subtile_blender.NONE, np.int64)
        known_done = np.zeros(params.SUBTILES, np.bool_)
        columns = features.mean, features.chol, features.opacity, features.colour
        for slots, groups in self.batches:
            hits, operations = np.zeros((2, params.GROUPS, UNITS), np.int64)
            for group, pushes in enumerate(groups):
                for unit in range(UNITS):
                    listed = np.array([slots[slot] for slot, units in pushes if units >> unit & 1], np.int64)
                    hits[group, unit] = len(listed)
                    operations[group, unit], blends = subtile_blender.blend_subtile(
                        BUILD, self.state, group * UNITS + unit, self.x0, self.y0, listed, *columns, held, known_done
                    )
                    self.blends += blends
            self.hits.append(hits)
            self.operations.append(operations)


class Bench:
    """What surrounds the blender, and what it was seen to do."""

    def __init__(self, dut, features, size, gaps: float) -> None:
        self.dut, self.features, self.edge = dut, features, RisingEdge(dut.clk)
        self.words = [word & (1 << FEATURE_W) - 1 for word in record_words(features)]
        self.size, self.gaps, self.random = size, gaps, rng("push", gaps)
        self.banks: list = [[]] * BANKS
        self.open: deque = deque()  # origins of the batches that are not blended
        self.closes: list[int] = []
        self.blended: list[int] = []
        self.stored: list[int] = []
        self.resolved: list[int] = []
        self.reads: list[list] = [[] for _ in range(UNITS)]  # (cycle of the issue, bank, slot)
        self.blends = 0
        for name in ("push_valid", "close", "resolve_done", "pixel_en"):
            getattr(dut, name).value = 0

    async def observe(self, origin: int) -> None:
        """Features one cycle behind their addresses, the blended batches, the cycles of everything."""
        dut = self.dut
        while True:
            dut.blend_x.value, dut.blend_y.value = self.open[0] if self.open else (self.random.getrandbits(13), 77)
            await self.edge
            if dut.feature_en.value:
                bank, slot = int(dut.feature_bank.value), int(dut.feature_slot.value)
                self.reads[(cycle() - 1 - origin) % UNITS].append((cycle() - 1, bank, slot))
                dut.feature.value = self.words[self.banks[bank][slot]]
            else:
                dut.feature.value = self.random.getrandbits(FEATURE_W)
            if dut.blend_done.value:
                self.blended.append(cycle())
                self.open.popleft()
            if dut.resolve_start.value:
                self.stored.append(cycle())
            valid = int(dut.trace_valid.value)
            lanes = int(dut.trace_blend.value) if valid else 0
            for unit in range(UNITS):
                if valid >> unit & 1:
                    self.blends += (lanes >> unit * params.LANES & (1 << params.LANES) - 1).bit_count()

    async def step(self, **values) -> None:
        """A cycle with these inputs of the tester."""
        for name in ("push_valid", "close", "close_end", "close_void"):
            getattr(self.dut, name).value = values.get(name, 0)
        self.dut.push_slot.value = values.get("push_slot", self.random.getrandbits(8))
        await self.edge
        self.dut.push_valid.value = self.dut.close.value = 0

    async def idle(self) -> None:
        while self.random.random() < self.gaps:
            await self.edge

    def room(self, n: int) -> bool:
        """Is there room for a list of n slots, if those that left in the last cycle still count?"""
        used = ((self.dut.slot_used, params.QUEUE - n), (self.dut.mark_used, params.MARKS - 1))
        for signal, most in used:
            width = len(signal) // UNITS
            value = int(signal.value)
            if any((value >> unit * width & (1 << width) - 1) > most for unit in range(UNITS)):
                return False
        return True

    async def push(self, tiles: list[Tile]) -> None:
        """Hits as the tester gives them: a group once all queues have room for it, a batch once there is a bank."""
        at = 0
        for tile in tiles:
            for k, (slots, groups) in enumerate(tile.batches):
                while len(self.open) == BANKS:
                    await self.edge
                self.banks[at % BANKS] = slots
                self.open.append((tile.x0, tile.y0))
                at += 1
                last = k == len(tile.batches) - 1
                for group, pushes in enumerate(groups if slots else [[]]):
                    while not self.room(len(pushes)):
                        await self.edge
                    for slot, valid in pushes:
                        await self.idle()
                        await self.step(push_valid=valid, push_slot=slot)
                    await self.idle()
                    end = last and (not slots or group == params.GROUPS - 1)
                    await self.step(close=1, close_end=int(end), close_void=int(not slots))
                    self.closes.append(cycle())

    async def resolve(self, tile: Tile) -> None:
        """Reads the pixel buffers of a tile as the resolver does, and frees them."""
        dut, state = self.dut, tile.state
        while not dut.resolve_start.value:
            await self.edge
        assert (int(dut.resolve_x.value), int(dut.resolve_y.value)) == (tile.x0, tile.y0)
        assert self.blends == tile.blends
        self.blends = 0
        touched = int(dut.touched.value)
        dead = state[:, 0] == subtile_blender.DEAD_T
        for word_at in range(params.GROUPS * params.BEATS):
            group, beat = divmod(word_at, params.BEATS)
            dut.pixel_en.value, dut.pixel_addr.value = 1, word_at
            await self.edge
            dut.pixel_en.value = 0
            await self.edge
            words = dut.pixel_words.value
            for unit in range(UNITS):
                subtile = group * UNITS + unit
                lanes = slice(beat * params.LANES, (beat + 1) * params.LANES)
                if touched >> unit * params.GROUPS + group & 1:
                    word = int(words[unit * WORD_W + WORD_W - 1 : unit * WORD_W])
                    t, acc, done = (field[..., : params.LANES] for field in scu.unpack(BUILD, [word] * params.BEATS))
                    live = ~dead[subtile, lanes]
                    np.testing.assert_array_equal(t[live], state[subtile, 0, lanes][live])
                    np.testing.assert_array_equal(acc[:, live], state[subtile, 1:, lanes][:, live])
                    stopped = state[subtile, 0, lanes] < BUILD.t_stop
                    np.testing.assert_array_equal(done.astype(bool), stopped)
                else:
                    assert (state[subtile, 1:, lanes] == 0).all()
        dut.resolve_done.value = 1
        await self.edge
        self.resolved.append(cycle())
        dut.resolve_done.value = 0

    def compare(self, tiles: list[Tile], origin: int) -> None:
        """The cycles seen are those of golden; every unit read its lists, bank by bank."""
        units = golden.new_units(origin)
        reads: list[list] = [[] for _ in range(UNITS)]
        marks = iter(close + MARK_DELAY for close in self.closes)
        blended, stored, batch = [], [], 0
        for at, tile in enumerate(tiles):
            for (slots, groups), hits, operations in zip(tile.batches, tile.hits, tile.operations, strict=True):
                ends = []
                for group, pushes in enumerate(groups if slots else [[]]):
                    mark = next(marks)
                    ends = []
                    for unit in range(UNITS):
                        n, worked = int(hits[group, unit]), int(operations[group, unit])
                        ends.append(golden.blend_list(units, unit, group, n, worked, mark, origin))
                        listed = [slot for slot, valid in pushes if valid >> unit & 1] if worked else []
                        for k, slot in enumerate(listed):
                            number = units[unit, golden.SLOTS] - n + k + 1
                            reads[unit].append((golden.left(units, unit, number), batch % BANKS, slot))
                blended.append(max(ends) + 1)
                batch += 1
            stored.append(golden.store_end(units, origin))
            golden.next_tile(units, stored[-1], self.resolved[at] - stored[-1] - golden.RELEASE + 1)
        assert self.stored == stored
        assert self.blended == blended
        assert self.reads == reads


def random_batch(generator, features, n: int, share: float, groups=range(params.GROUPS)) -> tuple[list, list]:
    """n slots; each is listed by a unit of a group with this probability, whether it touches the subtile or not."""
    slots = [generator.randrange(len(features.opacity)) for _ in range(n)]
    hits = []
    for group in range(params.GROUPS):
        order = generator.sample(range(n), n) if group in groups else []
        drawn = [(k, sum((generator.random() < share) << unit for unit in range(UNITS))) for k in order]
        hits.append([push for push in drawn if push[1]])
    return slots, hits


async def run(dut, features, size, tiles: list[Tile], gaps: float = 0.0) -> None:
    start_clock(dut)
    dut.cfg_width.value, dut.cfg_height.value = size
    bench = Bench(dut, features, size, gaps)
    for tile in tiles:
        tile.blend(features, size)
    await reset(dut)
    origin = cycle()
    cocotb.start_soon(bench.observe(origin))
    cocotb.start_soon(bench.push(tiles))
    for tile in tiles:
        await bench.resolve(tile)
    bench.compare(tiles, origin)


@cocotb.test(timeout_time=1_000_000, timeout_unit="step")
@cocotb.parametrize(gaps=[0.0, 0.7])
async def test_random_lists_over_several_tiles(dut, gaps):
    """Sparse lists, so that units keep a subtile over groups and run ahead; tiles of few hits and of none."""
    generator = rng("lists", gaps)
    features = scene(40, 64, 64, seed=1, sigma=6.0)
    shapes = ((30, 0.1), (12, 0.05), (40, 0.02), (2, 0.2), (25, 0.1))
    batches = [random_batch(generator, features, n, share) for n, share in shapes]
    empty: tuple = ([], [])
    alone = random_batch(generator, features, 1, 0.5)
    tiles = [Tile(0, 0, batches), Tile(0, 0, [empty]), Tile(0, 0, [alone, empty]), Tile(0, 0, [alone])]
    await run(dut, features, (64, 64), tiles, gaps)


@cocotb.test(timeout_time=1_000_000, timeout_unit="step")
async def test_a_subtile_on_its_way_out_is_waited_for(dut):
    """Single hits in the last and the first groups of many batches: the same subtile again before it is back."""
    generator = rng("again")
    features = walls(12)
    batches = []
    for groups in ([15], [14, 15], [0, 15], [0], [15], [1, 2], [2, 3]) * 2:
        batches.append(random_batch(generator, features, 3, 0.6, groups))
    await run(dut, features, (64, 64), [Tile(0, 0, batches)] * 1)


@cocotb.test(timeout_time=1_000_000, timeout_unit="step")
async def test_queues_without_room_lose_nothing(dut):
    """Full lists in one unit at a time: the others run ahead over their empty ones."""
    generator = rng("full")
    features = scene(40, 64, 64, seed=2, sigma=2.0)
    slots = [generator.randrange(40) for _ in range(params.CHUNK)]
    hits: list = [[] for _ in range(params.GROUPS)]
    for group in (0, 1, 2, 3, 9):
        hits[group] = [(k, 1 << generator.randrange(2) | 4 * (k % 64 == 0)) for k in range(params.CHUNK)]
    await run(dut, features, (64, 64), [Tile(0, 0, [(slots, hits), (slots, hits)])])


@cocotb.test(timeout_time=1_000_000, timeout_unit="step")
async def test_done_subtiles_sit_out_until_the_tile_ends(dut):
    """Walls finish every subtile; the partial ones too, whose dead pixels count as done."""
    features = walls(10)
    size = (61, 35)
    all_units = (1 << UNITS) - 1
    inside = range((35 + 7) // 8 * 2)
    hits = [[(k, all_units) for k in range(10)] if group in inside else [] for group in range(params.GROUPS)]
    batch = list(range(10)), hits
    tiles = [Tile(0, 0, [batch] * 3) for _ in range(2)]
    await run(dut, features, size, tiles)
    assert (tiles[0].operations[1] == 0).sum() > 8
