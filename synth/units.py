"""The units that `make synth` reports, and what of the paper's Table 4 stands beside each."""

from __future__ import annotations

from dataclasses import dataclass

from golden.errors import InputError
from golden.params import SORT_CORES
from golden.report.reproduce.figures.silicon import PARTS
from golden.report.reproduce.paper import COUNT, TABLE4


@dataclass(frozen=True)
class Unit:
    """`paper` {row of Table 4: how many sixteenths of it do what the unit does}; `aim` um2 for step 4's redesign."""

    module: str
    what: str
    paper: dict[str, int] | None = None
    aim: float | None = None

    def theirs(self, column: int) -> float | None:
        """mm2 (column 0) or mW (1) of what does the same in the paper."""
        return self.paper and sum(TABLE4[row][column] * n for row, n in self.paper.items()) / COUNT


SHARES = {part.module: {row: COUNT // part.count} for row, part in PARTS.items()}
BSU, MSU, RASTER = (SHARES[f"gs_{name}"] for name in ("bitonic_sort_unit", "merge_sort_unit", "raster_core"))
LIST = (
    Unit("gs_bitonic_sort_unit", "BSU", BSU, 300),
    Unit("gs_merge_sort_unit", "MSU+", MSU, 150),
    Unit("gs_chunk_sorter", "BSU, MSU+ and chunk buffers", BSU | MSU, 450),
    Unit("gs_sorting_core", "sorting core", SHARES["gs_sorting_core"]),
    Unit("gs_intersection_test_unit", "ITU, without its set-up", {"Intersection Test Unit": 1}, 500),
    Unit("gs_group_test_unit", "4 ITUs and their set-up", SHARES["gs_group_test_unit"], 2000),
    Unit("gs_group_finder", "groups an entry may hit"),
    Unit("gs_candidate_matrix", "candidates of each group"),
    Unit("gs_candidate_tester", "tests the candidates: 4 ITUs"),
    Unit("gs_exp2_unit", "2^-p, one lane"),
    Unit("gs_power_unit", "p of 16 lanes"),
    Unit("gs_subtile_compute_unit", "SCU, 16 lanes", SHARES["gs_subtile_compute_unit"], 7800),
    Unit("gs_late_sorter", "sorts a batch by fresh keys"),
    Unit("gs_raster_core", "raster core: 4 ITUs, 4 SCUs", RASTER),
    Unit("gs_late_core", "raster core with late sort", RASTER),
    Unit("gs_slice", "slice: 4 sorting, 1 raster core, DMA", RASTER | {"Sorting Engine": SORT_CORES}),
)


def named(name: str) -> list[Unit]:
    """The unit of a module, or all of them."""
    found = [unit for unit in LIST if name in ("all", unit.module)]
    if not found:
        raise InputError(f"UNIT={name}: wants all, {', '.join(unit.module for unit in LIST)}")
    return found
