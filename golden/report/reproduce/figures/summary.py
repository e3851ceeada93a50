"""Whole frames in one table: this project's accelerator beside the paper's, over all scenes."""

from __future__ import annotations

import numpy as np

from golden.report.reproduce.figures import Figure
from golden.report.reproduce.figures.extra import DB, MEGABYTES, OVER, SPREAD
from golden.report.reproduce.figures.measures import decibels, frame_bytes, steady
from golden.report.reproduce.figures.speed import MACHINES
from golden.report.reproduce.paper import FPS
from golden.report.reproduce.pivots import Pivot
from golden.report.reproduce.plan import Case, Plan
from golden.report.reproduce.plots import Panel
from golden.report.reproduce.rows import MEAN, Rows

OURS, THEIRS = "splatcore", "neo"
ENTRIES, LESS = "entries a frame", "bytes over neo's"


def _case(plan: Plan, scene: str, name: str) -> Case:
    return plan.case(scene, plan.top, name, quality=name in (OURS, THEIRS))


def summary_cases(plan: Plan) -> list:
    return [_case(plan, scene, name) for scene in plan.names for name in MACHINES]


def summary(rows: Rows, plan: Plan, runs) -> None:
    found = {name: {s: runs[_case(plan, s, name)] for s in plan.names} for name in MACHINES}
    fps = {name: {s: r["fps"] for s, r in mine.items()} for name, mine in found.items()}
    size = {
        name: {s: float(np.mean([frame_bytes(f) for f in steady(r)])) / 1e6 for s, r in mine.items()}
        for name, mine in found.items()
    }
    entries = {s: float(np.mean([f["entries"] for f in steady(r)])) for s, r in found[THEIRS].items()}
    rows.each(plan.top, THEIRS, ENTRIES, entries)
    for name, mine in found.items():
        rows.each(plan.top, name, FPS, fps[name])
        rows.each(plan.top, name, MEGABYTES, size[name])
        rows.each(plan.top, name, SPREAD, {s: r["p99_ms"] / r["p50_ms"] for s, r in mine.items()}, max)
        if name in (OURS, THEIRS):
            rows.each(plan.top, name, DB, {s: min(decibels(r), default=None) for s, r in mine.items()}, min)
    rows.each(plan.top, OURS, OVER, {s: fps[OURS][s] / fps[THEIRS][s] for s in plan.names})
    rows.each(plan.top, OURS, LESS, {s: size[OURS][s] / size[THEIRS][s] for s in plan.names})


FIGURES = (
    Figure(
        "summary", "Summary: whole frames, this project beside the paper", summary_cases, summary,
        (Panel((OVER, LESS), across="scene", series="quantity", unit="splatcore over neo"), Panel(FPS, scene=MEAN)),
        (
            *(Pivot((quantity,), "scene", "hardware", True) for quantity in (FPS, MEGABYTES, DB, SPREAD)),
            Pivot((ENTRIES, OVER, LESS), "scene", "quantity", True),
        ),
    ),
)  # fmt: skip
