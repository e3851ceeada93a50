"""gs_raster_lane: tables in memory become pixels and updated tables in memory, in golden's cycles."""

from itertools import pairwise
from typing import NamedTuple

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
COUNT = 200  # Gaussians
REGION = 0x2000  # of a table
BEHIND = bytes(range(1, 17))  # what lies behind a table
SIZE = 1 << 32


class View(NamedTuple):
    """The picture, the pixel at which the tiles begin that are drawn, and where all lies in memory."""

    begin: tuple[int, int]
    size: tuple[int, int]
    background: tuple[int, int, int]
    first: int  # index of the first Gaussian
    features: int
    picture: int
    stride: int
    tables: int


# Each bit that may be 0 and 1 is so in one of them
VIEWS = (
    View((2752, 704), (2822, 770), (341, 682, 1023), 0x55_5500, 0xAAA5_4010, 0x1554_8AB0, 11_312, 0x5555_0AA8),
    View((5376, 3328), (5449, 3449), (2730, 5461, 7168), 0xAA_AA00, 0x555A_BFF8, 0xEAAB_7540, 54_208, 0xAAAA_F550),
)


PORTS = {  # of dma.py, by channel
    "table": {"r": dma.TABLE, "b": dma.DRAWN_TABLE},
    "feature": {"r": dma.FEATURE},
    "pixel": {"b": dma.PIXEL},
}


def table_bytes(words: np.ndarray) -> bytes:
    """A table in whole beats, and what lies behind it."""
    data = records.entry_bytes(BUILD, words).tobytes()
    return data + bytes(-len(data) % dma.BEAT) + BEHIND


