"""gs_late_core on whole tiles: words, tests, blends, pixels, and the cycle of every block's and tile's ends."""

from __future__ import annotations

import os
from itertools import pairwise

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden import params, records
from golden.cameras import default_view, path
from golden.cameras.camera import look_at
from golden.formats import BUILD, VARIABLE
from golden.frame import Renderer, tiles_of
from golden.raster_core import candidate_tester, late_buffer, late_core, late_timing, pixel_resolver
from golden.raster_core.group_finder import mask
from golden.scene import load
from golden.settings import parse
from tb.lib.stream import Monitor, Sink, Source, cycle, four_state, reset, rng, start_clock
from tb.raster_core.scenes import every_entry, record_words, scene, tiles, walls
from tb.raster_core.test_raster_core import PX, UPD, Memory, Timed, some
from tb.raster_core.trace import Trace, expected_pixels

TOP = "gs_late_core"
SLOW = True
BACKGROUND = (100, 512, 1023)
INTERVAL = 3
FOUR_STATE = hasattr(cocotb, "SIM_NAME") and four_state()  # slow: short tables only


def nearly(words, features, seed: int = 0):
    """Entries of a table in an order that is a frame old: stale keys, neighbours exchanged."""
    r = np.random.default_rng(seed)
    index = records.indices_of(words)
    place = np.argsort(np.argsort(features.key[index], kind="stable") + r.normal(0, 20, len(words)))
    return records.entries(r.integers(0, 1 << BUILD.key_w, len(words)), index[place])


def masks(words, features, xy, size) -> np.ndarray:
    """[n] groups that each entry may hit."""
    f = features
    return np.array(
        [
            mask(BUILD, *map(int, f.chol[g]), *map(int, f.mean[g]), int(f.opacity[g]), *map(int, xy), *size)
            for g in records.indices_of(words)
        ],
        np.int64,
    )


def expected(result, lists, features, tile_xy, size, first):
    """(tests, blocks): every (group, slot, hits) in order, every (word, len, last) of the table written back."""
    offsets, words = lists
    tests, blocks = [], []
    for (begin, end), xy in zip(pairwise(offsets), tile_xy, strict=True):
        for at, n in late_buffer.batches(end - begin, first):
            part = slice(begin + at, begin + at + n)
            out = result.words_out[part]
            slot = {int(g): k for k, g in enumerate(records.indices_of(words[part]))}
            order = [slot[int(g)] for g in records.indices_of(out)]
            found = candidate_tester.tests(masks(out, features, xy, size), result.bitmaps[part])
            tests += [(group, order[position], hits) for group, position, hits in found]
            last = int(begin + at + n == end and n < (params.CHUNK if at else first))
            blocks += [(int(word), n, last) for word in records.hardware(BUILD, out)] or [(None, 0, last)]
    return tests, blocks


class Times:
    """The cycles that golden gives for tiles whose entries are offered in the cycles `arrivals`."""

    def __init__(self, result, offsets, features, tile_xy, size, first, origin, arrivals, latency) -> None:
        hits, candidates = late_core.work(BUILD, result, offsets, features, tile_xy, *size, first)
        beats = pixel_resolver.pixel_beats(tile_xy, *size)
        self.taken, self.blocks, self.pixels = [], [], []
        state = late_timing.new_state(origin)
        times, px = np.zeros(late_timing.BATCH_N, np.int64), np.zeros(late_timing.PX_N, np.int64)
        for tile, (begin, end) in enumerate(pairwise(offsets)):
            self.taken.append(late_timing.begin_tile(state, origin + 1, first))
            for k, (at, n) in enumerate(late_buffer.batches(end - begin, first)):
                row = result.batch_offsets[tile] + k if n else 0
                offered = arrivals[begin + tile + at : begin + tile + at + n + 1]
                work = (array[row] if len(array) else np.zeros(array.shape[1:], array.dtype) for array in (
                    hits, result.counts, candidates))  # fmt: skip
                late_timing.step_batch(state, n, offered, latency[begin + at : begin + at + n], INTERVAL, *work, times)
                self.blocks.append((times[late_timing.OUT_FIRST], times[late_timing.OUT_LAST]))
            late_timing.end_tile(state, beats[tile], px)
            self.pixels.append(tuple(px))


