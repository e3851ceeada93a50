"""Figs. 6, 7, 19: what stays from frame to frame, and what strategies of sorting make of it."""

from __future__ import annotations

import numpy as np

from golden.report.reproduce.figures import Figure
from golden.report.reproduce.figures.measures import decibels, seconds, steady
from golden.report.reproduce.pivots import Pivot
from golden.report.reproduce.plan import LISTS, Plan
from golden.report.reproduce.plots import Panel
from golden.report.reproduce.rows import Rows
from golden.report.reproduce.similarity import KEEPING, PERCENTILES

TABLES = "64-pixel tiles"
KEEP = "% of tiles that keep more than {} %"
MOVED, FURTHEST = "places moved, {}th percentile", "places moved, largest"
SHOWN = (60, 70, 78, 90)  # of KEEPING, on the page
LATENCY, RELATIVE, SLOWEST = "mean latency, ms", "mean latency over reuse's", "worst latency, ms"
DIMMEST = "worst PSNR, dB"
LONGER = 3  # Fig. 19 shows this many times as many frames


def lists_cases(plan: Plan) -> list:
    return [plan.case(scene, plan.top, LISTS) for scene in plan.names]


def fig6(rows: Rows, plan: Plan, runs) -> None:
    found = {case.scene: runs[case]["keeping"] for case in lists_cases(plan)}
    for x in KEEPING:
        rows.each(
            plan.top,
            TABLES,
            KEEP.format(x),
            {s: keeping[str(x)] for s, keeping in found.items()},
        )


def fig7(rows: Rows, plan: Plan, runs) -> None:
    found = {case.scene: runs[case]["moved"] for case in lists_cases(plan)}
    for p in PERCENTILES:
        rows.each(plan.top, TABLES, MOVED.format(p), {s: moved[str(p)] for s, moved in found.items()})
    rows.each(plan.top, TABLES, FURTHEST, {s: moved["largest"] for s, moved in found.items()})


def _strategies(plan: Plan) -> dict[str, object]:
    """Name -> case, all on Neo's hardware and the first scene."""
    frames = LONGER * plan.frames
    names = ("reuse", "hierarchical", f"periodic:{max(frames // 2, 2)}", f"background:{max(plan.frames // 2, 1)}")
    return {n: plan.case(plan.names[0], plan.top, "neo", n, frames, quality=True) for n in names}


def fig19_cases(plan: Plan) -> list:
    return [*_strategies(plan).values()]


def fig19(rows: Rows, plan: Plan, runs) -> None:
    scene = plan.names[0]
    found = {name: runs[case] for name, case in _strategies(plan).items()}
    mean = {name: float(np.mean([seconds(f) for f in steady(result)])) for name, result in found.items()}
    for name, result in found.items():
        rows.summary(plan.top, name, LATENCY, 1e3 * mean[name])
        if name != "reuse":
            rows.summary(plan.top, name, RELATIVE, mean[name] / mean["reuse"])
        rows.summary(plan.top, name, SLOWEST, max(1e3 * seconds(f) for f in steady(result)))
        rows.summary(plan.top, name, DIMMEST, min(decibels(result), default=None))
    for name, result in found.items():
        for number, frame in enumerate(result["per_frame"]):
            rows.put(scene, plan.top, name, f"latency in ms, frame {number}", 1e3 * seconds(frame))
            rows.put(scene, plan.top, name, f"PSNR in dB, frame {number}", frame["psnr_db"])


FIGURES = (
    Figure(
        "fig6", "Fig. 6: share of a tile's Gaussians that stays", lists_cases, fig6,
        (Panel("% of tiles that keep more than ", series="scene", lines=True),),
        (Pivot(tuple(KEEP.format(x) for x in SHOWN), "scene", "quantity", True),),
    ),
    Figure(
        "fig7", "Fig. 7: how far the order of a tile moves", lists_cases, fig7,
        tuple(Panel(MOVED.format(p), across="scene") for p in PERCENTILES),
        (Pivot((*(MOVED.format(p) for p in PERCENTILES), FURTHEST), "scene", "quantity", True),),
    ),
    Figure(
        "fig19", "Fig. 19: strategies of sorting, frame by frame", fig19_cases, fig19,
        (Panel("latency in ms, frame ", lines=True), Panel("PSNR in dB, frame ", lines=True)),
        (Pivot((LATENCY, RELATIVE, SLOWEST, DIMMEST), across="quantity"),),
    ),
)  # fmt: skip