async def run(
    dut, lengths: list[int], latency: dma.Latency = dma.LATENCY, stall: str = "none", seed: int = 0, some=range(COUNT),
    view: View = VIEWS[0], failing: tuple[str, str] | None = None,
) -> list[int]:  # fmt: skip
    """Tiles of the picture, over and over, with tables of these lengths; compares memory, and cycles without stalls.

    some: the Gaussians that the tables list. failing: a port and its channel that answers errors. Returns the cycles of
    done.
    """
    start_clock(dut)
    (x_begin, y_begin), (width, height) = view.begin, view.size
    background = tuple(code & (1 << BUILD.colour_w) - 1 for code in view.background)
    seen = width - x_begin, height - y_begin
    features = scene(COUNT, *seen, seed=seed)
    features.mean += np.array(view.begin) << BUILD.mean_f
    memory = SparseMemory(SIZE)
    for index, word in enumerate(record_words(features)):
        at = view.features + BUILD.record_bytes * (view.first + index)
        memory[at : at + BUILD.record_bytes] = word.to_bytes(BUILD.record_bytes, "little")
    ports = [
        AxiMemory(
            dut, f"m_axi_{name}", memory, latency.read, latency.write, stall=stall,
            late=lambda channel, burst, numbers=numbers: int(dma.late(latency, numbers[channel], burst)),
        )
        for name, numbers in PORTS.items()
    ]  # fmt: skip
    for name, port in zip(PORTS, ports, strict=True):
        port.answer |= {channel: 2 for at, channel in [failing or ("", "")] if at == name}
    dut.cfg_width.value, dut.cfg_height.value = width, height
    dut.cfg_bg_red.value, dut.cfg_bg_green.value, dut.cfg_bg_blue.value = background
    dut.cfg_feature_addr.value, dut.cfg_frame_addr.value = view.features, view.picture
    dut.cfg_frame_stride.value = view.stride
    start, done = Source(dut, "start", START, stall=stall), Sink(dut, "done", ("n",), stall=stall)
    Monitor(dut, "done", ("n",))
    trace = Trace(dut)
    await reset(dut)
    origin = cycle()

    random = np.random.default_rng(seed)
    origins = np.array([tiles(*seen)[t % 4] + view.begin for t in range(len(lengths))])
    offsets = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    words = records.entries(random.integers(0, 1 << BUILD.key_w, offsets[-1]), random.choice(some, offsets[-1]))
    parts = [slice(a, b) for a, b in pairwise(offsets)]
    for t, part in enumerate(parts):
        at = view.tables + REGION * t
        table = table_bytes(words[part] + view.first)
        memory[at : at + len(table)] = table
        start.send([(int(origins[t, 0]) // 64, int(origins[t, 1]) // 64, at // 8, lengths[t])])
    await done.wait(len(lengths), timeout_cycles=300_000)

    want = rasterise(BUILD, (offsets, words), features, origins, width, height, background)
    assert [n for (n,) in done.beats] == lengths
    for t, part in enumerate(parts):
        at = view.tables + REGION * t
        table = table_bytes(want.words_out[part] + view.first)
        assert bytes(memory[at : at + len(table)]) == table, t
    alone = [
        rasterise(BUILD, (np.array([0, n]), words[p]), features, xy[None], width, height, background)
        for n, p, xy in zip(lengths, parts, origins, strict=True)
    ]
    assert trace.tests == [
        test for n, result in zip(lengths, alone, strict=True) for test in expected_tests(result, [0, n])
    ]
    pixels = [
        beat
        for xy, result in zip(origins, alone, strict=True)
        for beat in expected_pixels(result, xy[None], width, height)
    ]
    for (rgb, ended), (_, strobes, last, wanted) in zip(trace.beats, pixels, strict=True):
        assert (pixel_resolver.live(BUILD, 0, strobes, rgb)[1], ended) == (wanted, last)
    assert trace.blends == sum(int(result.blends.sum()) for result in alone)
    # The picture is what the last visit of each tile left.
    picture = np.zeros((seen[1], view.stride // 4, 4), np.uint8)
    for (x0, y0), result in zip(origins.tolist(), alone, strict=True):
        rows, columns = slice(y0, min(y0 + params.TILE, height)), slice(x0, min(x0 + params.TILE, width))
        picture[rows.start - y_begin : rows.stop - y_begin, columns, :3] = result.rgb8[rows, columns]
        picture[rows.start - y_begin : rows.stop - y_begin, columns, 3] = 255
    rows = range(view.picture + y_begin * view.stride, view.picture + height * view.stride, view.stride)
    got = b"".join(bytes(memory[at : at + view.stride]) for at in rows)
    assert np.array_equal(np.frombuffer(got, np.uint8).reshape(picture.shape), picture)
    assert all(port.idle() for port in ports) and dut.error.value == (failing is not None)

    if stall == "none":
        state, memory_ports = raster_lane.new_state(origin), dma.new_ports()
        times = np.zeros(raster_lane.TIMES_N, np.int64)
        where = raster_lane.View(
            width, height, view.features, view.picture, view.stride, BUILD.entry_bytes, BUILD.record_bytes
        )
        offered = origin + 1
        for t, part in enumerate(parts):
            counts = want.counts[want.batch_offsets[t] : want.batch_offsets[t + 1]]
            at, xy = view.tables + REGION * t, origins[t]
            raster_lane.step(
                state, offered, words[part] + view.first, at, *xy, counts, where, latency, memory_ports, times
            )
            assert start.cycles[t] == times[raster_lane.START], t
            assert done.cycles[t] == times[raster_lane.DONE], t
            offered = times[raster_lane.START] + 1
    return done.cycles


@cocotb.test()
@cocotb.parametrize(
    (("latency", "view"), list(zip((dma.LATENCY, dma.Latency(1, 1), dma.Latency(200, 300)), (0, 1, 0), strict=True)))
)
async def test_tables_pixels_and_cycles_equal_golden(dut, latency, view):
    await run(dut, [3, 256, 0, 1, 130, 257, 0, 0, 16], latency, view=VIEWS[view])


@cocotb.test()
@cocotb.parametrize(failing=[(port, channel) for port, numbers in PORTS.items() for channel in numbers])
async def test_an_error_of_a_memory_is_told(dut, failing):
    await run(dut, [3, 0], failing=failing)


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
    size, view = BUILD.record_bytes, VIEWS[0]
    split = [
        index for index in range(COUNT) if dma.record_head(view.first + index, size, view.features) < size // dma.BEAT
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