async def run(
    dut, features, lists, tile_xy, size, first=params.CHUNK, gaps=0, stall="none", delay=(30, 40), clock=True
):
    """Tiles through the core; compares everything. With `stall` none also every cycle that golden names.

    gaps: cycles between entries; delay: range of the records' latency.
    """
    offsets, words = lists
    result = late_core.rasterise_late(BUILD, lists, features, tile_xy, *size, BACKGROUND, first)
    if clock:
        start_clock(dut)
    else:
        dut.rst.value = 1
    dut.cfg_width.value, dut.cfg_height.value = size
    dut.cfg_bg_red.value, dut.cfg_bg_green.value, dut.cfg_bg_blue.value = BACKGROUND
    dut.cfg_first.value = first
    r = np.random.default_rng(len(words))
    latency = r.integers(*delay, len(words), endpoint=True)
    timed = stall == "none"
    tile_source = Source(dut, "tile", ("x", "y"), stall=stall)
    entry_source = Timed(dut, "entry", ("word", "last")) if timed else Source(dut, "entry", ("word", "last"), stall)
    memory = Memory(dut, record_words(features), latency, INTERVAL, stall)
    upd, px = Sink(dut, "upd", UPD, stall=stall), Sink(dut, "px", PX, stall=stall)
    if not timed:
        for name, fields in (("upd", UPD), ("px", PX), ("feat_req", ("index",))):
            Monitor(dut, name, fields)
    trace = Trace(dut)
    await reset(dut)
    origin = cycle()

    beats = [beat for b, e in pairwise(offsets) for beat in [*((int(w), 0) for w in words[b:e]), (0, 1)]]
    arrivals = origin + 1 + np.cumsum(r.integers(0, 2 * gaps + 1, len(beats)))
    tile_source.send([tuple(map(int, xy)) for xy in tile_xy])
    if timed:
        entry_source.queue.extend((int(c), *beat) for c, beat in zip(arrivals, beats, strict=True))
    else:
        entry_source.send(beats)

    want_tests, want = expected(result, lists, features, tile_xy, size, first)
    pixel_beats = pixel_resolver.pixel_beats(tile_xy, *size)
    limit = (1 if timed else 10) * (10_000 + 40 * len(beats) + 6 * int(result.scu_ops.sum() + pixel_beats.sum()))
    await upd.wait(len(want), timeout_cycles=limit)
    await px.wait(int(pixel_beats.sum()), timeout_cycles=limit)
    for _ in range(50):
        await upd.edge

    assert memory.requests == [int(index) for index in records.indices_of(words)]
    assert trace.tests == want_tests
    assert len(upd.beats) == len(want)
    for at, (got, wanted) in enumerate(zip(upd.beats, want, strict=True)):
        assert all(w is None or g == w for g, w in zip(got, wanted, strict=True)), f"upd {at}: {got}, want {wanted}"
    pixels = []
    for (data, strobes, last), (rgb, done) in zip(px.beats, trace.beats, strict=True):
        assert done == last
        data, rgb = pixel_resolver.live(BUILD, data, strobes, rgb)
        pixels.append((data, strobes, last, rgb))
    assert pixels == expected_pixels(result, tile_xy, *size)
    assert trace.blends == result.blends.sum()
    if timed:
        times = Times(result, offsets, features, tile_xy, size, first, origin, arrivals, latency)
        lengths = [max(1, n) for b, e in pairwise(offsets) for _, n in late_buffer.batches(e - b, first)]
        ends = np.cumsum(lengths)
        cycles, px_ends = np.array(upd.cycles), np.cumsum(pixel_beats)
        assert tile_source.cycles == times.taken
        np.testing.assert_array_equal(np.stack([cycles[ends - lengths], cycles[ends - 1]], axis=1), times.blocks)
        px_cycles = np.array(px.cycles)
        pixels = np.stack([px_cycles[px_ends - pixel_beats], px_cycles[px_ends - 1]], axis=1)
        np.testing.assert_array_equal(pixels, times.pixels)
    return result


def table(features, sizes, seed=0):
    """(offsets, words): tile t lists sizes[t] random Gaussians nearly in the order of their keys."""
    offsets, words = some(features, sizes, seed)
    return offsets, np.concatenate([nearly(words[b:e], features, seed) for b, e in pairwise(offsets)])


