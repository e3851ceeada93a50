"""gs_axi_pixel_writer: every live pixel of every tile lands in its place, four a cycle, and nothing else does."""

import cocotb
from cocotb.triggers import RisingEdge

from golden import dma
from tb.lib.axi import AxiMemory, Everywhere
from tb.lib.stream import Monitor, Scoreboard, Sink, Source, reset, rng, stall_pairs, start_clock

TOP = "gs_axi_pixel_writer"
SLOW = True
SIZE = 1 << 17
# width, height, stride, address: whole tiles; a corner of 41 x 6 pixels; rows across 4 KB borders; one pixel
PICTURES = ((128, 64, 512, 256), (169, 70, 688, 16 * 7), (70, 66, 304, 4096 - 48), (65, 65, 272, 0))


def tiles(width: int, height: int) -> list[tuple[int, int]]:
    return [(x, y) for y in range(0, height, 64) for x in range(0, width, 64)]


def beats(picture, x: int, y: int, random, memory: bytearray) -> list[tuple]:
    """px beats of a tile with random pixels, written into memory too."""
    width, height, stride, base = picture
    result = []
    for row in range(y, min(y + 64, height)):
        for column in range(x, min(x + 64, width), 4):
            live = 4 * min(4, width - column)
            data = random.randbytes(16)
            at = base + row * stride + 4 * column
            for k in range(live):
                memory[at + k] = data[k]
            last = row == min(y + 64, height) - 1 and column + 4 >= min(x + 64, width)
            result.append((int.from_bytes(data, "little"), (1 << live) - 1, int(last)))
    return result


async def bench(dut, source_stall="none", sink_stall="none", picture=PICTURES[0], write=20):
    start_clock(dut)
    memory = bytearray(b"\x5a" * SIZE)
    dut.cfg_width.value, dut.cfg_stride.value, dut.cfg_addr.value = picture[0], picture[2], picture[3]
    port = AxiMemory(dut, "m_axi", memory, write=write, stall=sink_stall, seed=source_stall)
    cmd = Source(dut, "cmd", ("x", "y"), stall=source_stall)
    source = Source(dut, "px", ("data", "strb", "last"), stall=source_stall)
    sink = Sink(dut, "done", (), stall=sink_stall)
    Monitor(dut, "done", ())
    await reset(dut)
    return port, memory, cmd, source, sink


@cocotb.test()
@stall_pairs
async def test_every_pixel_lands_in_its_place(dut, source_stall, sink_stall):
    picture = PICTURES[1]
    port, memory, cmd, source, sink = await bench(dut, source_stall, sink_stall, picture)
    random = rng("pixels", source_stall, sink_stall)
    want = bytearray(b"\x5a" * SIZE)
    board = Scoreboard(sink)
    for x, y in [*tiles(*picture[:2]), (128, 64), (128, 64)]:
        cmd.send([(x, y)])
        source.send(beats(picture, x, y, random, want))
        board.expect([()])
    await board.finish()
    assert port.idle() and memory == want and dut.error.value == 0


@cocotb.test()
async def test_tiles_wait_for_the_answers_of_those_before(dut):
    picture = PICTURES[3]
    port, memory, cmd, source, sink = await bench(dut, picture=picture, write=300)
    random, board, want, number = rng("answers"), Scoreboard(sink), bytearray(b"\x5a" * SIZE), 20
    for _ in range(number):
        cmd.send([(64, 64)])
        source.send(beats(picture, 64, 64, random, want))
        board.expect([()])
    await board.finish()
    assert port.idle() and memory == want and len(port.aw) == number


@cocotb.test()
@cocotb.parametrize(number=range(len(PICTURES)), write=[1, 20])
async def test_cycles_equal_golden_and_a_beat_moves_each_cycle(dut, number, write):
    picture = PICTURES[number]
    _port, memory, cmd, source, sink = await bench(dut, picture=picture, write=write)
    random = rng("cycles", number)
    want = bytearray(b"\x5a" * SIZE)
    done, ends, count = [], [], 0
    for x, y in tiles(*picture[:2]) * 2:
        cmd.send([(x, y)])
        await RisingEdge(dut.clk)
        tile = beats(picture, x, y, random, want)
        source.send(tile)
        count += len(tile)
        ends.append(count - 1)
    await sink.wait(len(ends))
    assert source.cycles == list(range(source.cycles[0], source.cycles[0] + count))
    width, height, stride, base = picture
    ports, first = dma.new_ports(), source.cycles[0]
    for (x, y), end in zip(tiles(width, height) * 2, ends, strict=True):
        rows, columns = min(64, height - y), -(-min(64, width - x) // 4)
        at = base + y * stride + 4 * x
        dma.write_pixels(first, rows, columns, at, stride, dma.PIXEL, ports, dma.Latency(write=write))
        first = source.cycles[end] + 1
        done.append(dma.written(first - 1, dma.PIXEL, ports))
    assert sink.cycles == done
    assert memory == want


@cocotb.test()
async def test_addresses_of_32_bits(dut):
    port, _memory, cmd, source, sink = await bench(dut)
    port.memory = memory = Everywhere()
    random, board, want = rng("everywhere"), Scoreboard(sink), Everywhere()
    for _ in range(60):
        x, y = 64 * random.randrange(128), 64 * random.randrange(128)
        picture = x + random.randint(1, 6), y + 3, 16 * random.randint(1 + x // 4, 2047), 16 * random.getrandbits(27)
        dut.cfg_width.value, dut.cfg_stride.value, dut.cfg_addr.value = picture[0], picture[2], picture[3]
        cmd.send([(x, y)])
        source.send(beats(picture, x, y, random, want))
        board.expect([()])
        await board.finish()
    assert memory.written == want.written


@cocotb.test()
async def test_reset_in_flight_forgets_the_tile(dut):
    picture = PICTURES[0]
    _port, memory, cmd, source, sink = await bench(dut, "random", "random", picture)
    random = rng("reset")
    cmd.send(tiles(*picture[:2]))
    source.send(beats(picture, 0, 0, random, bytearray(SIZE)))
    while len(source.cycles) < 100:
        await RisingEdge(dut.clk)
    dut.rst.value = 1
    await RisingEdge(dut.clk)
    cmd.clear()
    source.clear()
    await reset(dut)
    cmd.clear()
    source.clear()
    sink.clear()
    want = bytearray(memory)
    cmd.send([(64, 0)])
    source.send(beats(picture, 64, 0, random, want))
    board = Scoreboard(sink)
    board.expect([()])
    await board.finish()
    assert memory == want


@cocotb.test()
async def test_an_error_answer_is_kept(dut):
    port, _memory, cmd, source, sink = await bench(dut)
    port.answer["b"] = 2
    cmd.send([(0, 0)])
    source.send(beats(PICTURES[0], 0, 0, rng("error"), bytearray(SIZE)))
    await sink.wait(1)
    assert dut.error.value == 1
