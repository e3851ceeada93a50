"""gs_raster_core on whole tiles: words, bitmaps, blends, pixels, and the cycle of every block's and tile's ends."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import pairwise

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden import params
from golden.formats import BUILD
from golden.raster_core import batch_buffer, pixel_resolver, timing
from golden.raster_core.raster_core import rasterise
from tb.lib.stream import Monitor, Sink, Source, cycle, four_state, reset, rng, start_clock
from tb.raster_core.scenes import every_entry, record_words, scene, tiles, walls
from tb.raster_core.trace import Trace, expected_pixels, expected_tests

TOP = "gs_raster_core"
SLOW = True
BACKGROUND = (100, 512, 1023)
LATENCY, INTERVAL = 37, 3
FOUR_STATE = hasattr(cocotb, "SIM_NAME") and four_state()  # slow: short tables only
UPD = ("word", "len", "last")
PX = ("data", "strb", "last")


class Timed:
    """Offers each beat from its cycle on, once the one before it has moved."""

    def __init__(self, dut, name: str, fields: tuple[str, ...]) -> None:
        self.valid, self.ready = getattr(dut, f"{name}_valid"), getattr(dut, f"{name}_ready")
        self.fields = [getattr(dut, f"{name}_{field}") for field in fields]
        self.queue: deque = deque()
        self.valid.value = 0
        self.random = rng("timed", name)
        cocotb.start_soon(self._run(RisingEdge(dut.clk)))

    async def _run(self, edge) -> None:
        offered = False
        while True:
            await edge
            if offered and not self.ready.value:
                continue
            offered = bool(self.queue) and self.queue[0][0] <= cycle() + 1
            self.valid.value = offered
            if offered:
                for field, value in zip(self.fields, self.queue.popleft()[1:], strict=True):
                    field.value = value
            else:
                for field in self.fields:
                    field.value = "X" * len(field) if FOUR_STATE else self.random.getrandbits(len(field))


class Memory:
    """Feature records: latency[k] cycles behind request k, at least `interval` apart."""

    def __init__(self, dut, words: list[int], latency: Sequence[int], interval: int, stall: str) -> None:
        self.requests: list[int] = []
        sink = Sink(dut, "feat_req", ("index",), stall=stall)
        source = Timed(dut, "feat", ("record",))

        async def run() -> None:
            done, last = 0, -interval
            while True:
                await sink.edge
                while done < len(sink.beats):
                    last = max(sink.cycles[done] + int(latency[done]), last + interval)
                    source.queue.append((last, words[sink.beats[done][0]]))
                    self.requests.append(sink.beats[done][0])
                    done += 1

        cocotb.start_soon(run())


async def run(
    dut, features, offsets, words, tile_xy, size, gaps=0, stall="none", latency=LATENCY, interval=INTERVAL, clock=True
):
    """Tiles through the core; compares everything. With `stall` none also every cycle that golden names."""
    width, height = size
    result = rasterise(BUILD, (offsets, words), features, tile_xy, width, height, BACKGROUND)
    if clock:
        start_clock(dut)
    else:
        dut.rst.value = 1
    dut.cfg_width.value, dut.cfg_height.value = width, height
    dut.cfg_bg_red.value, dut.cfg_bg_green.value, dut.cfg_bg_blue.value = BACKGROUND
    timed = stall == "none"
    tile_source = Source(dut, "tile", ("x", "y"), stall=stall)
    entry_source = Timed(dut, "entry", ("word", "last")) if timed else Source(dut, "entry", ("word", "last"), stall)
    memory = Memory(dut, record_words(features), [latency] * len(words), interval, stall)
    upd, px = Sink(dut, "upd", UPD, stall=stall), Sink(dut, "px", PX, stall=stall)
    if not timed:
        for name, fields in (("upd", UPD), ("px", PX), ("feat_req", ("index",))):
            Monitor(dut, name, fields)
    trace = Trace(dut)
    await reset(dut)
    origin = cycle()
    state = timing.new_state(origin)

    lists = [[(int(w), 0) for w in words[b:e]] + [(0, 1)] for b, e in pairwise(offsets)]
    r = np.random.default_rng(len(words))
    n = sum(map(len, lists))
    arrivals = origin + 1 + np.cumsum(r.integers(0, 2 * gaps + 1, n))
    tile_source.send([tuple(map(int, xy)) for xy in tile_xy])
    beats = [beat for table in lists for beat in table]
    if timed:
        entry_source.queue.extend((int(c), *beat) for c, beat in zip(arrivals, beats, strict=True))
    else:
        entry_source.send(beats)

    want = [beat for b, e in pairwise(offsets) for beat in batch_buffer.blocks(BUILD, result.words_out[b:e])]
    pixel_beats = timing.pixel_beats(tile_xy, width, height)
    limit = (1 if timed else 10) * (10_000 + 40 * n + 6 * int(result.scu_ops.sum() + pixel_beats.sum()))
    await upd.wait(len(want), timeout_cycles=limit)
    await px.wait(int(pixel_beats.sum()), timeout_cycles=limit)
    for _ in range(50):
        await upd.edge

    assert memory.requests == [w & (1 << params.INDEX_W) - 1 for w, last in beats if not last]
    assert trace.tests == expected_tests(result, offsets)
    assert len(upd.beats) == len(want)
    for at, (got, wanted) in enumerate(zip(upd.beats, want, strict=True)):
        assert all(w is None or g == w for g, w in zip(got, wanted, strict=True)), f"upd {at}: {got}, want {wanted}"
    pixels = []
    for (data, strobes, last), (rgb, done) in zip(px.beats, trace.beats, strict=True):
        assert done == last
        data, rgb = pixel_resolver.live(BUILD, data, strobes, rgb)
        pixels.append((data, strobes, last, rgb))
    assert pixels == expected_pixels(result, tile_xy, width, height)
    assert trace.blends == result.blends.sum()
    if timed:
        blocks = np.diff(offsets) // params.CHUNK + 1
        block_offsets = np.concatenate(([0], np.cumsum(blocks)))
        times = np.zeros((len(tile_xy), timing.TIMES_N), np.int64)
        ends = np.zeros((block_offsets[-1], 2), np.int64)
        timing.timing(
            state, np.asarray(offsets), arrivals, np.full(len(tile_xy), origin + 1), result.batch_offsets,
            result.counts, pixel_beats, latency, interval, times, block_offsets, ends,
        )  # fmt: skip
        lengths = np.array([max(1, length) for _, length, _ in want])
        firsts = [0]
        while firsts[-1] + lengths[firsts[-1]] < len(want):
            firsts.append(firsts[-1] + lengths[firsts[-1]])
        lasts = [first + lengths[first] - 1 for first in firsts]
        cycles = np.array(upd.cycles)
        np.testing.assert_array_equal(tile_source.cycles, times[:, timing.TAKEN])
        np.testing.assert_array_equal(np.stack([cycles[firsts], cycles[lasts]], axis=1), ends)
        px_ends = np.cumsum(pixel_beats)
        np.testing.assert_array_equal(np.array(px.cycles)[px_ends - pixel_beats], times[:, timing.PX_FIRST])
        np.testing.assert_array_equal(np.array(px.cycles)[px_ends - 1], times[:, timing.PX_LAST])
    return result


def some(features, sizes, seed=0):
    """(offsets, words): tile t lists sizes[t] random Gaussians in the order of their keys."""
    r = np.random.default_rng(seed)
    _, words = every_entry(features, 1)
    parts = [words[np.sort(r.choice(len(words), n, replace=False))] for n in sizes]
    return np.concatenate(([0], np.cumsum(sizes))), np.concatenate(parts)


@cocotb.test()
@cocotb.parametrize(gaps=[0, 3])
async def test_short_and_empty_tables_at_the_corners_of_a_picture(dut, gaps):
    """130 x 70: tiles of 64, 2 columns and 64, 6 rows; the smallest tables, back to back."""
    features = scene(20, 130, 70, sigma=2.0)
    offsets, words = some(features, [1, 0, 20, 2, 0, 1])
    await run(dut, features, offsets, words, tiles(130, 70), (130, 70), gaps=gaps)


@cocotb.test(skip=FOUR_STATE)
@cocotb.parametrize(n=[255, 256, 257, 700], gaps=[0, 5])
async def test_tables_around_the_length_of_a_batch(dut, n, gaps):
    features = scene(n, 64, 64, seed=n, sigma=2.0)
    offsets, words = some(features, [n, 3, n // 2], seed=1)
    await run(dut, features, offsets, words, tiles(192, 64), (192, 64), gaps=gaps)


@cocotb.test(skip=FOUR_STATE)
async def test_done_subtiles_are_skipped(dut):
    """Walls: all is done in the first batch; the second blends only the subtiles that are still held."""
    features = walls(520)
    offsets, words = every_entry(features, 1)
    result = await run(dut, features, offsets, words, tiles(40, 24), (40, 24))
    assert (result.counts[1] == 0).sum() > 8


@cocotb.test(skip=FOUR_STATE)
async def test_a_picture_of_tiles(dut):
    """All 6 tiles of 130 x 70 with every Gaussian in each list, most of them without a hit."""
    features = scene(300, 130, 70, seed=5, sigma=4.0)
    await run(dut, features, *every_entry(features, 6), tiles(130, 70), (130, 70), latency=200)


@cocotb.test(skip=FOUR_STATE)
async def test_fast_records(dut):
    """Records as fast as the requests and close behind them."""
    features = scene(300, 64, 64, seed=6, sigma=1.0)
    offsets, words = some(features, [300, 256, 0, 1], seed=2)
    await run(dut, features, offsets, words, tiles(128, 128), (128, 128), latency=3, interval=1)


@cocotb.test()
async def test_a_reset_in_mid_flight_leaves_nothing_behind(dut):
    """2,000 cycles of noise on every input, then a reset, then tiles that come out right and in time."""
    noise = rng("noise")
    start_clock(dut)
    await reset(dut)
    dut.upd_ready.value = dut.px_ready.value = dut.feat_req_ready.value = 1
    dut.cfg_width.value = dut.cfg_height.value = 128
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
    offsets, words = some(features, [4, 0, 20, 2, 0, 1])
    await run(dut, features, offsets, words, tiles(130, 70), (130, 70), clock=False)


@cocotb.test()
@cocotb.parametrize(stall=["three_of_four", "random", "burst"])
async def test_stalls_change_no_data(dut, stall):
    n = 20 if FOUR_STATE else 300
    features = scene(n, 64, 64, seed=7, sigma=2.0)
    offsets, words = some(features, [n, 1, 0, n // 2], seed=3)
    await run(dut, features, offsets, words, np.array([(0, 0), (64, 0), (0, 64), (64, 64)]), (70, 66), stall=stall)
