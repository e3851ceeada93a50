"""gs_raster_lane: tables in memory become pixels and updated tables in memory, in golden's cycles."""

from itertools import pairwise

import cocotb
import numpy as np
from cocotbext.axi.sparse_memory import SparseMemory

from golden import dma, params, records
from golden.formats import BUILD
from golden.raster_core import pixel_resolver, raster_lane
from golden.raster_core.raster_core import rasterise
from tb.lib.axi import AxiMemory
from tb.lib.stream import Monitor, Sink, Source, cycle, reset, start_clock
from tb.raster_core.scenes import record_words, scene, tiles
from tb.raster_core.trace import Trace, expected_pixels, expected_tests

TOP = "gs_raster_lane"
SIMULATORS = ("verilator",)
SLOW = True
START = ("column", "row", "line", "n")
BACKGROUND = (341, 682, 1023)
FAR = (2752, 704)  # pixel at which the tiles begin that are drawn
SEEN, COUNT = (70, 66), 200  # pixels of the picture from there on
WIDTH, HEIGHT = (at + n for at, n in zip(FAR, SEEN, strict=True))
FEATURES, PICTURE, STRIDE, TABLES, REGION = 0xAAA5_4000, 0x1554_8AB0, 11_312, 0x5555_0AA8, 0x2000
SIZE = 1 << 32


PORTS = {  # of dma.py, by channel
    "table": {"r": dma.TABLE, "b": dma.DRAWN_TABLE},
    "feature": {"r": dma.FEATURE},
    "pixel": {"b": dma.PIXEL},
}


