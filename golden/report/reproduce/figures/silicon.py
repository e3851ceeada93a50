"""Tables 3 and 4, area and power of the units; and how many frames a second an area draws.

Areas and power are the kept ones of `make synth` and `make power` (docs/synthesis.md).
"""

from __future__ import annotations

import json
from dataclasses import dataclass

from golden.errors import InputError
from golden.report.accuracy import area
from golden.report.reproduce.figures import Figure
from golden.report.reproduce.paper import AREA, BOTH_ENGINES, COUNT, ENGINES, FPS, NODE, POWER, TABLE4
from golden.report.reproduce.pivots import Pivot
from golden.report.reproduce.plan import ROOT, Case, Plan
from golden.report.reproduce.plots import Panel
from golden.report.reproduce.rows import Rows

RESULTS = ROOT / "synth" / "results"
CLOCK = "clock, MHz"


@dataclass(frozen=True)
class Part:
    """Modules of ours that do what a row of Table 4 does; an engine's hold its memories."""

    module: str
    count: int
    engine: bool = False


PARTS = {
    "Merge Sort Unit+": Part("gs_merge_sort_unit", COUNT),
    "Bitonic Sort Unit": Part("gs_bitonic_sort_unit", COUNT),
    "Sorting Engine": Part("gs_sorting_core", COUNT, engine=True),
    "Subtile Compute Unit": Part("gs_subtile_compute_unit", COUNT),
    "Intersection Test Unit": Part("gs_group_test_unit", area.SLICES),  # four, and what they share
    "Rasterization Engine": Part("gs_raster_core", area.SLICES, engine=True),
}
INSIDE = {
    "Sorting Engine": ("Merge Sort Unit+", "Bitonic Sort Unit"),
    "Rasterization Engine": ("Subtile Compute Unit", "Intersection Test Unit"),
}
SLICES = (1, 2, 4)
MACHINES = ("neo", "splatcore")
SMALLER, FASTER = "the paper's area over ours", "fps over neo of 4 slices"


def _kept(name: str) -> dict:
    file = RESULTS / f"{name}.json"
    try:
        return json.loads(file.read_text())
    except OSError as error:
        raise InputError(f"{file.name}: {error.strerror}; wants the results of `make synth` and `make power`") from None


def _area(part: Part) -> float:
    """mm2."""
    found = _kept(part.module)
    return part.count * (found["area_um2"] + part.engine * found["memory_um2"]) / 1e6


def _power(part: Part) -> float | None:
    """mW, busy, without wires; None where it was not measured."""
    found = _kept("power").get(part.module)
    return found and part.count * (found["0"]["busy_mw"] + part.engine * found.get("memory_mw", 0))


def table3(rows: Rows, plan: Plan, runs) -> None:
    rows.whole(NODE, ENGINES, AREA, sum(_area(PARTS[name]) for name in INSIDE))
    measured = ("Sorting Engine", *INSIDE["Rasterization Engine"])
    rows.whole(NODE, ENGINES, POWER, sum(_power(PARTS[name]) for name in measured))
    rows.whole(NODE, ENGINES, CLOCK, min(_kept(PARTS[name].module)["clock_mhz"]["0"] for name in INSIDE))


def table4(rows: Rows, plan: Plan, runs) -> None:
    for quantity, value in ((AREA, _area), (POWER, _power)):
        found = {name: value(part) for name, part in PARTS.items()}
        for engine, inside in INSIDE.items():
            if found[engine] is not None:
                found[f"{engine}, buffers and others"] = found[engine] - sum(found[name] for name in inside)
        for name in TABLE4:
            if found.get(name) is not None:
                rows.whole(NODE, name, quantity, found[name])


def _case(plan: Plan, scene: str, name: str, slices: int) -> Case:
    return plan.case(scene, plan.top, name, **({"slices": slices} if slices != area.SLICES else {}))


def slices_cases(plan: Plan) -> list[Case]:
    return [_case(plan, scene, name, count) for scene in plan.names for name in MACHINES for count in SLICES]


def slices(rows: Rows, plan: Plan, runs) -> None:
    four = {scene: runs[_case(plan, scene, "neo", area.SLICES)]["fps"] for scene in plan.names}
    for name in MACHINES:
        for count in SLICES:
            machine = f"{name}, {count} slices" if count > 1 else f"{name}, 1 slice"
            fps = {scene: runs[_case(plan, scene, name, count)]["fps"] for scene in plan.names}
            mm2 = area.mm2(name, (f"slices={count}",))
            rows.whole(plan.top, machine, AREA, mm2)
            rows.whole(plan.top, machine, SMALLER, BOTH_ENGINES[0] / mm2)
            rows.each(plan.top, machine, FPS, fps)
            rows.each(plan.top, machine, FASTER, {scene: fps[scene] / four[scene] for scene in plan.names})


FIGURES = (
    Figure("table3", "Table 3: area, power, clock", lambda plan: [], table3, (Panel(AREA), Panel(POWER)), ()),
    Figure(
        "table4", "Table 4: area and power of the units", lambda plan: [], table4,
        (Panel(AREA, across="hardware", series="size"), Panel(POWER, across="hardware", series="size")), (),
    ),
    Figure(
        "slices", "Frames a second by area", slices_cases, slices,
        (Panel(FASTER, across="hardware", series="scene"), Panel(AREA, across="hardware", series="size")),
        (Pivot((AREA, SMALLER, FPS, FASTER), across="quantity"), Pivot((FASTER,), across="scene", each=True)),
    ),
)  # fmt: skip
