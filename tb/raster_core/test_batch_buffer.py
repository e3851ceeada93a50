"""gs_batch_buffer between sources, sinks, and a tester and blender made of random numbers."""

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden import params, records
from golden.formats import BUILD
from golden.raster_core import batch_buffer
from tb.lib.lists import send_apart
from tb.lib.stream import STALLS, Monitor, Sink, Source, cycle, reset, rng, start_clock
from tb.raster_core.scenes import record_words, scene

TOP = "gs_batch_buffer"
SLOW = True
GROUPS = 3  # the buffer learns from hit_first and hit_last where a batch's groups begin and end
FEATURE_W = BUILD.geometry_w + 3 * BUILD.colour_w
LATENCY = 9


class Bench:
    """Tables of known words; what the tester is told to find; what the buffer gives back."""

    def __init__(self, dut, lengths: list[int], seed: str) -> None:
        self.dut, self.random, self.edge = dut, rng("buffer", seed), RisingEdge(dut.clk)
        self.lengths = lengths
        n = sum(lengths) + 1
        features = scene(n, 64, 64)
        self.records = record_words(features)
        order = np.random.default_rng(len(seed)).permutation(n)
        words = records.entries(np.zeros(n, np.int64), order)
        self.hit = np.array([self.random.random() < 0.5 for _ in range(n)])
        self.batches, self.entries, self.want, self.requests = [], [], [], []
        first = 0
        for tile, length in enumerate(lengths):
            table = words[first : first + length]
            indices = records.indices_of(table)
            updated = batch_buffer.updated(table, features.key[indices], self.hit[first : first + length])
            self.want += batch_buffer.blocks(BUILD, updated)
            self.entries += [(int(word), 0) for word in table] + [(None, 1)]
            self.requests += indices.tolist()
            for at, m in batch_buffer.batches(length):
                hit = self.hit[first + at : first + at + m]
                self.batches.append((tile, indices[at : at + m].tolist(), hit, m < params.CHUNK))
            first += length
        self.tile_xy = [(64 * t, 4096 - 64 * t) for t in range(len(lengths))]
        self.tested: list[int] = []  # cycle of the last hit of each batch
        dut.test_issued.value = dut.hit_valid.value = dut.blend_done.value = 0
        dut.geometry_en.value = dut.feature_en.value = 0

    async def records_come(self, sink: Sink, source: Source) -> None:
        """LATENCY cycles behind the requests."""
        done = 0
        while True:
            await self.edge
            while done < len(sink.beats) and sink.cycles[done] + LATENCY - 2 <= cycle():
                source.send([(self.records[sink.beats[done][0]],)])
                done += 1

    async def valid(self, signal, patience: int) -> None:
        """Until the edge behind which the signal is seen high, and some cycles more."""
        while True:
            await self.edge
            if signal.value:
                break
        for _ in range(self.random.randrange(patience + 1)):
            await self.edge

    async def test(self, patience: int) -> None:
        """The tester: checks the batch and its geometry, and reports hits that add up to those wanted."""
        dut = self.dut
        for tile, indices, hit, _ in self.batches:
            await self.valid(dut.test_valid, patience)
            n = len(indices)
            assert (int(dut.test_n.value), int(dut.test_x.value), int(dut.test_y.value)) == (n, *self.tile_xy[tile])
            for slot in range(n):
                dut.geometry_en.value, dut.geometry_slot.value = 1, slot
                await self.edge
                dut.geometry_en.value = 0
                if slot % 16 == 0:
                    await self.edge
                    geometry = self.records[indices[slot]] & (1 << BUILD.geometry_w) - 1
                    assert int(dut.geometry.value) == geometry, f"tile {tile} slot {slot}"
            dut.test_issued.value = 1
            await self.edge
            dut.test_issued.value = 0
            lucky = [self.random.randrange(GROUPS) for _ in range(n)]
            for group in range(GROUPS):
                for slot in range(n):
                    dut.hit_valid.value, dut.hit_slot.value = 1, slot
                    dut.hit_first.value = group == 0
                    dut.hit_last.value = group == GROUPS - 1 and slot == n - 1
                    dut.hit_any.value = bool(hit[slot]) and group == lucky[slot]
                    await self.edge
                dut.hit_valid.value = 0
                dut.hit_last.value = 0
                if n and group == GROUPS - 1:
                    self.tested.append(cycle())
                await self.edge

    async def blend(self, patience: int) -> None:
        """The blender: checks the batch and some of its features."""
        dut = self.dut
        for tile, indices, _, last in self.batches:
            await self.valid(dut.blend_valid, patience)
            n = len(indices)
            assert (int(dut.blend_n.value), int(dut.blend_last.value)) == (n, last)
            assert (int(dut.blend_x.value), int(dut.blend_y.value)) == self.tile_xy[tile]
            for _ in range(min(n, 10)):
                slot = self.random.randrange(n)
                dut.feature_en.value, dut.feature_slot.value = 1, slot
                await self.edge
                dut.feature_en.value = 0
                await self.edge
                feature = self.records[indices[slot]] & (1 << FEATURE_W) - 1
                assert int(dut.feature.value) == feature, f"tile {tile} slot {slot}"
            dut.blend_done.value = 1
            await self.edge
            dut.blend_done.value = 0