async def run(
    dut, lengths: list[int], latency: dma.Latency = dma.LATENCY, stall: str = "none", seed: int = 0, some=range(COUNT)
) -> list[int]:
    """Tiles of the picture, over and over, with tables of these lengths; compares memory, and cycles without stalls.

    some: the Gaussians that the tables list. Returns the cycles of done.
    """
    start_clock(dut)
    features = scene(COUNT, *SEEN, seed=seed)
    features.mean += np.array(FAR) << BUILD.mean_f
    memory = SparseMemory(SIZE)
    for index, word in enumerate(record_words(features)):
        at = FEATURES + BUILD.record_bytes * index
        memory[at : at + BUILD.record_bytes] = word.to_bytes(BUILD.record_bytes, "little")
    ports = [
        AxiMemory(
            dut, f"m_axi_{name}", memory, latency.read, latency.write, stall=stall,
            late=lambda channel, burst, numbers=numbers: int(dma.late(latency, numbers[channel], burst)),
        )
        for name, numbers in PORTS.items()
    ]  # fmt: skip
    dut.cfg_width.value, dut.cfg_height.value = WIDTH, HEIGHT
    dut.cfg_bg_red.value, dut.cfg_bg_green.value, dut.cfg_bg_blue.value = BACKGROUND
    dut.cfg_feature_addr.value, dut.cfg_frame_addr.value, dut.cfg_frame_stride.value = FEATURES, PICTURE, STRIDE
    start, done = Source(dut, "start", START, stall=stall), Sink(dut, "done", ("n",), stall=stall)
    Monitor(dut, "done", ("n",))
    trace = Trace(dut)
    await reset(dut)
    origin = cycle()

    random = np.random.default_rng(seed)
    origins = np.array([tiles(*SEEN)[t % 4] + FAR for t in range(len(lengths))])
    offsets = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    words = records.entries(np.zeros(offsets[-1], np.int64), random.choice(some, offsets[-1]))
    parts = [slice(a, b) for a, b in pairwise(offsets)]
    for t, part in enumerate(parts):
        at = TABLES + REGION * t
        memory[at : at + BUILD.entry_bytes * lengths[t]] = records.entry_bytes(BUILD, words[part]).tobytes()
        start.send([(int(origins[t, 0]) // 64, int(origins[t, 1]) // 64, at // 8, lengths[t])])
    await done.wait(len(lengths), timeout_cycles=300_000)

    want = rasterise(BUILD, (offsets, words), features, origins, WIDTH, HEIGHT, BACKGROUND)
    assert [n for (n,) in done.beats] == lengths
    for t, part in enumerate(parts):
        at = TABLES + REGION * t
        data = bytes(memory[at : at + BUILD.entry_bytes * lengths[t]])
        got = records.entries_from_bytes(BUILD, np.frombuffer(data, np.uint8))
        assert np.array_equal(got, want.words_out[part]), t
    alone = [
        rasterise(BUILD, (np.array([0, n]), words[p]), features, xy[None], WIDTH, HEIGHT, BACKGROUND)
        for n, p, xy in zip(lengths, parts, origins, strict=True)
    ]
    assert trace.tests == [
        test for n, result in zip(lengths, alone, strict=True) for test in expected_tests(result, [0, n])
    ]
    pixels = [
        beat
        for xy, result in zip(origins, alone, strict=True)
        for beat in expected_pixels(result, xy[None], WIDTH, HEIGHT)
    ]
    for (rgb, ended), (_, strobes, last, wanted) in zip(trace.beats, pixels, strict=True):
        assert (pixel_resolver.live(BUILD, 0, strobes, rgb)[1], ended) == (wanted, last)
    assert trace.blends == sum(int(result.blends.sum()) for result in alone)
    # The picture is what the last visit of each tile left.
    picture = np.zeros((SEEN[1], STRIDE // 4, 4), np.uint8)
    for (x0, y0), result in zip(origins.tolist(), alone, strict=True):
        rows, columns = slice(y0, min(y0 + params.TILE, HEIGHT)), slice(x0, min(x0 + params.TILE, WIDTH))
        picture[rows.start - FAR[1] : rows.stop - FAR[1], columns, :3] = result.rgb8[rows, columns]
        picture[rows.start - FAR[1] : rows.stop - FAR[1], columns, 3] = 255
    rows = [
        bytes(memory[at : at + STRIDE]) for at in range(PICTURE + FAR[1] * STRIDE, PICTURE + HEIGHT * STRIDE, STRIDE)
    ]
    assert np.array_equal(np.frombuffer(b"".join(rows), np.uint8).reshape(picture.shape), picture)
    assert all(port.idle() for port in ports) and dut.error.value == 0

    if stall == "none":
        state, memory_ports = raster_lane.new_state(origin), dma.new_ports()
        times = np.zeros(raster_lane.TIMES_N, np.int64)
        view = raster_lane.View(WIDTH, HEIGHT, FEATURES, PICTURE, STRIDE, BUILD.entry_bytes, BUILD.record_bytes)
        offered = origin + 1
        for t, part in enumerate(parts):
            counts = want.counts[want.batch_offsets[t] : want.batch_offsets[t + 1]]
            at, xy = TABLES + REGION * t, origins[t]
            raster_lane.step(state, offered, words[part], at, *xy, counts, view, latency, memory_ports, times)
            assert start.cycles[t] == times[raster_lane.START], t
            assert done.cycles[t] == times[raster_lane.DONE], t
            offered = times[raster_lane.START] + 1
    return done.cycles


@cocotb.test()
@cocotb.parametrize(latency=[dma.LATENCY, dma.Latency(1, 1), dma.Latency(200, 300)])
async def test_tables_pixels_and_cycles_equal_golden(dut, latency):
    await run(dut, [3, 256, 0, 1, 130, 257, 0, 0, 16], latency)


@cocotb.test()
@cocotb.parametrize(jitter=[9, 300], seed=[1, 2])
async def test_cycles_equal_golden_when_answers_are_late_at_random(dut, jitter, seed):
    await run(dut, [3, 256, 0, 1, 130, 0, 0, 257, 0, 16], dma.Latency(5, 5, jitter, seed))


@cocotb.test()
async def test_a_done_waits_for_the_done_before_it(dut):
    """An empty table behind one that is answered late: two dones in two cycles."""
    cycles = await run(dut, [0, 0, 1, 0] * 4, dma.Latency(5, 5, 300, 21))
    assert 1 in np.diff(cycles)


@cocotb.test()
async def test_cycles_equal_golden_when_every_record_needs_two_bursts(dut):
    """The queue of requests fills, and entries wait for it."""
    split = [
        index
        for index in range(COUNT)
        if dma.record_head(index, BUILD.record_bytes, FEATURES) < BUILD.record_bytes // dma.BEAT
    ]
    await run(dut, [255, 3, 300, 0, 513, 1], dma.Latency(1, 1), some=split)


@cocotb.test()
async def test_many_empty_tiles_wait_for_their_responses(dut):
    """More tiles than may lie between start and done, each faster than the memory answers."""
    await run(dut, [0] * 20, dma.Latency(1, 3000))


@cocotb.test()
@cocotb.parametrize(stall=["random", "burst"])
async def test_stalls_change_no_entry_and_no_pixel(dut, stall):
    await run(dut, [3, 256, 0, 1, 60], stall=stall)
