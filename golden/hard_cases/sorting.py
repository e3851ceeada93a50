"""The sort unit: B01 to B04."""

from __future__ import annotations

import numpy as np

from golden import params
from golden.hard_cases.case import case
from golden.hard_cases.run import Run
from golden.records import INDEX_MASK, INVALID, entries, indices_of, keys_of
from golden.sorting_core import bitonic_sort_unit as bsu

NETWORKS = (("ring", bsu.ring), ("bitonic", bsu.bitonic))
N = params.SORT_N


@case("B01", "All 0/1 inputs", "sorting_core/test_bitonic_sweep: every_group_of_zeros_and_ones_is_sorted")
def b01(run: Run) -> None:
    groups = (np.arange(1 << N)[:, None] >> np.arange(N)) & 1
    for name, network in NETWORKS:
        unsorted = int((np.diff(network(groups), axis=1) < 0).any(axis=1).sum())
        run.equal(f"{name}: of {1 << N:,} vectors unsorted", unsorted, 0)
        short = 0
        for n in range(N):  # the places behind a short group hold what sorts last
            filled = np.where(np.arange(N) < n, groups[: 1 << n], 2)
            short += int((network(filled) != np.sort(filled, axis=1)).sum())
        run.equal(f"{name}: every length below {N}: entries out of place", short, 0)


@case("B02", "All keys equal, payload intact", "sorting_core/test_bitonic_sort_unit: equal_keys_lose_nothing")
def b02(run: Run) -> None:
    rng = np.random.default_rng(2)
    indices = np.array([rng.permutation(N) * 7 + 3 for _ in range(2000)])
    equal = entries(np.full((2000, N), 77), indices)
    two = entries(np.where(rng.random((2000, N)) < 0.5, 77, 78), indices)
    for name, network in NETWORKS:
        for keys, groups in (("one key", equal), ("two keys", two)):
            out = network(groups)
            run.equal(f"{name}, {keys}: entries lost or doubled", int((np.sort(out) != np.sort(groups)).sum()), 0)
            bad = np.diff(keys_of(out)) * (INDEX_MASK + 1) + np.diff(indices_of(out)) <= 0
            run.equal(f"{name}, {keys}: not in order of key, then index", int(bad.sum()), 0)


@case(
    "B03",
    "A real key equal to the padding key",
    "sorting_core/test_bitonic_sort_unit: entries_of_all_ones_are_not_padding",
)
def b03(run: Run) -> None:
    top = (1 << run.formats.key_w) - 1
    keys = np.array([5, top, 1, top, 9])
    group = entries(keys, np.array([4, INDEX_MASK, 8, INDEX_MASK - 1, 2]))
    out = bsu.sort_groups(group)
    run.equal("entries that come out of 5", out.size, 5)
    run.equal("the last two are all ones", keys_of(out)[3:].tolist(), [top, top])
    run.equal("the largest valid entry is below every invalid one", bool(out[-1] < INVALID), True)


@case(
    "B04",
    "Short groups after long ones",
    "sorting_core/test_bitonic_sort_unit: short_groups_follow_long_ones_under_stalls",
)
def b04(run: Run) -> None:
    counts = [N, 3, 0, 1, N - 1, N, 0, 0, N // 2 - 1]
    top, strangers, unsorted, cycles = (1 << run.formats.key_w) - 1, 0, 0, []
    for n in counts:
        group = entries(np.arange(top, top - n, -1), np.arange(n))
        top -= n
        out = bsu.sort_groups(group)
        strangers += int((~np.isin(out, group)).sum()) + abs(out.size - n)
        unsorted += int((np.diff(out) < 0).sum())
        cycles.append(bsu.cycles(n))
    run.equal("values of another group, or missing", strangers, 0)
    run.equal("entries out of order", unsorted, 0)
    run.equal("cycles of an empty list", cycles[2], 1)
