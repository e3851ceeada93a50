"""Figs. 5, 10, 16, 18: bytes."""

from __future__ import annotations

from golden import cameras
from golden.report.reproduce.figures import Figure
from golden.report.reproduce.figures.measures import FRAMES, STAGES, frame_bytes, gigabytes, less, seconds, steady
from golden.report.reproduce.paper import FPS, GB
from golden.report.reproduce.pivots import Pivot
from golden.report.reproduce.plan import Plan
from golden.report.reproduce.plots import Panel
from golden.report.reproduce.rows import MEAN, Rows
from golden.timing import gpu

SCRATCH = ("gpu", "gscore")  # machines of Fig. 5
MACHINES = ("gpu", "gscore", "gscore-64", "neo", "splatcore")
PARTS = ("gscore", "neo-s", "neo")  # Fig. 18, from GSCore to Neo
TOUCHED = "entries of a Gaussian in sight"  # tiles that it is listed in
SOFTWARE = "gpu, Neo in software"
SOFTWARE_ENTRY = 8  # bytes of a table's entry on a GPU: 32-bit depth, 32-bit index: assumed
SOFTWARE_PASSES = 2  # over the table, read and written: sort the chunks, merge and delete: assumed


def _gigabytes(runs, cases: dict, stages=STAGES) -> dict:
    return {scene: gigabytes(runs[case], stages) for scene, case in cases.items()}


def fig5_cases(plan: Plan) -> list:
    return [plan.case(scene, size, name) for size in plan.sizes for scene in plan.names for name in SCRATCH]


def fig5(rows: Rows, plan: Plan, runs) -> None:
    for size in plan.sizes:
        for name in SCRATCH:
            cases = {scene: plan.case(scene, size, name) for scene in plan.names}
            total = _gigabytes(runs, cases)
            rows.each(size, name, GB, total)
            parts = {stage: _gigabytes(runs, cases, (stage,)) for stage in STAGES}
            for stage in STAGES:
                rows.each(size, name, f"{stage}, {GB}", parts[stage])
            share = 100 * sum(parts["sorting"].values()) / sum(total.values())
            rows.summary(size, name, "sorting's share, %", share)


def fig10_cases(plan: Plan) -> list:
    return [plan.case(scene, plan.top, name) for scene in plan.names for name in ("gpu", "neo")]


def software(frame: dict, reuse: dict, width: int, height: int) -> dict[str, dict[str, float]]:
    """Neo's algorithm on the GPU of `frame`: stage -> bytes, seconds, from its frame and Neo's.

    Tables of 16-pixel tiles as the GPU's; incoming entries are sorted as all entries are there, the others pass
    SOFTWARE_PASSES times; rasterisation writes each entry back. Their share is that of Neo's larger tiles, which is
    a lower bound; membership costs nothing. Streams run at gpu.EFFICIENCY.
    """
    pair = sum(gpu.frame(0, 0, 0, 1, width, height, 1).bytes["sorting"].values())
    old = frame_bytes(frame, ("sorting",))
    entries = old / pair
    share = reuse["incoming"] / max(reuse["entries"], 1)
    sort = share * old + entries * SOFTWARE_ENTRY * 2 * SOFTWARE_PASSES
    back = entries * SOFTWARE_ENTRY
    rate = gpu.BANDWIDTH * gpu.EFFICIENCY
    raster = frame_bytes(frame, ("raster",)) + back
    return {
        "preprocess": {"bytes": frame_bytes(frame, ("preprocess",)), "seconds": seconds(frame, "preprocess")},
        "sorting": {"bytes": sort, "seconds": sort / rate},
        "raster": {"bytes": raster, "seconds": max(seconds(frame, "raster"), raster / rate)},
    }


def _stages(plan: Plan, runs, scene: str) -> tuple[dict, dict]:
    """Stage -> bytes, seconds of the last frame, sorted from scratch and by Neo's algorithm."""
    frame = steady(runs[plan.case(scene, plan.top, "gpu")])[-1]
    reuse = steady(runs[plan.case(scene, plan.top, "neo")])[-1]
    before = {stage: {"bytes": frame_bytes(frame, (stage,)), "seconds": seconds(frame, stage)} for stage in STAGES}
    return before, software(frame, reuse, *cameras.parse_size(plan.top))