async def check(dut, bench: Bench, stall: str, patience: int, apart: bool = False) -> Sink:
    """Everything comes back, in order."""
    start_clock(dut)
    Source(dut, "tile", ("x", "y"), stall=stall).send(bench.tile_xy)
    entries = Source(dut, "entry", ("word", "last"), stall=stall)
    requests = Sink(dut, "feat_req", ("index",), stall=stall)
    feat = Source(dut, "feat", ("record",), stall=stall)
    upd = Sink(dut, "upd", ("word", "len", "last"), stall=stall)
    for name, fields in (("upd", ("word", "len", "last")), ("feat_req", ("index",))):
        Monitor(dut, name, fields)
    await reset(dut)
    if apart:
        blocks = [sum(max(1, n) for _, n in batch_buffer.batches(length)) for length in bench.lengths]
        cocotb.start_soon(send_apart(entries, upd, bench.entries, blocks))
    else:
        entries.send(bench.entries)
    cocotb.start_soon(bench.records_come(requests, feat))
    tester = cocotb.start_soon(bench.test(patience))
    blender = cocotb.start_soon(bench.blend(patience))
    await tester
    await blender
    await upd.wait(len(bench.want))
    for _ in range(20):
        await upd.edge
    assert [beat[0] for beat in requests.beats] == bench.requests
    assert len(upd.beats) == len(bench.want)
    for at, (got, want) in enumerate(zip(upd.beats, bench.want, strict=True)):
        assert got[1:] == want[1:] and want[0] in (None, got[0]), f"beat {at}: {got}, want {want}"
    return upd


@cocotb.test(timeout_time=2_000_000, timeout_unit="step")
@cocotb.parametrize(stall=STALLS, lengths=[[0, 1, 2, 0, 0, 3], [256, 100, 0, 513, 207]])
async def test_every_entry_comes_back_fresh(dut, stall, lengths):
    bench = Bench(dut, lengths, stall)
    upd = await check(dut, bench, stall, patience=0 if stall == "none" else 300)
    if stall == "none":  # a batch is written back from the second cycle behind its last hit on
        full = [len(indices) for _, indices, _, _ in bench.batches if indices]
        ends = np.cumsum([max(1, len(indices)) for _, indices, _, _ in bench.batches])
        ends = [end for end, (_, indices, _, _) in zip(ends, bench.batches, strict=True) if indices]
        for n, end, tested in zip(full, ends, bench.tested, strict=True):
            cycles = upd.cycles[end - n : end]
            first, last = batch_buffer.write_back(max(tested + 2, upd.cycles[end - n - 1] if end > n else 0), n)
            assert (cycles[0], cycles[-1]) == (first, last)


@cocotb.test(timeout_time=2_000_000, timeout_unit="step")
async def test_tiles_far_apart(dut):
    await check(dut, Bench(dut, [3, 2, 130, 7, 1], "apart"), "none", patience=0, apart=True)
