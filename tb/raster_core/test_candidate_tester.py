"""gs_candidate_tester: hits of every candidate, and closes in the cycles that golden names, however slow the queues."""

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden import params
from golden.formats import BUILD
from golden.raster_core import candidate_tester as golden
from golden.raster_core import queue_blender
from golden.raster_core.candidate_matrix import BLOCK, words
from golden.raster_core.group_tester import group_hits, tile_bits
from golden.raster_core.hit_queue import MARK_DELAY
from tb.lib.stream import cycle, reset, rng, start_clock
from tb.raster_core.scenes import on_edges, record_words, scene, walls

TOP = "gs_candidate_tester"
SLOW = True
PARAMETERS = [{}, {"CHUNK": 32, "QUEUE": 32, "MARKS": 4}]
SIZE = (130, 70)
LIMIT = {"timeout_time": 400_000, "timeout_unit": "step"}
ORIGINS = ((0, 0), (128, 64), (64, 0), (128, 0), (0, 64))


class Batch:
    """n entries in sorted order: slots, geometry, masks.

    kind: "scene", a share `density` of the groups not hit are candidates; "misses", the same, but nothing is hit;
    "walls", everything is hit, and that share of the words are all candidates, the others none; "edges", their
    hits change with one code.
    """

    def __init__(self, n: int, kind: str, density: float, last: bool, x0: int, y0: int, random) -> None:
        if kind == "walls":
            features = walls(n)
        elif kind == "edges":
            features = on_edges(n, *SIZE, (x0, y0))
        else:
            features = scene(n, *SIZE, seed=random.getrandbits(32), sigma=6.0)
        if kind == "misses":
            features.opacity[:] = (1 << BUILD.opacity_w) - 1
        self.n, self.last, self.x0, self.y0 = n, int(last), x0, y0
        rows = zip(features.chol, features.mean, features.opacity, strict=True)
        bitmaps = np.array(
            [tile_bits(BUILD, *chol, *mean, opacity, x0, y0, *SIZE) for chol, mean, opacity in rows], np.uint64
        )
        extra = np.array([random.random() < density for _ in range(n * params.GROUPS)], bool).reshape(n, params.GROUPS)
        candidate = np.repeat(extra, BLOCK, axis=0)[:n] if kind == "walls" else (group_hits(bitmaps).T > 0) | extra
        masks = (candidate << np.arange(params.GROUPS)).sum(axis=1).astype(np.int64)
        self.words = words(masks).tolist()
        self.counts = np.array([[word.bit_count() for word in row] for row in self.words]).reshape(params.GROUPS, -1)
        self.geometry = [word & (1 << BUILD.geometry_w) - 1 for word in record_words(features)]
        self.tests = golden.tests(masks, bitmaps)
        self.slots = random.sample(range(n), n)


class Queue:
    """One SCU's queue and the unit behind it, which takes a list, drops it or reads it slot by slot, and rests."""

    def __init__(self, patience: int, random) -> None:
        self.patience, self.random = patience, random
        self.open: list[int] = []
        self.lists: list[tuple[int, list[int]]] = []  # cycle from which the mark is shown, slots
        self.taken: list[tuple[int, int, int, int]] = []  # cycle, first read, cycles from one to the next, slots
        self.rest = self.slots = self.marks = 0
        self.reads: dict[int, int] = {}  # cycle -> slots that leave

    def step(self, now: int, push: int, slot: int, close: int) -> None:
        """What happens in this cycle."""
        if push:
            self.open.append(slot)
        if close:
            self.lists.append((now + MARK_DELAY, self.open))
            self.slots, self.marks, self.open = self.slots + len(self.open), self.marks + 1, []
        waiting = len(self.taken) < len(self.lists) and self.lists[len(self.taken)][0] <= now
        if waiting and self.rest <= now:
            n = len(self.lists[len(self.taken)][1])
            drop = self.random.random() < 0.3
            step = 0 if drop else self.random.choice((1, params.BEATS))
            first = now if drop else now + self.random.randrange(1, 5)
            self.taken.append((now, first, step, n))
            self.marks -= 1
            for k in range(n):
                self.reads[first + k * step] = self.reads.get(first + k * step, 0) + 1
            self.rest = first + step * max(n - 1, 0) + 1 + self.random.randrange(self.patience + 1)
        self.slots -= self.reads.pop(now, 0)


