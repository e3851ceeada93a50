"""gs_sort_sequencer: the commands of a job, in golden's order, each when the one before it is written."""

import cocotb

from golden.formats import BUILD
from golden.sorting_core import sort_sequencer
from golden.sorting_core.sort_sequencer import INCOMING, OUT, SCRATCH, TABLE
from tb.lib.stream import Monitor, Sink, Source, reset, rng, stall_pairs, start_clock

TOP = "gs_sort_sequencer"
SLOW = True
JOB = ("table_addr", "table_n", "in_addr", "in_n", "scratch_addr", "out_addr", "first")
BASE = {TABLE: 0x10000000, INCOMING: 0x20000040, SCRATCH: 0x30000080, OUT: 0x400000C0}
LENGTHS = (0, 1, 255, 256, 257, 512, 513, 700, 1500, 65536, (1 << 24) - 1)


class Units:
    """What stands around the sequencer; each command is answered with a number of entries of its own."""

    def __init__(self, dut, source_stall="none", sink_stall="none"):
        self.job = Source(dut, "job", JOB, stall=source_stall)
        self.a = Sink(dut, "a", ("addr", "n"), stall=sink_stall, seed="a")
        self.b = Sink(dut, "b", ("addr", "n"), stall=sink_stall, seed="b")
        self.core = Sink(dut, "core", ("merge", "first"), stall=sink_stall, seed="core")
        self.out = Sink(dut, "out", ("addr",), stall=sink_stall, seed="out")
        self.written = Source(dut, "written", ("n",), stall=source_stall)
        self.done = Sink(dut, "done", ("n",), stall=sink_stall, seed="done")
        for sink in (self.a, self.b, self.core, self.out, self.done):
            Monitor(dut, sink.name, sink.fields)

    async def serve(self, count: int, answer) -> None:
        """Answer `count` commands once all four units have them."""
        for k in range(count):
            for sink in (self.a, self.b, self.core, self.out):
                await sink.wait(k + 1)
            self.written.send([(answer(k),)])
            await self.written.drained()

    def check(self, jobs, base=BASE) -> None:
        """Everything sent equals golden's commands of the jobs (table_n, in_n, first)."""
        want = [c for table_n, in_n, first in jobs for c in sort_sequencer.commands(table_n, in_n, first)]

        def at(region, entry):
            return base[region] + BUILD.entry_bytes * entry & 0xFFFFFFFF

        assert self.a.beats == [(at(c.a, c.a_from), c.a_n) for c in want]
        assert [n for _, n in self.b.beats] == [c.b_n for c in want]
        for (address, n), c in zip(self.b.beats, want, strict=True):
            assert n == 0 or address == at(c.b, c.b_from)
        assert self.core.beats == [(int(c.merge), c.first) for c in want]
        assert self.out.beats == [(at(c.out, c.out_from),) for c in want]


def fields(table_n: int, in_n: int, first: int, base=BASE) -> tuple:
    return base[TABLE], table_n, base[INCOMING], in_n, base[SCRATCH], base[OUT], first


@cocotb.test()
@stall_pairs
async def test_commands_equal_golden(dut, source_stall, sink_stall):
    start_clock(dut)
    units = Units(dut, source_stall, sink_stall)
    await reset(dut)
    random = rng("jobs", source_stall, sink_stall)
    jobs = [(t, i, random.choice((128, 256))) for i in LENGTHS[:9] for t in (0, random.choice(LENGTHS[1:]))]
    random.shuffle(jobs)
    units.job.send(fields(*job) for job in jobs)
    counts = [len(sort_sequencer.commands(*job)) for job in jobs]
    await units.serve(sum(counts), lambda k: 1000 + k)
    await units.done.wait(len(jobs))
    units.check(jobs)
    ends = [sum(counts[: k + 1]) for k in range(len(jobs))]
    assert units.done.beats == [(999 + end if count else 0,) for count, end in zip(counts, ends, strict=True)]


