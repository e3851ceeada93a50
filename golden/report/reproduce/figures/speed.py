"""Figs. 3, 4, 15, 17: frames a second."""

from __future__ import annotations

import numpy as np

from golden.report.reproduce.figures import Figure
from golden.report.reproduce.paper import FPS, MS
from golden.report.reproduce.pivots import Pivot
from golden.report.reproduce.plan import Plan
from golden.report.reproduce.plots import Panel
from golden.report.reproduce.rows import MEAN, Rows

MACHINES = ("gpu", "gscore", "gscore-64", "neo", "splatcore")
CORES = (4, 8, 16)  # GSCore's: four in a slice
CHANNELS = (4, 8, 16)  # 12.8 GB/s each
SPEEDS = (1, 2, 4, 8, 16)
INCOMING = tuple(f"incoming at motion x{x}, % of the entries" for x in SPEEDS)


def _fps(runs, cases: dict) -> dict:
    return {scene: runs[case]["fps"] for scene, case in cases.items()}


def _ratios(ours: dict, others: dict) -> dict:
    return {scene: ours[scene] / others[scene] for scene in ours}


def _gscore(plan: Plan, scene: str, size: str, cores: int, channels: int):
    keys = {"slices": cores // 4} if cores != max(CORES) else {}
    return plan.case(scene, size, "gscore", **keys, **({"channels": channels} if channels != CHANNELS[0] else {}))


def fig3_cases(plan: Plan) -> list:
    return [
        case
        for size in plan.sizes
        for scene in plan.names
        for case in (_gscore(plan, scene, size, 4, 4), plan.case(scene, size, "gpu"))
    ]


def fig3(rows: Rows, plan: Plan, runs) -> None:
    for size in plan.sizes:
        small = {scene: _gscore(plan, scene, size, 4, 4) for scene in plan.names}
        rows.each(size, "gscore, 4 cores", FPS, _fps(runs, small))
        rows.each(size, "gpu", FPS, _fps(runs, {scene: plan.case(scene, size, "gpu") for scene in plan.names}))


def fig4_cases(plan: Plan) -> list:
    return [
        _gscore(plan, s, plan.top, cores, channels) for s in plan.detail for cores in CORES for channels in CHANNELS
    ]


def fig4(rows: Rows, plan: Plan, runs) -> None:
    found = {}
    for cores in CORES:
        for channels in CHANNELS:
            cases = {scene: _gscore(plan, scene, plan.top, cores, channels) for scene in plan.detail}
            found[cores, channels] = _fps(runs, cases)
            name = f"gscore, {cores} cores, {12.8 * channels:.1f} GB/s"
            rows.each(plan.top, name, FPS, found[cores, channels])
    rows.each(plan.top, "gscore, 51.2 GB/s", "fps of 16 cores over 4", _ratios(found[16, 4], found[4, 4]))
    rows.each(plan.top, "gscore, 16 cores", "fps at 204.8 over 51.2 GB/s", _ratios(found[16, 16], found[16, 4]))


def fig15_cases(plan: Plan) -> list:
    return [plan.case(scene, size, name) for size in plan.sizes for scene in plan.names for name in MACHINES]


def fig15(rows: Rows, plan: Plan, runs) -> None:
    for size in plan.sizes:
        found = {name: _fps(runs, {s: plan.case(s, size, name) for s in plan.names}) for name in MACHINES}
        for name in MACHINES:
            rows.each(size, name, FPS, found[name])
            rows.each(size, name, MS, {scene: 1e3 / fps for scene, fps in found[name].items()})
        for name in ("neo", "splatcore"):
            for other in ("gpu", "gscore", "gscore-64"):
                rows.each(size, name, f"speed-up over {other}", _ratios(found[name], found[other]))
        rows.each(size, "splatcore", "speed-up over neo", _ratios(found["splatcore"], found["neo"]))


def fig17a_cases(plan: Plan) -> list:
    return [plan.case(plan.large.name, plan.top, name) for name in MACHINES]


def fig17a(rows: Rows, plan: Plan, runs) -> None:
    for name in MACHINES:
        rows.each(plan.top, name, FPS, _fps(runs, {plan.large.name: plan.case(plan.large.name, plan.top, name)}))


def _moved(plan: Plan, scene: str, name: str, speed: int):
    return plan.case(scene, plan.top, name, speed=float(speed))


def fig17b_cases(plan: Plan) -> list:
    return [_moved(plan, scene, n, x) for scene in plan.detail for n in ("neo", "splatcore") for x in SPEEDS]


def fig17b(rows: Rows, plan: Plan, runs) -> None:
    for name in ("neo", "splatcore"):
        for x in SPEEDS:
            found = {scene: runs[_moved(plan, scene, name, x)] for scene in plan.detail}
            rows.each(plan.top, name, f"fps at motion x{x}", {s: r["fps"] for s, r in found.items()})
    for k, x in enumerate(SPEEDS):
        shares = {}
        for scene in plan.detail:
            frames = runs[_moved(plan, scene, "neo", x)]["per_frame"][1:]
            shares[scene] = 100 * float(np.mean([f["incoming"] / max(f["entries"], 1) for f in frames]))
        rows.each(plan.top, "neo", INCOMING[k], shares)


FIGURES = (
    Figure(
        "fig3", "Fig. 3: frames a second by resolution", fig3_cases, fig3,
        (Panel(FPS, scene=MEAN),), (Pivot((FPS,)),),
    ),
    Figure(
        "fig4", "Fig. 4: GSCore by cores and bandwidth", fig4_cases, fig4,
        (Panel(FPS, across="hardware", series="scene"),), (Pivot((FPS,), across="scene", each=True),),
    ),
    Figure(
        "fig15", "Fig. 15: frames a second", fig15_cases, fig15,
        (
            Panel(FPS, scene=MEAN),
            Panel("speed-up over gscore", scene=MEAN),
            Panel("speed-up over gpu", scene=MEAN),
        ),
        (
            Pivot((FPS,)), Pivot((MS,)), Pivot(("speed-up over gscore",)), Pivot(("speed-up over gpu",)),
            Pivot(("speed-up over gscore-64",)), Pivot((FPS,), "scene", "hardware", True),
        ),
    ),
    Figure(
        "fig17a", "Fig. 17(a): a large scene", fig17a_cases, fig17a,
        (Panel(FPS, across="hardware", series="scene", scene=MEAN),), (Pivot((FPS,), across="quantity"),),
    ),
    Figure(
        "fig17b", "Fig. 17(b): rapid camera motion", fig17b_cases, fig17b,
        (Panel("fps at motion x", scene=MEAN, lines=True), Panel("incoming at motion x", series="scene", lines=True)),
        (
            Pivot(tuple(f"fps at motion x{x}" for x in SPEEDS), "quantity", "hardware"),
            Pivot(INCOMING, "quantity", "scene", True),
        ),
    ),
)  # fmt: skip
