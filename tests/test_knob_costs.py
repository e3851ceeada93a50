"""The knobs of sorting and refresh: what each adds to a frame or takes from it, in cycles and bytes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from golden import params, scene, tables
from golden.errors import InputError
from golden.formats import REFERENCE
from golden.frame import Frame
from golden.hard_cases.setting import camera_a
from golden.records import INVALID
from golden.settings import CHUNKS, Settings, parse
from golden.slice import sort_jobs
from golden.sorting_core import sort_lane, sorting_core
from golden.timing import jobs, memory, simulate
from golden.timing.accelerator import Accelerator
from golden.timing.address_map import LINE, list_lines
from golden.timing.hardware import HARDWARE, configure
from tests.hard_cases.test_tables import check_invariants, crowd
from tests.test_knobs import SIZE, frames, pair, same, track, walls

NEO = HARDWARE["neo"]


def drawn(frame: Frame, machine=NEO, shown=None, **keys):
    """A frame as an accelerator works on it, its first."""
    keys.setdefault("chunk", params.CHUNK)
    firsts = tuple(sorting_core.first_length(k, keys["chunk"]) for k in range(keys.get("passes", 1)))
    shown = crowd(31, 3000) if shown is None else shown
    return Accelerator(machine, shown, *SIZE, Settings(**keys)).prepare(replace(frame, firsts=firsts))


def valid(frame: Frame) -> int:
    """Entries of the tables that are not dropped."""
    return int(np.count_nonzero(frame.table.words < INVALID))


def lines(job: jobs.Jobs, write: bool) -> int:
    return int(job.lines[job.write == write].sum())


def test_a_pass_more_costs_a_job_of_its_own():
    """Cycles are those of jobs that the RTL does: the table alone, then what came of it with the incoming entries."""
    *_, frame = frames(track(3, 2.0), passes=2)
    cycles, words = sort_jobs(REFERENCE, pair(frame.table), pair(frame.incoming), frame.firsts)
    none = np.zeros(0, np.int64)
    for t in range(4):
        assert np.array_equal(words[t], frame.order.tile(t))
        alone, table = sort_lane.job(REFERENCE, frame.table.tile(t), none, frame.firsts[0])
        behind, _ = sort_lane.job(REFERENCE, table, frame.incoming.tile(t), frame.firsts[1])
        assert cycles[t] == alone + behind - 2


def test_a_pass_more_reads_and_writes_the_table_once_more():
    *_, frame = frames(track(3, 2.0), passes=2)
    one, two = (drawn(frame, passes=count).jobs for count in (1, 2))
    for write in (False, True):
        entries = frame.table.lengths.sum() * REFERENCE.entry_bytes
        more = lines(two, write) - lines(one, write)
        assert list_lines(frame.table.lengths, REFERENCE.entry_bytes) <= more <= entries // LINE + 2 * len(two.line)


def test_new_keys_cost_a_pass_over_the_table_and_the_line_of_each_record():
    *_, frame = frames(track(3, 2.0), depth="fresh")
    fresh, stale = (drawn(frame, depth=depth).jobs for depth in ("fresh", "deferred"))
    table = list_lines(frame.table.lengths, REFERENCE.entry_bytes)
    assert lines(fresh, True) - lines(stale, True) == table
    assert lines(fresh, False) - lines(stale, False) == table + valid(frame)  # records 32 bytes apart
    assert np.array_equal(fresh.cycles - stale.cycles, jobs.renew_cycles(frame.table.lengths))
    cached = drawn(frame, replace(NEO, cache_kb=128), depth="fresh").jobs
    assert lines(cached, False) < lines(fresh, False)


def test_the_memory_sees_the_pass_of_new_keys():
    *_, frame = frames(track(3, 2.0), depth="fresh")
    seen = {}
    for depth in ("fresh", "deferred"):
        accelerator = Accelerator(NEO, crowd(31, 3000), *SIZE, Settings(depth=depth))
        work = accelerator.prepare(replace(frame, firsts=(128,)))
        seen[depth] = accelerator.run(work.blocks, work)[0], accelerator.memory.lines[memory.SORTING].copy()
    more = seen["fresh"][1] - seen["deferred"][1]
    table = list_lines(frame.table.lengths, REFERENCE.entry_bytes)
    assert more.tolist() == [table + valid(frame), table]
    assert seen["fresh"][0] > seen["deferred"][0]


def test_a_longer_chunk_costs_more_cycles_and_fewer_passes_from_scratch():
    words = np.arange(4096, dtype=np.int64)[::-1].copy()
    none = np.zeros(0, np.int64)
    repair = [sort_lane.job(REFERENCE, words, none, chunk, chunk=chunk)[0] for chunk in CHUNKS]
    assert repair == sorted(repair)
    per_entry = [sorting_core.pass_cycles(chunk) / chunk for chunk in CHUNKS]
    for chunk, passes in zip(CHUNKS, per_entry, strict=True):
        want = -(-int(np.log2(chunk / params.SORT_N) - 1) // 2)  # to runs four times as long, until there are two
        assert want <= passes < want + 0.05
    scratch = [len(sort_lane.commands(0, 4096, chunk, chunk)) for chunk in CHUNKS]
    assert scratch == [1 + 4096 // chunk - 1 for chunk in CHUNKS]


@pytest.mark.parametrize("chunk", CHUNKS)
def test_late_sort_works_on_windows_of_a_chunk(chunk):
    *_, frame = frames(track(3, 2.0), late=True, chunk=chunk)
    check_invariants(frame)
    first = frame.firsts[0]
    drawn_again = tables.late_sort(frame.merged, frame.features.key, first, chunk)
    assert np.array_equal(drawn_again.words, frame.order.words)
    begins = np.diff(frame.raster.batch_offsets)
    lengths = frame.order.lengths
    assert np.array_equal(begins, np.where(lengths > 0, 1 + -(-np.maximum(lengths - first, 0) // chunk), 0))
    machine = replace(HARDWARE["splatcore"], skip_blank=False)
    accelerator = Accelerator(machine, crowd(31, 3000), *SIZE, Settings(chunk=chunk))
    work = accelerator.prepare(frame)
    assert accelerator.run(work.blocks, work)[0] > 0
    assert accelerator.lanes[-1].sum() > 0


@pytest.mark.parametrize("machine", ["neo", "neo-s", "gscore-64", "splatcore"])
def test_what_is_not_refreshed_is_not_fetched(machine):
    hardware = replace(HARDWARE[machine], cache_kb=0, record_stride=32, skip_blank=False)
    late = bool(hardware.late_sort)
    sorting = "full" if hardware.scratch else "reuse"
    used = {}
    for refresh in ("all", "none"):
        frame = frames(track(1), walls(), sorting, late, refresh=refresh)[0]
        accelerator = Accelerator(hardware, walls(), *SIZE, Settings(refresh=refresh))
        work = accelerator.prepare(frame)
        accelerator.run(work.blocks, work)
        used[refresh] = accelerator.memory.lines[memory.RASTER].copy(), work.tests, len(work.after.read)
    stale, fetched = frame.counters["stale_entries"], frame.raster.fetched
    size = hardware.entry_bytes
    lists = list_lines(frame.order.lengths, size) - list_lines(fetched, size)
    (reads, writes), tests, after = (used["all"][k] - used["none"][k] for k in range(3))
    assert stale > 0
    # With late sort the lists pass through the raster core, whatever is drawn of them.
    assert reads == stale if late else stale <= reads - lists <= stale + len(fetched)
    if not hardware.scratch and not late and hardware.deferred_update:
        assert lists - len(fetched) <= writes <= lists + len(fetched)
    if late:
        assert abs(writes) <= len(fetched)
    if hardware.raster == "groups":
        assert tests == stale * params.GROUPS
    if not hardware.deferred_update:
        assert after >= stale + lists


def test_harmonics_above_the_degree_are_not_there():
    shown = scene.load("builtin:room?n=2000&sh=3")
    camera = camera_a(position=(0, -1.2, -1))
    pictures = {degree: frames([camera], shown, sh_degree=degree)[0] for degree in range(4)}
    assert same(pictures[3], frames([camera], shown)[0])
    for degree, terms in enumerate((1, 4, 9, 16)):
        less = replace(shown, sh=np.ascontiguousarray(shown.sh[:, :terms]))
        assert same(pictures[degree], frames([camera], less)[0])
    assert not same(pictures[2], pictures[3])
    blocks = {degree: drawn(pictures[degree], shown=shown, sh_degree=degree).blocks for degree in range(4)}
    reads = [len(blocks[degree].read) for degree in range(4)]
    assert reads == sorted(set(reads))
    assert blocks[0].cycles.sum() < blocks[3].cycles.sum()


@pytest.mark.parametrize(
    ("machine", "changes", "pair_of"),
    [
        ("gscore", [], "refresh=none"),
        ("neo", ["record_stride=24"], "depth=predicted"),
        ("neo", ["record_stride=16"], "record_stride=16"),
        ("neo", ["entry_bytes=5"], "entry_bytes=5"),
        ("neo", ["late_sort=1"], "chunk=512"),
    ],
)
def test_accelerators_refuse_what_they_cannot_do(machine, changes, pair_of):
    keys = [] if pair_of in changes else [pair_of]
    with pytest.raises(InputError, match=pair_of):
        simulate.check(configure(machine, changes), parse(keys))
    simulate.check(configure(machine, [] if pair_of in changes else changes), Settings())


@pytest.mark.parametrize(("key", "sizes"), [("entry_bytes", (6, 7, 8, 11, 16)), ("record_stride", (24, 32, 40, 64))])
def test_wider_entries_and_records_cost_their_bytes(key, sizes):
    *_, frame = frames(track(3, 2.0))
    entries = len(frame.order.words)
    for size in sizes:
        work = drawn(frame, configure("neo", [f"{key}={size}"]))
        if key == "entry_bytes":
            written = size * (frame.table.words.size + 2 * frame.incoming.words.size)  # incoming: sorted, then merged
            assert frame.incoming.lengths.max() <= params.CHUNK
            assert written // LINE <= lines(work.jobs, True) <= written // LINE + len(work.jobs.line)
        else:  # 24 and 40: some lie across a border of lines
            assert (len(work.raster.line) == entries) == (LINE % size == 0)