def record(units: np.ndarray, unit: int, taken: tuple[int, int, int, int]) -> None:
    """Tell golden's state of the units of a list."""
    state = units[unit]
    ring = state[queue_blender.LISTS] % queue_blender.RING
    state[queue_blender.LISTS] += 1
    state[queue_blender.SLOTS] += taken[3]
    for column, value in zip(("TAKEN", "POPPED", "STEP"), taken[:3], strict=True):
        state[getattr(queue_blender, column) + ring] = value
    state[queue_blender.TOTAL + ring] = state[queue_blender.SLOTS]


class Bench:
    """Batches of these lengths, offered back to back or after a rest, between a buffer and four queues."""

    def __init__(self, dut, name: str, lengths, density: float, patience: int, rests=False, kind="scene") -> None:
        self.dut, self.random, self.rests = dut, rng("tester", name), rests
        self.queue, self.marks = int(dut.QUEUE.value), int(dut.MARKS.value)
        chunk = int(dut.CHUNK.value)
        self.batches = [
            Batch(min(n, chunk), kind, density, n == 0 or at % 3 == 1, *ORIGINS[at % len(ORIGINS)], self.random)
            for at, n in enumerate(lengths)
        ]
        self.queues = [Queue(patience, rng("queue", name, unit)) for unit in range(params.UNITS)]
        self.hits: list = []
        self.reads: list[int] = []
        self.closes: list = []
        self.over: list[int] = []
        self.ready: list[int] = []
        self.issued: list[int] = []
        dut.cfg_width.value, dut.cfg_height.value = SIZE
        dut.test_valid.value = dut.slot_used.value = dut.mark_used.value = 0

    def used(self) -> None:
        """Show the testers what the queues hold."""
        dut = self.dut
        for signal, field, size in ((dut.slot_used, "slots", self.queue), (dut.mark_used, "marks", self.marks)):
            width = size.bit_length()
            signal.value = sum(getattr(queue, field) << width * unit for unit, queue in enumerate(self.queues))

    def sample(self, now: int) -> None:
        """What the tester shows in this cycle, and what the queues make of it."""
        dut = self.dut
        hit_units, slot, close = int(dut.hit_units.value), 0, int(dut.close.value)
        if dut.hit_valid.value:
            slot = int(dut.hit_slot.value)
            self.hits.append((now, int(dut.hit_group.value), slot, hit_units))
        else:
            assert hit_units == 0
        if close:
            self.closes.append((now, int(dut.close_void.value), int(dut.close_end.value)))
        if dut.hits_over.value:
            self.over.append(now)
        for unit, queue in enumerate(self.queues):
            queue.step(now, hit_units >> unit & 1, slot, close)
            assert queue.slots + len(queue.open) <= self.queue and queue.marks <= self.marks

    async def run(self) -> None:
        dut, random, edge = self.dut, self.random, RisingEdge(self.dut.clk)
        at, rest, shown = 0, 0, False
        word = position = None
        while len(self.over) < len(self.batches) or any(len(q.taken) < len(self.closes) for q in self.queues):
            if not shown and at < len(self.batches) and rest == 0:
                batch, shown = self.batches[at], True
                dut.test_valid.value, dut.test_n.value, dut.test_last.value = 1, batch.n, batch.last
                dut.test_x.value, dut.test_y.value = batch.x0, batch.y0
                self.ready.append(cycle() + 1)
            rest = max(rest - 1, 0)
            await edge
            self.sample(cycle())
            self.used()
            if word is not None:  # the geometry read in the cycle before this one
                dut.geometry.value, dut.geometry_slot.value = word
            else:
                dut.geometry.value, dut.geometry_slot.value = random.getrandbits(BUILD.geometry_w), 0
            word = None
            if dut.geometry_en.value:
                position = int(dut.geometry_pos.value)
                self.reads.append(cycle())
                word = batch.geometry[position], batch.slots[position]
            if dut.cand_en.value:
                dut.cand_bits.value = batch.words[int(dut.cand_group.value)][int(dut.cand_block.value)]
            if shown and dut.test_issued.value:
                self.issued.append(cycle())
                at, shown = at + 1, False
                dut.test_valid.value = 0
                rest = random.randrange(30) if self.rests else 0

    def check(self) -> None:
        """Data, and every cycle."""
        tests = [(g, b.slots[pos], hits) for b in self.batches for g, pos, hits in b.tests]
        assert [hit[1:] for hit in self.hits] == tests
        assert [hit[0] for hit in self.hits] == [c + golden.LATENCY for c in self.reads]
        units = queue_blender.new_units(0)
        state = golden.new_tester(0, self.queue, self.marks)
        wanted, done = [], 0
        for batch, ready in zip(self.batches, self.ready, strict=True):
            if batch.n == 0:
                wanted.append((golden.test_nothing(state, units, ready), 1, 1))
                done = self.told(units, done)
                continue
            golden.begin_batch(state, ready)
            for group in range(params.GROUPS):
                hits = [sum(h >> unit & 1 for g, _, h in batch.tests if g == group) for unit in range(params.UNITS)]
                close = golden.test_group(state, units, batch.counts[group], np.array(hits))
                wanted.append((close, 0, int(group == params.GROUPS - 1 and batch.last)))
                done = self.told(units, done)
        assert self.closes == wanted
        ends = [sum(params.GROUPS if b.n else 1 for b in self.batches[: k + 1]) - 1 for k in range(len(self.batches))]
        assert self.over == [wanted[end][0] for end in ends]
        assert self.issued == [over - golden.LATENCY for over in self.over]

    def told(self, units: np.ndarray, done: int) -> int:
        for unit, queue in enumerate(self.queues):
            record(units, unit, queue.taken[done])
        return done + 1


