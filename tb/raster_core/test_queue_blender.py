"""gs_queue_blender with a tester, features and a resolver made of Python: pixels, and the cycle of every read."""

import cocotb
import numpy as np

from golden import params
from golden.formats import BUILD
from tb.lib.stream import cycle, reset, rng, start_clock
from tb.raster_core.queue_surroundings import UNITS, Bench, Tile
from tb.raster_core.scenes import scene, walls

TOP = "gs_queue_blender"
SLOW = True


def random_batch(
    generator, features, n: int, share: float, groups=range(params.GROUPS), seen=(params.TILE, params.TILE)
) -> tuple[list, list]:
    """n slots, each listed with this probability, whether it touches or not, by the subtiles that begin in `seen`."""
    slots = [generator.randrange(len(features.opacity)) for _ in range(n)]
    hits = []
    for group in range(params.GROUPS):
        order = generator.sample(range(n), n) if group in groups else []
        left = seen[0] - group % 2 * UNITS * params.SUBTILE if group // 2 * params.SUBTILE < seen[1] else 0
        units = [unit for unit in range(UNITS) if unit * params.SUBTILE < left]
        drawn = [(k, sum((generator.random() < share) << unit for unit in units)) for k in order]
        hits.append([push for push in drawn if push[1]])
    return slots, hits


async def run(dut, features, size, tiles: list[Tile], gaps: float = 0.0, clock: bool = True) -> None:
    """clock: behind three cycles of reset; without it a clock runs, and one cycle must do."""
    if clock:
        start_clock(dut)
    dut.cfg_width.value, dut.cfg_height.value = size
    bench = Bench(dut, features, size, gaps)
    for tile in tiles:
        tile.blend(features, size)
    await reset(dut, cycles=3 if clock else 1)
    origin = cycle()
    cocotb.start_soon(bench.observe(origin))
    cocotb.start_soon(bench.push(tiles))
    for tile in tiles:
        await bench.resolve(tile)
    bench.compare(tiles, origin)
    assert bench.used("slot_used") == bench.used("mark_used") == [0] * UNITS


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
    """Single hits in neighbouring groups of many batches: the same subtile again before it is back."""
    generator = rng("again")
    features = walls(12)
    batches = []
    pairs = [groups for g in range(15) for groups in ([g, g + 1], [g])]
    pairs += [groups for g in range(2, 16) for groups in ([g], [g - 2, g - 1, g])]
    for groups in (*(([15], [14, 15], [0, 15], [0], [15]) * 2), *pairs):
        batches.append(random_batch(generator, features, 3, 0.6, groups))
    alone = [random_batch(generator, features, 1, 1.0, groups) for groups in pairs]
    await run(dut, features, (64, 64), [Tile(0, 0, batches), Tile(0, 0, alone)])


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
async def test_lists_of_every_length(dut):
    generator = rng("lengths")
    features = scene(40, 64, 64, seed=3, sigma=4.0)
    slots = [generator.randrange(40) for _ in range(params.CHUNK)]
    lengths = [1 << k for k in range(9)] + [3, 5, 33, 130, 255, 200, 16]
    hits = [[(slot, (1 << UNITS) - 1) for slot in range(n)] for n in lengths]
    await run(dut, features, (64, 64), [Tile(0, 0, [(slots, hits)])])


@cocotb.test(timeout_time=1_000_000, timeout_unit="step")
@cocotb.parametrize(cut=[(20, 13), (45, 38), (59, 1)])
async def test_where_a_picture_ends(dut, cut):
    """The last tile of a row, then the first of the next one, in the far corner."""
    generator = rng("cut", cut)
    far = np.array([8000, 3968])
    features = scene(60, 128, 128, seed=2, sigma=6.0)
    features.mean += far << BUILD.mean_f
    size = tuple((far + 64 + cut).tolist())
    tiles = []
    for corner, shapes in (((64, 0), ((40, 0.2), (9, 0.9))), ((0, 64), ((9, 0.5),)), ((64, 64), ((30, 0.7),))):
        tile = tuple((far + corner).tolist())
        seen = tuple(end - at for end, at in zip(size, tile, strict=True))
        tiles.append(Tile(*tile, [random_batch(generator, features, *shape, seen=seen) for shape in shapes]))
    await run(dut, features, size, tiles)


@cocotb.test(timeout_time=1_000_000, timeout_unit="step")
async def test_a_reset_in_mid_flight_leaves_nothing_behind(dut):
    """500 cycles of hits that change the subtile all the time, then one of reset."""
    noise = rng("noise")
    features = walls(12)
    start_clock(dut)
    bench = Bench(dut, features, (64, 64), 0.0)
    await reset(dut)
    for _ in range(500):
        dut.blend_x.value = dut.blend_y.value = 64
        dut.feature.value = noise.choice(bench.words)
        await bench.step(push_valid=noise.getrandbits(4), close=noise.random() < 0.3)
    batch = random_batch(rng("behind"), features, 5, 0.5)
    await run(dut, features, (64, 64), [Tile(0, 0, [batch]), Tile(0, 0, [batch])], clock=False)


@cocotb.test(timeout_time=1_000_000, timeout_unit="step")
@cocotb.parametrize(size=[(61, 35), (64, 64)])
async def test_done_subtiles_sit_out_until_the_tile_ends(dut, size):
    """Walls finish every subtile; the partial ones too, whose dead pixels count as done."""
    features = walls(10)
    all_units = (1 << UNITS) - 1
    inside = range((size[1] + 7) // 8 * 2)
    hits = [[(k, all_units) for k in range(10)] if group in inside else [] for group in range(params.GROUPS)]
    batch = list(range(10)), hits
    tiles = [Tile(0, 0, [batch] * 3) for _ in range(2)]
    await run(dut, features, size, tiles)
    assert (tiles[0].operations[1] == 0).sum() > 8
