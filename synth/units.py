"""The units that `make synth` reports, and what of the paper's Table 4 stands beside each."""

from __future__ import annotations

from dataclasses import dataclass

from golden.errors import InputError
from golden.params import SORT_CORES, UNITS
from golden.report.reproduce.paper import TABLE4

PAPER_UNITS = 16  # of each kind, in Table 4
RASTER_CORES = PAPER_UNITS // UNITS


@dataclass(frozen=True)
class Unit:
    """`paper` {row of Table 4: how many sixteenths of it do what the unit does}; `aim` um2 for step 4's redesign."""

    module: str
    what: str
    paper: dict[str, int] | None = None
    aim: float | None = None

    @property
    def paper_area(self) -> float | None:
        """um2."""
        if self.paper is None:
            return None
        return sum(TABLE4[row][0] * 1e6 / PAPER_UNITS * count for row, count in self.paper.items())


RASTER = {"Rasterization Engine": PAPER_UNITS // RASTER_CORES}
LIST = (
    Unit("gs_bitonic_sort_unit", "BSU", {"Bitonic Sort Unit": 1}, 300),
    Unit("gs_merge_sort_unit", "MSU+", {"Merge Sort Unit+": 1}, 150),
    Unit("gs_chunk_sorter", "BSU, MSU+ and chunk buffers", {"Bitonic Sort Unit": 1, "Merge Sort Unit+": 1}, 450),
    Unit("gs_sorting_core", "sorting core", {"Sorting Engine": 1}),
    Unit("gs_intersection_test_unit", "ITU, without its set-up", {"Intersection Test Unit": 1}, 500),
    Unit("gs_group_test_unit", "4 ITUs and their set-up", {"Intersection Test Unit": UNITS}, 2000),
    Unit("gs_group_finder", "groups an entry may hit"),
    Unit("gs_candidate_matrix", "candidates of each group"),
    Unit("gs_candidate_tester", "tests the candidates: 4 ITUs"),
    Unit("gs_exp2_unit", "2^-p, one lane"),
    Unit("gs_power_unit", "p of 16 lanes"),
    Unit("gs_subtile_compute_unit", "SCU, 16 lanes", {"Subtile Compute Unit": 1}, 7800),
    Unit("gs_late_sorter", "sorts a batch by fresh keys"),
    Unit("gs_raster_core", "raster core: 4 ITUs, 4 SCUs", RASTER),
    Unit("gs_late_core", "raster core with late sort", RASTER),
    Unit("gs_slice", "slice: 4 sorting, 1 raster core, DMA", {"Sorting Engine": SORT_CORES, **RASTER}),
)


def named(name: str) -> list[Unit]:
    """The unit of a module, or all of them."""
    found = [unit for unit in LIST if name in ("all", unit.module)]
    if not found:
        raise InputError(f"UNIT={name}: wants all, {', '.join(unit.module for unit in LIST)}")
    return found
