"""gs_late_sorter with batches whose indices and keys come, early or late, and whose banks are used again."""

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden import params, records
from golden.formats import BUILD
from golden.raster_core import late_buffer, late_sorter
from tb.lib.stream import cycle, reset, rng, start_clock

TOP = "gs_late_sorter"
SLOW = True
C, BANKS, SLOT_W = params.CHUNK, late_buffer.BANKS, params.CHUNK.bit_length() - 1
GAPS = {"none": (0,), "records": (2,), "random": (0, 0, 3, 20), "bursts": (*(0,) * 60, 400)}


class Bench:
    """Tables of random words, a few of them alike, through the three banks."""

    def __init__(self, dut, lengths: list[int], first: int, gap: str) -> None:
        self.dut, self.edge, self.random = dut, RisingEdge(dut.clk), rng("late_sorter", first, gap)
        self.gaps = GAPS[gap]
        self.hold = 0 if gap == "none" else 700  # cycles that a bank may be kept
        self.batches = []  # (words in their order of arrival, last)
        for length in lengths:
            keys = np.random.default_rng(length).integers(0, 1 << BUILD.key_w, length)
            keys[: length // 4] = 7
            indices = np.random.default_rng(length + 1).integers(0, 1 << params.INDEX_W, length)
            words = records.entries(keys, indices)
            spans = late_buffer.batches(length, first)
            self.batches += [(words[at : at + n], (at, n) == spans[-1]) for at, n in spans]
        self.indexed = self.keyed = self.sorted = self.freed = 0  # batches so far
        self.all_known = 0
        self.known: list[int] = []  # cycle in front of the one in which a batch is known
        self.keys: list[list[int]] = [[] for _ in self.batches]  # cycles in which the keys come
        self.order: list[list[tuple[int, int]]] = [[] for _ in self.batches]  # (cycle, slot)
        dut.cfg_first.value = first
        for name in ("index_valid", "key_valid", "batch_known", "batch_free", "test_en", "out_en"):
            getattr(dut, name).value = 0

    async def until(self, there) -> None:
        while not there():
            await self.edge

    async def wait(self) -> None:
        for _ in range(self.random.choice(self.gaps)):
            await self.edge

    def know(self, bank: int, bit: int) -> None:
        self.all_known = self.all_known & ~(1 << bank) | bit << bank
        self.dut.batch_known.value = self.all_known

    async def index(self) -> None:
        """Index by index; a batch is known one cycle behind its last."""
        dut, n_all, last_all = self.dut, 0, 0
        for number, (words, last) in enumerate(self.batches):
            bank = number % BANKS
            await self.until(lambda at=number: self.freed > at - BANKS)
            n_all = n_all & ~((2 * C - 1) << bank * (SLOT_W + 1)) | len(words) << bank * (SLOT_W + 1)
            last_all = last_all & ~(1 << bank) | last << bank
            for slot, index in enumerate(records.indices_of(words)):
                dut.index_valid.value, dut.index_bank.value = 1, bank
                dut.index_slot.value, dut.index.value = slot, int(index)
                await self.edge
                dut.index_valid.value = 0
            if last:  # the end beat
                await self.edge
            self.known.append(cycle())
            dut.batch_n.value, dut.batch_last.value = n_all, last_all
            self.know(bank, 1)
            self.indexed += 1

    async def key(self) -> None:
        for number, (words, _) in enumerate(self.batches):
            await self.until(lambda at=number: self.indexed > at)
            for slot, key in enumerate(records.keys_of(words)):
                await self.wait()
                self.dut.key_valid.value, self.dut.key_bank.value = 1, number % BANKS
                self.dut.key_slot.value, self.dut.key.value = slot, int(key)
                await self.edge
                self.keys[number].append(cycle())
                self.dut.key_valid.value = 0

    async def watch(self) -> None:
        """The order of each batch, and where each ends."""
        dut = self.dut
        for number, (words, _) in enumerate(self.batches):
            while len(self.order[number]) < len(words):
                await self.edge
                if dut.order_valid.value == 1:
                    assert int(dut.order_bank.value) == number % BANKS
                    self.order[number].append((cycle(), int(dut.order_slot.value)))
                    assert dut.order_last.value == (len(self.order[number]) == len(words))
            self.sorted += 1

    async def read(self) -> None:
        """Both ports of a sorted batch; then its bank is free."""
        dut = self.dut
        for number, (words, _) in enumerate(self.batches):
            bank = number % BANKS
            await self.until(lambda at=number: self.sorted > at and self.indexed > at)
            await self.edge
            await self.edge
            order = late_sorter.order(words)
            for port in ("test", "out") if len(words) else ():
                for pos in [0, len(words) - 1, *(self.random.randrange(len(words)) for _ in range(5))]:
                    getattr(dut, f"{port}_en").value = 1
                    getattr(dut, f"{port}_bank").value, getattr(dut, f"{port}_pos").value = bank, pos
                    await self.edge
                    getattr(dut, f"{port}_en").value = 0
                    await self.edge
                    at = int(order[pos])
                    assert int(getattr(dut, f"{port}_slot").value) == at, f"batch {number} position {pos}"
                    assert port == "test" or int(dut.out_word.value) == words[at]
            for _ in range(self.random.choice((0, self.hold))):
                await self.edge
            dut.batch_free.value = 1 << bank
            self.know(bank, 0)
            await self.edge
            dut.batch_free.value = 0
            self.freed += 1

    async def run(self) -> None:
        tasks = [cocotb.start_soon(one()) for one in (self.index, self.key, self.watch)]
        await self.read()
        for task in tasks:
            await task
        for (words, _), order in zip(self.batches, self.order, strict=True):
            assert [slot for _, slot in order] == late_sorter.order(words).tolist()

    def check_cycles(self, origin: int) -> None:
        state = late_sorter.new_sorter(origin)
        for number, (words, last) in enumerate(self.batches):
            keys = np.array(self.keys[number], np.int64)
            begin = late_sorter.sort_batch(state, keys, self.known[number], last)
            want = list(range(begin, begin + len(words)))
            assert [at for at, _ in self.order[number]] == want, f"batch {number} of {len(words)}"


@cocotb.test(timeout_time=2_000_000, timeout_unit="step")
@cocotb.parametrize(gap=list(GAPS), first=[C, C // 2])
async def test_each_batch_comes_in_order_and_in_time(dut, gap, first):
    start_clock(dut)
    bench = Bench(dut, [0, 0, 1, 0, 0, 17, 3, 0, 2, 0, 9, 0, 0, 1, C // 2, 2, 2 * C + 5, 0, C, 40], first, gap)
    await reset(dut)
    origin = cycle()
    await bench.run()
    bench.check_cycles(origin)


@cocotb.test(timeout_time=2_000_000, timeout_unit="step")
async def test_a_reset_forgets_the_batches(dut):
    """In the middle of a batch that goes out, with one that waits; then a batch with entries is the first."""
    start_clock(dut)
    before = Bench(dut, [40, 30], C, "none")
    await reset(dut)
    tasks = [cocotb.start_soon(one()) for one in (before.index, before.key)]
    while dut.order_valid.value == 0 or dut.order_slot.value == 0:
        await before.edge
    for task in tasks:
        task.cancel()
    await reset(dut, cycles=1)
    bench = Bench(dut, [5, 0, 1, 0], C, "none")
    origin = cycle()
    await bench.run()
    bench.check_cycles(origin)