@cocotb.test()
@cocotb.parametrize(gaps=[0, 3], first=[params.CHUNK // 2, params.CHUNK])
async def test_short_and_empty_tables_at_the_corners_of_a_picture(dut, gaps, first):
    """130 x 70: tiles of 64, 2 columns and 64, 6 rows; the smallest tables, back to back."""
    features = scene(20, 130, 70, sigma=2.0)
    lists = table(features, [1, 0, 20, 2, 0, 1])
    await run(dut, features, lists, tiles(130, 70), (130, 70), first, gaps)


@cocotb.test(skip=FOUR_STATE)
@cocotb.parametrize(n=[127, 128, 129, 255, 256, 257, 384, 512], first=[params.CHUNK // 2, params.CHUNK])
async def test_tables_around_the_length_of_a_batch(dut, n, first):
    features = scene(n, 64, 64, seed=n, sigma=2.0)
    lists = table(features, [n, 3, n // 2], seed=1)
    await run(dut, features, lists, tiles(192, 64), (192, 64), first, gaps=n % 3)


@cocotb.test(skip=FOUR_STATE)
@cocotb.parametrize(shift=[BUILD.key_w - 2, BUILD.key_w])
async def test_equal_keys_are_ordered_by_index(dut, shift):
    """Four keys, or one only, for all Gaussians."""
    features = scene(400, 64, 64, seed=3, sigma=4.0)
    features.key >>= shift
    await run(dut, features, table(features, [400, 300], seed=4), tiles(128, 64), (128, 64), params.CHUNK // 2)


@cocotb.test(skip=FOUR_STATE)
async def test_done_subtiles_are_skipped(dut):
    """Walls: all is done in the first batch; the second blends only the subtiles that are still held."""
    features = walls(520)
    result = await run(dut, features, every_entry(features, 1), tiles(40, 24), (40, 24))
    assert (result.counts[1] == 0).sum() > 8


@cocotb.test(skip=FOUR_STATE)
async def test_full_queues_hold_the_tests_up(dut):
    """Large footprints hit everything: far more hits than the queues can take."""
    features = scene(300, 64, 64, seed=8, sigma=60.0, opaque=0.0)
    await run(dut, features, table(features, [300, 260], seed=5), tiles(128, 64), (128, 64))


@cocotb.test(skip=FOUR_STATE)
async def test_many_empty_tiles_in_a_row(dut):
    """Only marks in the queues, and tiles that wait for the resolver."""
    features = scene(20, 512, 64, seed=9, sigma=2.0)
    await run(dut, features, table(features, [0, 0, 0, 5, 0, 0, 0, 0], seed=6), tiles(512, 64), (512, 64))


@cocotb.test(skip=FOUR_STATE)
async def test_a_picture_of_tiles(dut):
    """All 6 tiles of 130 x 70 with every Gaussian in each list, most of them without a hit; slow memory."""
    features = scene(300, 130, 70, seed=5, sigma=4.0)
    offsets, words = every_entry(features, 6)
    words = np.concatenate([nearly(words[b:e], features, b) for b, e in pairwise(offsets)])
    await run(dut, features, (offsets, words), tiles(130, 70), (130, 70), delay=(100, 300))


@cocotb.test(skip=FOUR_STATE)
async def test_two_tiles_of_a_moving_room(dut):
    """The longest table and a middling one of the third frame of a walk around the built-in room."""
    room = load("builtin:room?n=6000")
    eye, at, up, fovy = default_view(room)
    size = 320, 192
    settings = parse([f"setting={os.environ.get(VARIABLE, 'reference')}"])
    renderer = Renderer(room, settings, late=True)
    for camera in path("orbit", look_at(eye, at, up, fovy, *size), range(3), 30, 1.0, at, 1.0, 0, up):
        frame = renderer.frame(camera)
    lengths = frame.merged.lengths
    chosen = np.argsort(lengths)[[len(lengths) // 2, -1]]
    assert lengths[chosen].min() > 20
    words = [frame.merged.tile(tile) for tile in chosen]
    lists = np.concatenate(([0], np.cumsum(lengths[chosen]))), np.concatenate(words)
    await run(dut, frame.features, lists, tiles_of(*size)[chosen], size, frame.firsts[-1])


@cocotb.test(skip=FOUR_STATE)
async def test_fast_records(dut):
    """Records close behind their requests."""
    features = scene(300, 64, 64, seed=6, sigma=1.0)
    await run(dut, features, table(features, [300, 256, 0, 1], seed=2), tiles(128, 128), (128, 128), delay=(3, 3))


@cocotb.test()
async def test_a_reset_in_mid_flight_leaves_nothing_behind(dut):
    """2,000 cycles of noise on every input, then a reset, then tiles that come out right and in time."""
    noise = rng("noise")
    start_clock(dut)
    await reset(dut)
    dut.upd_ready.value = dut.px_ready.value = dut.feat_req_ready.value = 1
    dut.cfg_width.value = dut.cfg_height.value = 128
    dut.cfg_first.value = 128
    dut.tile_x.value, dut.tile_y.value = 64, 0
    dut.cfg_bg_red.value = dut.cfg_bg_green.value = dut.cfg_bg_blue.value = 0
    words = record_words(scene(64, 128, 64, seed=9))
    for _ in range(2000):
        for name in ("tile", "entry", "feat"):
            getattr(dut, f"{name}_valid").value = noise.random() < 0.8
        dut.entry_last.value = noise.random() < 0.02
        dut.entry_word.value = noise.getrandbits(BUILD.entry_w)
        dut.feat_record.value = noise.choice(words)
        await RisingEdge(dut.clk)
    features = scene(20, 130, 70, sigma=2.0)
    await run(dut, features, table(features, [4, 0, 20, 2, 0, 1]), tiles(130, 70), (130, 70), clock=False)


@cocotb.test()
@cocotb.parametrize(stall=["three_of_four", "random", "burst"])
async def test_stalls_change_no_data(dut, stall):
    n = 20 if FOUR_STATE else 300
    features = scene(n, 64, 64, seed=7, sigma=2.0)
    lists = table(features, [n, 1, 0, n // 2], seed=3)
    origins = np.array([(0, 0), (64, 0), (0, 64), (64, 64)])
    await run(dut, features, lists, origins, (70, 66), params.CHUNK // 2, stall=stall)
