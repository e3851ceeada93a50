"""gs_late_buffer between sources, sinks, and a tester and blender made of random numbers."""

from itertools import count

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden import params, records
from golden.formats import BUILD
from golden.raster_core import candidate_matrix, group_finder, late_buffer, late_sorter
from tb.lib.lists import send_apart
from tb.lib.stream import STALLS, Monitor, Sink, Source, cycle, reset, rng, start_clock
from tb.raster_core.scenes import record_words, scene

TOP = "gs_late_buffer"
SLOW = True
C = params.CHUNK
SIZE = 512  # pixels that the Gaussians lie over
CUT = (470, 500)  # where the picture ends: in the last tiles
FAR = 7616  # where they begin but for `stall` none
GEOMETRY_MASK = (1 << BUILD.geometry_w) - 1
FEATURE_MASK = (1 << BUILD.geometry_w + 3 * BUILD.colour_w) - 1
LATENCY = 9


class Batch:
    """What is in the buffer: slots in the order of arrival, everything else in the order of the fresh keys."""

    def __init__(self, indices, features, hit, xy, last, size) -> None:
        self.indices, self.hit, self.xy, self.last = indices, hit, xy, last
        self.order = late_sorter.order(records.entries(features.key[indices], indices))
        rows = np.column_stack([features.chol, features.mean, features.opacity])[indices[self.order]]
        masks = [group_finder.mask(BUILD, *map(int, row), *xy, *size) for row in rows]
        self.words = candidate_matrix.words(np.array(masks, np.int64))


