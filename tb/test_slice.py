"""gs_slice in an interconnect's place: one memory behind the ports of cocotbext-axi, a host that writes descriptors.

An example for integrators; tests/test_cosim_slice.py compares many more frames, and their cycles.
"""

import logging
import random

import cocotb
import numpy as np
from cocotbext.axi import AxiBus, AxiRam, AxiRamRead, AxiRamWrite, AxiReadBus, AxiWriteBus
from cocotbext.axi.sparse_memory import SparseMemory

from golden import dma, params, records
from golden.formats import BUILD
from golden.raster_core.raster_core import rasterise
from golden.slice import frame_times, sort_jobs
from tb.lib.stream import SEED, Monitor, Sink, Source, reset, rng, start_clock
from tb.raster_core.scenes import record_words, scene, tiles

TOP = "gs_slice_ports"
SIMULATORS = ("verilator",)
SLOW = True
TILE = ("x", "y", "table_addr", "table_n", "in_addr", "in_n", "scratch_addr", "out_addr")
FAR = (2752, 1344)  # pixel at which the tiles begin that are drawn
SEEN = (250, 66)  # pixels of the picture from there on: two tiles a sort core
WIDTH, HEIGHT = (at + n for at, n in zip(FAR, SEEN, strict=True))
COUNT = 60
BACKGROUND = (100, 512, 1023)
FEATURES, PICTURE, STRIDE = 0xAA55_0000, 0x1234_0000, 12_016
TABLES, REGION = 0x2AAA_AA00, 0x5555_5800  # a tile has four regions: table, incoming, scratch, out
SIZE = 1 << 32


def ports(dut, memory: SparseMemory, stalls: bool) -> None:
    """A memory behind every master; with stalls all channels pause at random."""
    both = [f"sort{c}" for c in range(params.SORT_CORES)] + ["table"]
    reads = [f"insert{c}" for c in range(params.SORT_CORES)] + ["feature"]
    made = [AxiRam(AxiBus.from_prefix(dut, f"m_axi_{n}"), dut.clk, dut.rst, size=SIZE, mem=memory) for n in both]
    sides = [side for ram in made for side in (ram.read_if, ram.write_if)]
    sides += [
        AxiRamRead(AxiReadBus.from_prefix(dut, f"m_axi_{n}"), dut.clk, dut.rst, size=SIZE, mem=memory) for n in reads
    ]
    pixel = AxiWriteBus.from_prefix(dut, "m_axi_pixel")
    sides.append(AxiRamWrite(pixel, dut.clk, dut.rst, size=SIZE, mem=memory))

    def pauses(seed):
        generator = rng("pause", seed)
        while True:
            yield generator.random() < 0.3

    if stalls:
        channels = [
            getattr(side, f"{name}_channel")
            for side in sides
            for name in ("ar", "r", "aw", "w", "b")
            if hasattr(side, f"{name}_channel")
        ]
        for number, channel in enumerate(channels):
            channel.set_pause_generator(pauses(number))


def place(tile: int, region: int) -> int:
    return (TABLES + region * REGION + 0x1000 * tile) % SIZE


def put(memory: SparseMemory, at: int, words: np.ndarray) -> None:
    memory[at : at + BUILD.entry_bytes * len(words)] = records.entry_bytes(BUILD, words).tobytes()


def get(memory: SparseMemory, at: int, n: int) -> np.ndarray:
    return records.entries_from_bytes(BUILD, np.frombuffer(bytes(memory[at : at + BUILD.entry_bytes * n]), np.uint8))


def join(parts: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    return np.concatenate([[0], np.cumsum([len(p) for p in parts])]).astype(np.int64), np.concatenate(parts)


@cocotb.test()
@cocotb.parametrize(stalls=[False, True])
async def test_two_frames_equal_golden(dut, stalls):
    random.seed(SEED)
    logging.getLogger("cocotb.gs_slice_ports").setLevel(logging.WARNING)
    start_clock(dut)
    memory = SparseMemory(SIZE)
    ports(dut, memory, stalls)
    stall = "random" if stalls else "none"
    tile, done = Source(dut, "tile", TILE, stall=stall), Sink(dut, "done", ("n",), stall=stall)
    Monitor(dut, "done", ("n",))
    for name, value in zip(("red", "green", "blue"), BACKGROUND, strict=True):
        getattr(dut, f"cfg_bg_{name}").value = value
    dut.cfg_width.value, dut.cfg_height.value, dut.cfg_first.value = WIDTH, HEIGHT, 256
    dut.cfg_feature_addr.value, dut.cfg_frame_addr.value, dut.cfg_frame_stride.value = FEATURES, PICTURE, STRIDE
    await reset(dut)

    features = scene(COUNT, *SEEN, seed=SEED)
    features.mean += np.array(FAR) << BUILD.mean_f
    origins = tiles(*SEEN) + FAR
    empty = np.zeros(0, np.int64)
    table = [empty] * len(origins)
    incoming = [records.entries(features.key, np.arange(COUNT))[t:] for t in range(len(origins))]
    incoming[2] = empty
    for frame in range(2):
        for index, word in enumerate(record_words(features)):
            at = FEATURES + BUILD.record_bytes * index
            memory[at : at + BUILD.record_bytes] = word.to_bytes(BUILD.record_bytes, "little")
        for t, (x, y) in enumerate(origins.tolist()):
            put(memory, place(t, 0), table[t])
            put(memory, place(t, 1), incoming[t])
            numbers = (place(t, 0), len(table[t]), place(t, 1), len(incoming[t]), place(t, 2), place(t, 3))
            tile.send([(x, y, *numbers)])
        await done.wait(len(origins) * (frame + 1), timeout_cycles=200_000)

        jobs, order = sort_jobs(BUILD, join(table), join(incoming))
        want = rasterise(BUILD, join(order), features, origins, WIDTH, HEIGHT, BACKGROUND)
        lengths = [n for (n,) in done.beats[-len(origins) :]]
        assert lengths == [len(words) for words in order]
        table = [get(memory, place(t, 3), n) for t, n in enumerate(lengths)]
        assert np.array_equal(np.concatenate(table), want.words_out)
        rows = [
            bytes(memory[at : at + STRIDE])
            for at in range(PICTURE + FAR[1] * STRIDE, PICTURE + HEIGHT * STRIDE, STRIDE)
        ]
        words = np.frombuffer(b"".join(rows), np.uint8).reshape(SEEN[1], STRIDE // 4, 4)
        seen = slice(FAR[0], WIDTH)
        assert np.array_equal(words[:, seen, :3], want.rgb8[FAR[1] :, seen])
        assert not np.delete(words, seen, axis=1).any(), "pixels outside of the picture were written"
        assert dut.error.value == 0
        if not stalls:
            bound = frame_times(BUILD, jobs, join(order), want, origins, WIDTH, HEIGHT, dma.Latency(1, 1)).cycles
            cycles = done.cycles[-1] - tile.cycles[-len(origins)]
            assert 0.9 * bound < cycles < 1.2 * bound, "this memory is about as fast as one of latency 1"
        features.key = (features.key + rng("keys").randrange(99)) & (1 << BUILD.key_w) - 1
        incoming = [empty] * len(origins)