@cocotb.test()
async def test_addresses_of_32_and_counts_of_24_bits(dut):
    start_clock(dut)
    units = Units(dut)
    await reset(dut)
    random = rng("wide")
    for in_n in [0, 1, 300, 600] * 10 + [400_000]:
        base = {region: 64 * random.getrandbits(26) for region in BASE}
        job = random.getrandbits(24), in_n, random.getrandbits(9)
        answers = [random.getrandbits(24) for _ in sort_sequencer.commands(*job)]
        for sink in (units.a, units.b, units.core, units.out, units.done):
            sink.clear()
        units.job.send([fields(*job, base)])
        await units.serve(len(answers), answers.__getitem__)
        await units.done.wait(1)
        units.check([job], base)
        assert units.done.beats == [(answers[-1],)]


@cocotb.test()
async def test_the_longest_lists_need_no_wider_counters(dut):
    """65,536 runs would be too many commands to walk: the first and the last pass of a shorter, odd one instead."""
    start_clock(dut)
    units = Units(dut)
    await reset(dut)
    jobs = [(LENGTHS[-1], 65536 + 257, 128), (0, 100 * 256 + 1, 256)]
    units.job.send(fields(*job) for job in jobs)
    await units.serve(sum(len(sort_sequencer.commands(*job)) for job in jobs), lambda k: k)
    await units.done.wait(2)
    units.check(jobs)


@cocotb.test()
async def test_cycles_equal_golden(dut):
    start_clock(dut)
    units = Units(dut)
    await reset(dut)
    commands = 0
    for table_n, in_n in ((0, 0), (1, 0), (0, 1), (5, 700), (0, 700)):
        units.job.send([fields(table_n, in_n, 256)])
        want = sort_sequencer.commands(table_n, in_n)
        done = len(units.done.beats)
        for k in range(commands, commands + len(want)):
            for sink in (units.a, units.b, units.core, units.out):
                await sink.wait(k + 1)
            before = units.job.cycles[-1] if k == commands else units.written.cycles[-1]
            step = sort_sequencer.FIRST_COMMAND if k == commands else sort_sequencer.NEXT_COMMAND
            assert [s.cycles[k] for s in (units.a, units.b, units.core, units.out)] == [before + step] * 4
            units.written.send([(7,)])
            await units.written.drained()
        commands += len(want)
        await units.done.wait(done + 1)
        before, step = (
            (units.written.cycles[-1], sort_sequencer.NEXT_COMMAND)
            if want
            else (units.job.cycles[-1], sort_sequencer.EMPTY)
        )
        assert units.done.cycles[-1] == before + step


@cocotb.test()
async def test_a_job_runs_while_a_done_waits(dut):
    start_clock(dut)
    job = Source(dut, "job", JOB)
    written = Source(dut, "written", ("n",))
    sinks = [Sink(dut, name, (field,)) for name, field in (("a", "n"), ("b", "n"), ("core", "first"), ("out", "addr"))]
    dut.done_ready.value = 0
    await reset(dut)
    job.send([fields(9, 0, 256)] * 3)
    for k in range(2):
        await sinks[0].wait(k + 1)
        written.send([(k + 5,)])
    for _ in range(30):
        await sinks[0].edge
    assert len(sinks[0].beats) == 2 and dut.done_valid.value == 1 and int(dut.done_n.value) == 5
    done = Sink(dut, "done", ("n",))
    await sinks[0].wait(3)
    written.send([(7,)])
    await done.wait(3)
    assert done.beats == [(5,), (6,), (7,)]


@cocotb.test()
async def test_reset_in_flight_forgets_the_job(dut):
    start_clock(dut)
    units = Units(dut, "random", "random")
    await reset(dut)
    units.job.send([fields(300, 3000, 256)] * 2)
    await units.serve(7, lambda k: k)
    dut.rst.value = 1
    units.job.clear()
    await reset(dut)
    for sink in (units.a, units.b, units.core, units.out, units.done):
        sink.clear()
    units.job.clear()
    jobs = [(0, 600, 128), (20, 0, 128)]
    units.job.send(fields(*one) for one in jobs)
    await units.serve(sum(len(sort_sequencer.commands(*one)) for one in jobs), lambda k: k)
    await units.done.wait(2)
    units.check(jobs)