class Bench:
    """Tables of known words; what the tester is told to find; what the buffer gives back."""

    def __init__(self, dut, lengths: list[int], first: int, stall: str) -> None:
        self.dut, self.random, self.edge = dut, rng("late_buffer", stall), RisingEdge(dut.clk)
        self.patience = 0 if stall == "none" else 300
        self.slow = 4 if stall == "random" else 1  # the blender: behind the tester by all the banks
        self.lengths, self.first, self.stall = lengths, first, stall
        n = sum(lengths) + 1
        far = 0 if stall == "none" else FAR
        self.size = tuple(far + end for end in CUT)
        features = scene(n, SIZE, SIZE, sigma=20.0)
        features.mean += far << BUILD.mean_f
        features.key[: n // 2] &= 15  # many alike
        self.records = record_words(features)
        order = np.random.default_rng(len(lengths)).permutation(n)
        self.tile_xy = [(far + 64 * (t * 7 % 8), far + 64 * (t * 5 % 8)) for t in range(len(lengths))]
        self.batches: list[Batch] = []
        self.entries, self.want, self.requests = [], [], []
        begin = 0
        for xy, length in zip(self.tile_xy, lengths, strict=True):
            indices = order[begin : begin + length]
            hit = np.array([self.random.random() < 0.5 for _ in indices], bool)
            spans = late_buffer.batches(length, first)
            for at, m in spans:
                part = slice(at, at + m)
                self.batches.append(Batch(indices[part], features, hit[part], xy, (at, m) == spans[-1], self.size))
            self.want += late_buffer.blocks(BUILD, records.entries(features.key[indices], indices), hit, first)
            stale = self.random.getrandbits(BUILD.key_w)
            self.entries += [(stale << params.INDEX_W | int(index), 0) for index in indices] + [(None, 1)]
            self.requests += indices.tolist()
            begin += length
        self.shown: list[int] = []  # first cycle of test_valid of each batch
        self.issued: list[int] = []  # cycles of the pulses
        self.over: list[int] = []
        self.blended: list[int] = []
        dut.cfg_width.value, dut.cfg_height.value = self.size
        dut.cfg_first.value = first
        for name in ("test_issued", "hit_valid", "hits_over", "blend_done", "cand_en", "geometry_en", "feature_en"):
            getattr(dut, name).value = 0

    async def records_come(self, sink: Sink, source: Source) -> None:
        """LATENCY cycles behind the requests, or as fast as they are taken."""
        done = 0
        while True:
            await self.edge
            while done < len(sink.beats) and sink.cycles[done] + LATENCY - 2 <= cycle():
                source.send([(self.records[sink.beats[done][0]],)])
                done += 1

    async def idle(self) -> None:
        for _ in range(self.random.randrange(self.patience + 1)):
            await self.edge

    async def pulse(self, signal) -> int:
        """The cycle of the pulse."""
        signal.value = 1
        await self.edge
        signal.value = 0
        return cycle()

    async def geometry(self, batch: Batch, pos: int, issues: bool = False) -> None:
        """Compares what is read at a position; issues: in the cycle of test_issued."""
        dut = self.dut
        dut.geometry_pos.value, dut.test_issued.value = pos, issues
        await self.pulse(dut.geometry_en)
        dut.test_issued.value = 0
        if issues:
            self.issued.append(cycle())
        await self.edge
        await self.edge
        slot = int(batch.order[pos])
        assert int(dut.geometry_slot.value) == slot, f"position {pos}"
        assert int(dut.geometry.value) == self.records[batch.indices[slot]] & GEOMETRY_MASK

    async def watch(self) -> None:
        """When each batch is shown."""
        while True:
            await self.edge
            if self.dut.test_valid.value == 1 and len(self.shown) == sum(at < cycle() for at in self.issued):
                self.shown.append(cycle())

    async def test(self) -> None:
        """The tester: checks a batch, its candidates and geometries, and reports hits that add up to those wanted."""
        dut = self.dut
        for batch in self.batches:
            while dut.test_valid.value == 0:
                await self.edge
            await self.idle()
            n = len(batch.indices)
            shown = [int(signal.value) for signal in (dut.test_n, dut.test_last, dut.test_x, dut.test_y)]
            assert shown == [n, batch.last, *batch.xy]
            for group in range(params.GROUPS) if n else ():
                for block in {0, (n - 1) // 16, self.random.randrange((n + 15) // 16)}:
                    dut.cand_group.value, dut.cand_block.value = group, block
                    await self.pulse(dut.cand_en)
                    await self.edge
                    assert int(dut.cand_bits.value) == batch.words[group, block], f"group {group} block {block}"
            for pos in [self.random.randrange(n) for _ in range(40)] + [0] if n else ():
                await self.geometry(batch, pos)
            if n:
                await self.geometry(batch, n - 1, issues=True)
            else:
                self.issued.append(await self.pulse(dut.test_issued))
            slots = [slot for slot in range(n) for _ in range(self.random.randrange(3) + int(batch.hit[slot]))]
            self.random.shuffle(slots)
            told = set()
            for at, slot in enumerate(slots):
                dut.hit_any.value = bool(batch.hit[slot]) and (slot not in told or self.random.random() < 0.5)
                told.add(slot)
                dut.hit_slot.value = slot
                dut.hits_over.value = at == len(slots) - 1
                await self.pulse(dut.hit_valid)
            if slots:
                dut.hits_over.value = 0
                self.over.append(cycle())
            else:
                self.over.append(await self.pulse(dut.hits_over))

    async def blend(self) -> None:
        """The blender: checks the place and some features of a batch that is tested."""
        dut = self.dut
        for number, batch in enumerate(self.batches):
            while len(self.over) <= number:
                await self.edge
            await self.edge
            for _ in range(self.slow):
                await self.idle()
            assert (int(dut.blend_x.value), int(dut.blend_y.value)) == batch.xy
            for _ in range(min(len(batch.indices), 10)):
                slot = self.random.randrange(len(batch.indices))
                dut.feature_bank.value, dut.feature_slot.value = number % late_buffer.BANKS, slot
                await self.pulse(dut.feature_en)
                await self.edge
                assert int(dut.feature.value) == self.records[batch.indices[slot]] & FEATURE_MASK, f"slot {slot}"
            self.blended.append(await self.pulse(dut.blend_done))

    def check_cycles(self, origin: int, tiles, requests, feat, upd) -> None:
        """Golden is told when records come and when tester and blender are through."""
        state = late_buffer.new_buffer(origin)
        number = came = beat = 0
        for tile, length in enumerate(self.lengths):
            assert tiles[tile] == late_buffer.begin_tile(state, origin, self.first)
            for _, n in late_buffer.batches(length, self.first):
                asked, block = np.empty(n, np.int64), np.empty(2, np.int64)
                late_buffer.request_batch(state, np.zeros(n + 1, np.int64), asked)
                assert requests[came : came + n] == asked.tolist(), f"batch {number}"
                ready = late_buffer.sort_batch(state, np.array(feat[came : came + n], np.int64))
                before = self.issued[number - 1] + 1 if number else 0
                assert self.shown[number] == max(ready, before), f"batch {number} of {n}"
                late_buffer.end_batch(state, n, self.over[number], self.blended[number], block)
                assert [upd[beat], upd[beat + max(n, 1) - 1]] == block.tolist(), f"batch {number}"
                number, came, beat = number + 1, came + n, beat + max(n, 1)


async def check(dut, bench: Bench, stall: str, apart: bool = False, cycles: int = 3, go=None) -> None:
    """Behind a reset of so many cycles everything comes back, in order. go(sink): may an entry come back?."""
    tiles = Source(dut, "tile", ("x", "y"), stall=stall)
    entries = Source(dut, "entry", ("word", "last"), stall=stall)
    requests = Sink(dut, "feat_req", ("index",), stall=stall)
    feat = Source(dut, "feat", ("record",), stall=stall)
    upd = Sink(dut, "upd", ("word", "len", "last"), stall=stall)
    if go:
        upd.go = (go(upd) for _ in count())
    for name, fields in (("upd", ("word", "len", "last")), ("feat_req", ("index",))):
        Monitor(dut, name, fields)
    await reset(dut, cycles)
    origin = cycle() + 1
    tiles.send(bench.tile_xy)
    if apart:
        blocks = [sum(max(1, n) for _, n in late_buffer.batches(length, bench.first)) for length in bench.lengths]
        cocotb.start_soon(send_apart(entries, upd, bench.entries, blocks))
    else:
        entries.send(bench.entries)
    cocotb.start_soon(bench.records_come(requests, feat))
    cocotb.start_soon(bench.watch())
    tester, blender = cocotb.start_soon(bench.test()), cocotb.start_soon(bench.blend())
    await tester
    await blender
    await upd.wait(len(bench.want))
    for _ in range(20):
        await upd.edge
    assert [beat[0] for beat in requests.beats] == bench.requests
    assert len(upd.beats) == len(bench.want)
    for at, (got, want) in enumerate(zip(upd.beats, bench.want, strict=True)):
        assert got[1:] == want[1:] and want[0] in (None, got[0]), f"beat {at}: {got}, want {want}"
    if stall == "none" and not apart and not go:
        bench.check_cycles(origin, tiles.cycles, requests.cycles, feat.cycles, upd.cycles)


@cocotb.test(timeout_time=2_000_000, timeout_unit="step")
@cocotb.parametrize(
    stall=STALLS, first=[C, C // 2], lengths=[[0, 1, 2, 0, 0, 0, 0, 3, C // 2, 5], [C, 40, 0, 2 * C + 1]]
)
async def test_every_entry_comes_back_fresh_and_in_order(dut, stall, first, lengths):
    start_clock(dut)
    await check(dut, Bench(dut, lengths, first, stall), stall)


@cocotb.test(timeout_time=2_000_000, timeout_unit="step")
async def test_tiles_far_apart(dut):
    start_clock(dut)
    await check(dut, Bench(dut, [3, 0, 130, 7, 1, 9, 0], C, "none"), "none", apart=True)


@cocotb.test(timeout_time=2_000_000, timeout_unit="step")
@cocotb.parametrize(written=[0, 1, 2])
async def test_all_banks_wait_for_the_write_back(dut, written):
    """It stands still behind so many batches until the next three are blended."""
    start_clock(dut)
    lengths = [3, 2, 4, 7, 1, 5, 2, 6]
    bench = Bench(dut, lengths, C, "none")
    await check(
        dut,
        bench,
        "none",
        go=lambda upd: len(upd.beats) < sum(lengths[:written]) or len(bench.blended) >= written + late_buffer.BANKS,
    )


@cocotb.test(timeout_time=2_000_000, timeout_unit="step")
async def test_a_reset_in_mid_flight_leaves_nothing_behind(dut):
    """While a batch goes to the candidates in its order, for one cycle."""
    noise, edge = rng("late_buffer noise"), RisingEdge(dut.clk)
    start_clock(dut)
    before = Bench(dut, [C], C, "none")
    await reset(dut)
    dut.tile_valid.value = dut.entry_valid.value = dut.feat_valid.value = 1
    dut.tile_x.value = dut.tile_y.value = 64
    dut.entry_last.value = 0
    dut.feat_req_ready.value = dut.upd_ready.value = 1
    while dut.order_valid.value == 0 or dut.order_slot.value == 0:
        dut.entry_word.value, dut.feat_record.value = noise.getrandbits(BUILD.entry_w), noise.choice(before.records)
        await edge
    await check(dut, Bench(dut, [100, 0, 40, 1], C, "none"), "none", cycles=1)