def fig10(rows: Rows, plan: Plan, runs) -> None:
    found = {scene: _stages(plan, runs, scene) for scene in plan.names}

    def total(k: int, unit: str, stages=STAGES) -> float:
        return sum(parts[k][stage][unit] for parts in found.values() for stage in stages)

    for k, name in enumerate(("gpu", SOFTWARE)):
        for stage in STAGES:
            mine = {scene: parts[k][stage] for scene, parts in found.items()}
            rows.each(plan.top, name, f"{stage}, {GB}", {s: part["bytes"] * FRAMES / 1e9 for s, part in mine.items()})
            rows.each(plan.top, name, f"{stage}, ms", {s: 1e3 * part["seconds"] for s, part in mine.items()})
        share = total(k, "seconds", ("raster",)) / total(k, "seconds")
        rows.summary(plan.top, name, "raster's share of the time, %", 100 * share)
    for words, stages in (("", STAGES), (" of sorting", ("sorting",))):
        saved = less(total(1, "bytes", stages), total(0, "bytes", stages))
        rows.summary(plan.top, SOFTWARE, f"less traffic{words}, %", saved)
        rows.summary(plan.top, SOFTWARE, f"speed-up{words}", total(0, "seconds", stages) / total(1, "seconds", stages))


def fig16_cases(plan: Plan) -> list:
    return [plan.case(scene, plan.top, name) for scene in plan.names for name in MACHINES]


def fig16(rows: Rows, plan: Plan, runs) -> None:
    found = {name: _gigabytes(runs, {s: plan.case(s, plan.top, name) for s in plan.names}) for name in MACHINES}
    for name in MACHINES:
        rows.each(plan.top, name, GB, found[name])
    for name in ("neo", "splatcore"):
        for other in ("gpu", "gscore", "gscore-64"):
            saved = less(sum(found[name].values()), sum(found[other].values()))
            rows.summary(plan.top, name, f"less than {other}, %", saved)
    rows.summary(
        plan.top, "splatcore", "less than neo, %", less(sum(found["splatcore"].values()), sum(found["neo"].values()))
    )
    touched = {}
    for scene in plan.names:
        frames = steady(runs[plan.case(scene, plan.top, "neo")])
        touched[scene] = sum(f["entries"] for f in frames) / max(sum(f["counters"]["visible"] for f in frames), 1)
    rows.each(plan.top, "neo", TOUCHED, touched)


def fig18_cases(plan: Plan) -> list:
    return [plan.case(scene, plan.top, name) for scene in plan.names for name in PARTS]


def fig18(rows: Rows, plan: Plan, runs) -> None:
    cases = {name: {s: plan.case(s, plan.top, name) for s in plan.names} for name in PARTS}
    fps = {name: {s: runs[case]["fps"] for s, case in cases[name].items()} for name in PARTS}
    moved = {name: _gigabytes(runs, cases[name]) for name in PARTS}
    mean = {name: sum(moved[name].values()) for name in PARTS}
    for name, before in (("neo-s", "gscore"), ("neo", "neo-s"), ("neo", "gscore")):
        rows.each(plan.top, name, f"speed-up over {before}", {s: fps[name][s] / fps[before][s] for s in fps[name]})
        rows.summary(plan.top, name, f"less traffic than {before}, %", less(mean[name], mean[before]))
    rows.summary(plan.top, "neo-s", "more traffic than neo, %", -less(mean["neo-s"], mean["neo"]))
    for name in PARTS:
        rows.each(plan.top, name, FPS, fps[name])
        rows.each(plan.top, name, GB, moved[name])


BY_STAGE = tuple(f"{stage}, {GB}" for stage in STAGES)
LATENCIES = tuple(f"{stage}, ms" for stage in STAGES)
FIGURES = (
    Figure(
        "fig5", "Fig. 5: traffic by stage and resolution", fig5_cases, fig5,
        tuple(Panel(quantity, scene=MEAN) for quantity in BY_STAGE),
        (Pivot((GB,)), Pivot((*BY_STAGE, GB), across="quantity")),
    ),
    Figure(
        "fig10", "Fig. 10: Neo in software on a GPU", fig10_cases, fig10,
        (
            Panel(BY_STAGE, across="quantity", scene=MEAN, unit=GB),
            Panel(LATENCIES, across="quantity", scene=MEAN, unit="ms"),
        ),
        (Pivot(BY_STAGE, across="quantity"), Pivot(LATENCIES, across="quantity")),
    ),
    Figure(
        "fig16", "Fig. 16: traffic of 60 frames", fig16_cases, fig16,
        (Panel(GB, across="scene", log=True),),
        (
            Pivot((GB,), "scene", "hardware", True),
            Pivot(tuple(f"less than {name}, %" for name in MACHINES), across="quantity"),
            Pivot((TOUCHED,), across="scene", each=True),
        ),
    ),
    Figure(
        "fig18", "Fig. 18: from GSCore to Neo in steps", fig18_cases, fig18,
        (Panel(FPS, across="hardware", series="scene"), Panel(GB, across="hardware", series="scene")),
        (Pivot((FPS, GB), across="quantity"),),
    ),
)  # fmt: skip
