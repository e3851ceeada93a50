"""The merge unit with insert and delete: M01 to M06, in frames of given tables, so that the RTL's whole slice runs."""

from __future__ import annotations

import numpy as np

from golden import dma, slice
from golden.hard_cases.case import case
from golden.hard_cases.lists import sequence, valid
from golden.hard_cases.run import Run, cycles
from golden.records import INVALID, indices_of
from golden.tables import Lists

LENGTHS = (0, 1, 15, 16, 17, 255, 256, 257, 4095)
MSU = "sorting_core/test_merge_sort_unit"
CORE = "sorting_core/test_sorting_core"


def judge(run: Run, name: str, tables: list, arrivals: list, keys: np.ndarray, rtl=True, **set_keys):
    """One frame; each new table must be what is valid in the (sorted) old one and what arrives, in order."""
    frames, camera = sequence(run if rtl else Run(run.settings), tables, arrivals, keys, True, **set_keys)
    frame = frames.frame(camera)
    wrong = lengths = 0
    for t, (table, new) in enumerate(zip(tables, arrivals)):
        table = np.asarray(table, np.int64)
        want = np.sort(np.concatenate([table[table < INVALID], valid(keys, new)]))
        got = frame.order.tile(t)
        lengths += got.size != want.size
        wrong += 0 if got.size != want.size else int((got != want).sum())
    run.equal(f"{name}: tables of the wrong length", lengths, 0)
    run.equal(f"{name}: entries out of place", wrong, 0)
    return frame


@case("M01", "Length grid", f"{MSU}: every_pair_of_lengths", f"{CORE}: every_length_in_data_and_cycles")
def m01(run: Run) -> None:
    for seed in (0, 1):
        rng = np.random.default_rng(seed)
        keys = rng.integers(0, 1 << run.formats.key_w, 8190)
        pairs = [(a, b) for a in LENGTHS for b in LENGTHS]
        picks = [rng.permutation(8190)[: a + b] for a, b in pairs]
        tables = [valid(keys, pick[:a]) for pick, (a, _) in zip(picks, pairs)]
        judge(
            run,
            f"81 pairs of lengths, seed {seed}",
            tables,
            [p[a:] for p, (a, _) in zip(picks, pairs)],
            keys,
            seed == 0,
        )


@case("M02", "Everything invalid", "sorting_core/test_sort_lane: a_table_of_invalid_entries_becomes_empty")
def m02(run: Run) -> None:
    keys = np.arange(1000) + 7
    dead = valid(keys, np.arange(256)) | INVALID
    frame = judge(run, "256 invalid, 0 and 5 incoming", [dead, dead], [[], np.arange(500, 505)], keys)
    run.equal("lengths", frame.order.lengths[:2].tolist(), [0, 5])
    run.equal("outgoing", frame.counters["outgoing"], 512)
    first, second = frame.raster.value[:64, :64], frame.raster.value[:64, 64:128]
    run.equal("first tile: values that are not the background", int(np.count_nonzero(first)), 0)
    run.equal("second tile: pixels that 5 splats drew", int(np.count_nonzero(second[..., 0])), 64)


@case("M03", "Patterns of holes", f"{MSU}: holes_do_not_end_a_list")
def m03(run: Run) -> None:
    n = 1024
    keys = np.random.default_rng(3).permutation(n) * 5 + 7
    whole = valid(keys, np.arange(n))
    at = np.arange(n)
    holes = [at % 2 == 0, at % 2 == 1, at != 0, at != n - 1]
    holes += [(at >= start) & (at < start + length) for length in (16, 17, 256) for start in (0, 120, 250, n - length)]
    tables = [np.where(hole, whole | INVALID, whole) for hole in holes]
    frame = judge(run, f"{len(holes)} patterns", tables, [[]] * len(holes), keys)
    run.equal("outgoing", frame.counters["outgoing"], sum(int(hole.sum()) for hole in holes))


@case("M04", "Equal keys on both inputs", f"{MSU}: equal_keys_follow_the_index")
def m04(run: Run) -> None:
    keys = np.full(2000, 7)
    tables, arrivals = [], []
    for n in (100, 1000):  # the longer ones cross the borders of chunks
        tables.append(valid(keys, np.arange(0, 2 * n, 2)))
        arrivals.append(np.arange(1, 2 * n, 2))
    frame = judge(run, "even indices meet odd ones", tables, arrivals, keys)
    order = indices_of(frame.order.tile(1))
    run.equal("indices that do not ascend", int((np.diff(order) != 1).sum()), 0)


@case("M05", "Stall everywhere", f"{MSU}: lists_are_merged_under_stalls", f"{CORE}: lists_pass_under_stalls")
def m05(run: Run) -> None:
    rng = np.random.default_rng(5)
    keys = rng.integers(0, 1 << run.formats.key_w, 2000)
    picks = [rng.permutation(2000) for _ in range(4)]
    tables, new = [valid(keys, pick[:900]) for pick in picks], [pick[900:1500] for pick in picks]
    frames = [
        judge(run, f"memory late at random by up to {jitter} cycles", tables, new, keys, answer_jitter=jitter)
        for jitter in (0, 30, 600)
    ]
    differ = sum(int((frame.written.words != frames[0].written.words).sum()) for frame in frames)
    run.equal("entries that differ", differ, 0)
    lists = [Lists.join(part) for part in (tables, [valid(keys, indices) for indices in new])]
    lists = [(part.offsets, part.words) for part in lists]
    took = {
        int(slice.sort_jobs(run.formats, *lists, latency=dma.Latency(40, 20, jitter, 1))[0][0])
        for jitter in (0, 30, 600)
    }
    run.equal("different cycles of the first sort", len(took), 3)


@case("M06", "More incoming than table", f"{CORE}: more_incoming_than_table")
def m06(run: Run) -> None:
    keys = np.random.default_rng(6).integers(0, 1 << run.formats.key_w, 65546)
    judge(run, "10 entries, 3000 incoming", [valid(keys, np.arange(10))], [np.arange(10, 3010)], keys)
    frames = [
        judge(run, f"10 entries, {n} incoming", [valid(keys, np.arange(10))], [np.arange(10, n + 10)], keys)
        for n in (32768, 65536)
    ]
    run.at_most("cycles of 65,536 incoming over those of 32,768", cycles(frames[1]) / cycles(frames[0]), 2.2)