async def run(dut, lengths: list[int], density: float, patience: int, **more) -> Bench:
    start_clock(dut)
    bench = Bench(dut, f"{lengths} {density} {patience}", lengths, density, patience, **more)
    await reset(dut)
    await bench.run()
    bench.check()
    return bench


@cocotb.test(**LIMIT)
@cocotb.parametrize(patience=[0, 20, 200], density=[0.0, 0.3])
async def test_hits_and_cycles(dut, patience, density):
    await run(dut, [40, 0, 1, 0, 0, 16, 17, 100], density, patience, rests=True)


@cocotb.test(**LIMIT)
async def test_where_one_code_changes_the_hits(dut):
    await run(dut, [256, 0], 0.0, 0, kind="edges")


@cocotb.test(**LIMIT)
async def test_all_candidates_and_slow_queues(dut):
    bench = await run(dut, [256, 256, 0], 1.0, 500)
    assert np.diff(bench.reads).max() > 20, "no queue was full"


@cocotb.test(**LIMIT)
async def test_words_without_a_candidate_pass_while_a_queue_is_full(dut):
    bench = await run(dut, [256, 70, 256], 0.5, 100, kind="walls")
    assert np.diff(bench.reads).max() > 20, "no queue was full"


@cocotb.test(**LIMIT)
async def test_a_candidate_a_cycle_while_the_queues_have_room(dut):
    """All entries are candidates of all groups and hit none: START cycles between batches are all that is lost."""
    n = int(dut.CHUNK.value) // 2
    bench = await run(dut, [n, n], 1.0, 0, kind="misses")
    assert bench.reads[-1] - bench.reads[0] + 1 == 2 * n * params.GROUPS + golden.START


@cocotb.test(**LIMIT)
async def test_lists_without_an_entry_wait_for_marks(dut):
    bench = await run(dut, [0] * 50 + [1] * 5 + [0] * 40, 0.0, 60)
    assert max(np.diff(bench.issued)) > 20, "no queue was full of marks"


@cocotb.test(**LIMIT)
async def test_reset_in_mid_flight(dut):
    start_clock(dut)
    first = Bench(dut, "cut", [100, 100], 0.5, 10)
    await reset(dut)
    task = cocotb.start_soon(first.run())
    for _ in range(130):
        await RisingEdge(dut.clk)
    task.cancel()
    second = Bench(dut, "behind", [30, 0, 20], 0.5, 10)
    await reset(dut)
    await second.run()
    second.check()
