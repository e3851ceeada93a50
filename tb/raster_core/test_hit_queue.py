"""gs_hit_queue: lists come out as they went in, marks two cycles behind their close; slots are read or dropped."""

import cocotb
from cocotb.triggers import RisingEdge

from golden.raster_core.hit_queue import MARK_DELAY, lists
from tb.lib.pipe import unknown
from tb.lib.stream import cycle, reset, rng, start_clock

TOP = "gs_hit_queue"
PARAMETERS = [{}, {"CHUNK": 8, "QUEUE": 8, "MARKS": 2}, {"CHUNK": 8, "QUEUE": 32, "MARKS": 8}]


class Bench:
    """A tester that keeps to the room there is, and a unit. Rates: chance of a push, a close, a read in a cycle."""

    def __init__(self, dut, name: str, push: float, close: float, read: float) -> None:
        self.dut, self.random, self.rates = dut, rng("queue", name), (push, close, read)
        self.chunk, self.queue, self.marks = (int(p.value) for p in (dut.CHUNK, dut.QUEUE, dut.MARKS))
        self.beats: list = []  # what went in, as golden takes it
        self.closed: list[int] = []  # cycles
        self.found: list = []  # (void, end, count, slots, or None where they were dropped), as they came out
        self.most = [0, 0]  # slots and marks that waited
        dut.push_valid.value = dut.close.value = dut.mark_ready.value = dut.mark_skip.value = dut.slot_en.value = 0

    def drive(self, lists_left: int, waiting: int, marks: int, count: int) -> tuple[int | None, tuple | None]:
        """One cycle of the tester. Waiting: slots of complete and open lists; count: of the open one."""
        dut, random = self.dut, self.random
        push = random.random() < self.rates[0] and waiting < self.queue and count < self.chunk and lists_left > 0
        close = random.random() < self.rates[1] and marks < self.marks and lists_left > 0
        close = close or (count + push == self.chunk and marks < self.marks and random.random() < 0.5)
        slot = random.randrange(self.chunk) if push else None
        kind = (random.randrange(2), random.randrange(2)) if close else None
        dut.push_valid.value, dut.close.value = int(push), int(close)
        dut.push_slot.value = slot if push else unknown(dut.push_slot, random)
        dut.close_void.value, dut.close_end.value = kind if close else (0, 0)
        return slot, kind

    async def run(self, number: int) -> None:
        """So many lists through the queue."""
        dut, random, edge = self.dut, self.random, RisingEdge(self.dut.clk)
        beat: tuple = (None, None)
        slots_used = marks_used = count = left = 0
        taken: list | None = None  # slots of the list whose mark was taken last
        ready = skip = read = reading = 0
        while len(self.found) < number or left or reading or read:
            await edge
            now = cycle()
            if reading:
                taken.append(int(dut.slot.value))
            reading = read
            assert (int(dut.slot_used.value), int(dut.mark_used.value)) == (slots_used, marks_used)
            self.most = [max(self.most[0], slots_used), max(self.most[1], marks_used)]
            shown = len(self.found) < len(self.closed) and now >= self.closed[len(self.found)] + MARK_DELAY
            assert dut.mark_valid.value == shown, f"cycle {now}"
            slot, kind = beat
            self.beats.append(beat)
            count += slot is not None
            if read:
                slots_used -= 1
                left -= 1
            if shown and ready:
                size = int(dut.mark_count.value)
                taken = None if skip else []
                self.found.append((int(dut.mark_void.value), int(dut.mark_end.value), size, taken))
                left = 0 if skip else size
                slots_used -= size if skip else 0
                marks_used -= 1
            if kind is not None:
                slots_used, marks_used, count = slots_used + count, marks_used + 1, 0
                self.closed.append(now)
            beat = self.drive(number - len(self.closed), slots_used + count, marks_used, count)
            read = int(left > 0 and random.random() < self.rates[2])
            ready = int(left == 0 and random.random() < self.rates[2])
            skip = int(random.random() < 0.3)
            dut.slot_en.value, dut.mark_ready.value, dut.mark_skip.value = read, ready, skip
        wanted = lists(self.beats)
        assert [(void, end, size) for void, end, size, _ in self.found] == [(v, e, len(s)) for v, e, s in wanted]
        for (*_, taken), (*_, slots) in zip(self.found, wanted, strict=True):
            assert taken is None or taken == slots


async def bench(dut, *arguments) -> Bench:
    start_clock(dut)
    bench = Bench(dut, *arguments)
    await reset(dut)
    return bench


@cocotb.test(timeout_time=1_000_000, timeout_unit="step")
@cocotb.parametrize(
    (
        ("push", "close", "read"),
        [(0.9, 0.05, 0.9), (0.5, 0.9, 0.9), (0.3, 0.05, 0.1), (1.0, 0.02, 1.0), (1.0, 0.001, 1.0), (1.0, 1.0, 1.0)],
    )
)
async def test_lists_come_out_as_they_went_in(dut, push, close, read):
    await (await bench(dut, f"{push} {close}", push, close, read)).run(100)


@cocotb.test(timeout_time=1_000_000, timeout_unit="step")
async def test_it_holds_all_its_slots(dut):
    one = await bench(dut, "slots", 0.9, 0.05, 0.01)
    await one.run(40)
    assert one.most[0] == one.queue


@cocotb.test(timeout_time=1_000_000, timeout_unit="step")
async def test_it_holds_all_its_marks(dut):
    one = await bench(dut, "marks", 0.9, 0.9, 0.02)
    await one.run(100)
    assert one.most[1] == one.marks


@cocotb.test(timeout_time=1_000_000, timeout_unit="step")
async def test_reset_empties_it(dut):
    await bench(dut, "reset", 0.0, 0.0, 0.0)
    for _ in range(60):
        await RisingEdge(dut.clk)
        dut.push_valid.value, dut.push_slot.value = 1, 1
        dut.close.value = cycle() % 32 == 0
    dut.push_valid.value = dut.close.value = 0
    await reset(dut)
    one = Bench(dut, "behind", 0.9, 0.1, 0.9)
    await one.run(20)
