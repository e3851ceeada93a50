"""gs_pixel_resolver: every live pixel once and in order, at one beat a cycle, from a pixel buffer of random states."""

from itertools import product

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden import params
from golden.formats import BUILD
from golden.raster_core import pixel_resolver
from golden.raster_core import subtile_compute_unit as scu
from tb.lib.stream import STALLS, Monitor, Sink, cycle, reset, rng, start_clock

TOP = "gs_pixel_resolver"
SLOW = True
SIZE = (130, 70)
BACKGROUND = (100, BUILD.colour_max, 0)
CORNERS = [(128, 64), (0, 0), (128, 0), (64, 64)]
SIDE = 8
WORD_W = params.LANES * scu.state_w(BUILD)
FIELDS = ("data", "strb", "last", "rgb")


class Buffers:
    """The pixel buffers of the four units, filled with random states; subtiles that are not touched hold noise."""

    def __init__(self, dut, seed, background) -> None:
        self.background = background
        r = np.random.default_rng(seed)
        self.touched = r.random((SIDE, SIDE)) < 0.7
        self.t = r.integers(1, (1 << BUILD.t_f) + 1, (64, 64))
        drop = BUILD.t_f + BUILD.colour_f - BUILD.acc_f
        most = ((1 << BUILD.t_f) - self.t) * max(background) >> drop  # what the layers can have added
        self.acc = (r.random((3, 64, 64)) * most).astype(np.int64)
        noise = rng("noise", seed)
        self.words = {}
        for row in range(SIDE):
            for column in range(SIDE):
                unit, group = column % params.UNITS, row * 2 + column // params.UNITS
                where = slice(row * 8, row * 8 + 8), slice(column * 8, column * 8 + 8)
                if self.touched[row, column]:
                    done = self.t[where].ravel() < BUILD.t_stop
                    packed = scu.pack(BUILD, self.t[where].ravel(), self.acc[:, *where].reshape(3, 64), done)
                else:
                    packed = [noise.getrandbits(WORD_W) for _ in range(params.BEATS)]
                    self.t[where], self.acc[:, *where] = (1 << BUILD.t_f), 0
                for beat, word in enumerate(packed):
                    self.words[unit, group * params.BEATS + beat] = word
        bits = [self.touched[g // 2, (g % 2) * 4 + s] for s in range(params.UNITS) for g in range(params.GROUPS)]
        dut.touched.value = sum(int(bit) << i for i, bit in enumerate(bits))

    def read(self, address: int) -> int:
        return sum(self.words[unit, address] << unit * WORD_W for unit in range(params.UNITS))

    def beats(self, x0: int, y0: int, size: tuple[int, int]) -> list:
        rows, columns = min(64, size[1] - y0), min(64, size[0] - x0)
        value = np.zeros((rows, columns, 3), np.int64)
        for k in range(3):
            for y in range(rows):
                for x in range(columns):
                    value[y, x, k] = scu.resolve(BUILD, int(self.acc[k, y, x]), int(self.t[y, x]), self.background[k])
        return pixel_resolver.beats(BUILD, value, np.vectorize(lambda v: scu.to_8_bit(BUILD, v))(value))


async def serve(dut, buffers: dict, done: list) -> None:
    """The pixel buffers: a word one cycle behind its address, held until the next; and when resolve_done was seen."""
    edge = RisingEdge(dut.clk)
    while True:
        await edge
        if dut.rst.value:
            continue
        if dut.resolve_done.value:
            done.append(cycle())
        if dut.pixel_en.value:
            dut.pixel_words.value = buffers["now"].read(int(dut.pixel_addr.value))


async def run(dut, tiles: list, stall: str) -> None:
    """tiles: (origin, size of the picture, background); a change of background waits for the last pixel."""
    start_clock(dut)
    buffers, done = {}, []
    sink = Sink(dut, "px", FIELDS, stall=stall)
    Monitor(dut, "px", FIELDS)
    dut.resolve_start.value = 0
    cocotb.start_soon(serve(dut, buffers, done))
    await reset(dut)
    want, before = [], None
    for seed, ((x0, y0), size, background) in enumerate(tiles):
        if before not in (None, background):
            await sink.wait(len(want))
        before = background
        dut.cfg_width.value, dut.cfg_height.value = size
        dut.cfg_bg_red.value, dut.cfg_bg_green.value, dut.cfg_bg_blue.value = background
        buffers["now"] = Buffers(dut, seed, background)
        beats = buffers["now"].beats(x0, y0, size)
        assert len(beats) == pixel_resolver.pixel_beats(np.array([(x0, y0)]), *size)[0]
        dut.resolve_x.value, dut.resolve_y.value = x0, y0
        dut.resolve_start.value = 1
        await sink.edge
        start = cycle()
        dut.resolve_start.value = 0
        while len(done) <= seed:
            await sink.edge
        if stall == "none":
            assert done[-1] == start + len(beats) + pixel_resolver.RELEASE - 1
            await sink.wait(len(want) + len(beats))
            first = start + pixel_resolver.DELAY
            assert sink.cycles[len(want) :] == list(range(first, first + len(beats)))
        want += beats
    await sink.wait(len(want))
    for _ in range(10):
        await sink.edge
    assert len(sink.beats) == len(want)
    for at, ((data, strobes, last, rgb), wanted) in enumerate(zip(sink.beats, want, strict=True)):
        data, rgb = pixel_resolver.live(BUILD, data, strobes, rgb)
        assert (data, strobes, last, rgb) == wanted, f"beat {at}"


@cocotb.test()
@cocotb.parametrize(stall=[*STALLS, "after_valid"])
async def test_tiles_at_the_corners_of_a_picture(dut, stall):
    await run(dut, [(corner, SIZE, BACKGROUND) for corner in CORNERS], stall)


@cocotb.test()
async def test_pictures_of_any_size_and_background(dut):
    random = rng("sizes").randrange
    tiles = []
    sizes = ((64, 64), (64, 64), (1, 33), (2, 17), (3, 9), (33, 5), (17, 6), (9, 64), (62, 8), (48, 3), (31, 40))
    for (columns, rows), beyond in product(sizes, (0, 64)):
        origin = 64 * random(120), 64 * random(120)
        size = origin[0] + columns + beyond, origin[1] + rows
        tiles.append((origin, size, tuple(random(BUILD.colour_max + 1) for _ in range(3))))
    await run(dut, tiles, "none")
