"""Beyond the paper: this project's options one by one, and what the paper's simulator leaves out."""

from __future__ import annotations

import numpy as np

from golden.report.reproduce.figures import Figure
from golden.report.reproduce.figures.measures import decibels, frame_bytes, steady
from golden.report.reproduce.paper import FPS
from golden.report.reproduce.pivots import Pivot
from golden.report.reproduce.plan import Case, Plan
from golden.report.reproduce.plots import Panel
from golden.report.reproduce.rows import MEAN, Rows

OPTIONS = {
    "neo": ("neo", {}),
    "late sort": ("neo", {"late_sort": 1}),
    "candidate tests": ("neo", {"raster": "candidates"}),
    "24-byte records": ("neo", {"record_stride": 24}),
    "Morton order, 128 KB cache": ("neo", {"cache_kb": 128, "cache_shared": 1, "morton": 1}),
    "Morton order, clusters": ("neo", {"clusters": 1, "morton": 1}),
    "membership by projecting twice": ("neo", {"reproject": 1}),
    "preprocess ahead": ("neo", {"preprocess_ahead": 1}),
    "colour every 2 frames (approximate)": ("neo", {"settings": ("colour_every=2",)}),
    "all exact ones (splatcore)": ("splatcore", {}),
    "all, colour every 2 frames": ("splatcore", {"settings": ("colour_every=2",)}),
}
LEFT_OUT = {
    "intersection tests": ("charge_tests",),
    "projection": ("charge_projection",),
    "imbalance of the SCUs": ("charge_imbalance",),
    "the image": ("charge_image",),
}
UNCHARGED = {
    "neo": (),
    **{f"neo, {name} not charged": keys for name, keys in LEFT_OUT.items()},
    "neo, none of these charged": tuple(key for keys in LEFT_OUT.values() for key in keys),
}
OVER, MEGABYTES, SPREAD, DB = "fps over neo", "MB a frame", "p99 over p50 latency", "PSNR, dB, worst frame"


def _option(plan: Plan, scene: str, name: str) -> Case:
    machine, changes = OPTIONS[name]
    return plan.case(scene, plan.top, machine, quality=True, **changes)


def _uncharged(plan: Plan, scene: str, name: str) -> Case:
    return plan.case(scene, plan.top, "neo", **dict.fromkeys(UNCHARGED[name], 0))


def _put(rows: Rows, plan: Plan, found: dict[str, dict[str, dict]], name: str) -> None:
    """Speed and bytes of one row of either table; found: name -> scene -> result."""
    mine = found[name]
    rows.each(plan.top, name, FPS, {s: r["fps"] for s, r in mine.items()})
    if name != "neo":
        rows.each(plan.top, name, OVER, {s: r["fps"] / found["neo"][s]["fps"] for s, r in mine.items()})
    rows.each(
        plan.top,
        name,
        MEGABYTES,
        {s: float(np.mean([frame_bytes(f) for f in steady(r)])) / 1e6 for s, r in mine.items()},
    )


def beyond_cases(plan: Plan) -> list:
    return [_option(plan, scene, name) for scene in plan.detail for name in OPTIONS]


def beyond(rows: Rows, plan: Plan, runs) -> None:
    found = {name: {s: runs[_option(plan, s, name)] for s in plan.detail} for name in OPTIONS}
    for name, results in found.items():
        _put(rows, plan, found, name)
        rows.each(plan.top, name, SPREAD, {s: r["p99_ms"] / r["p50_ms"] for s, r in results.items()}, max)
        rows.each(plan.top, name, DB, {s: min(decibels(r), default=None) for s, r in results.items()}, min)


def accounting_cases(plan: Plan) -> list:
    return [_uncharged(plan, scene, name) for scene in plan.detail for name in UNCHARGED]


def accounting(rows: Rows, plan: Plan, runs) -> None:
    found = {name: {s: runs[_uncharged(plan, s, name)] for s in plan.detail} for name in UNCHARGED}
    for name in found:
        _put(rows, plan, found, name)


FIGURES = (
    Figure(
        "beyond", "Beyond the paper: each option alone on plain Neo", beyond_cases, beyond,
        (Panel(OVER, across="hardware", series="scene"), Panel(MEGABYTES, across="hardware", series="scene")),
        (
            Pivot((FPS, OVER, MEGABYTES, SPREAD, DB), across="quantity"), Pivot((OVER,), across="scene", each=True),
            Pivot((MEGABYTES,), across="scene", each=True),
        ),
    ),
    Figure(
        "accounting", "What the paper's simulator leaves out", accounting_cases, accounting,
        (Panel(OVER, across="hardware", series="scene", scene=MEAN),),
        (Pivot((FPS, OVER, MEGABYTES), across="quantity"), Pivot((OVER,), across="scene", each=True)),
    ),
)  # fmt: skip
