"""Table 2: what reuse costs in quality."""

from __future__ import annotations

import numpy as np

from golden.report.reproduce.figures import Figure
from golden.report.reproduce.figures.measures import decibels, loss
from golden.report.reproduce.paper import LOSS
from golden.report.reproduce.pivots import Pivot
from golden.report.reproduce.plan import Plan
from golden.report.reproduce.plots import Panel
from golden.report.reproduce.rows import Rows

MACHINES = ("neo", "splatcore")


def table2_cases(plan: Plan) -> list:
    return [plan.case(scene, plan.top, name, quality=True) for scene in plan.names for name in MACHINES]


def table2(rows: Rows, plan: Plan, runs) -> None:
    for name in MACHINES:
        found = {s: decibels(runs[plan.case(s, plan.top, name, quality=True)]) for s in plan.names}
        found = {scene: values for scene, values in found.items() if values}
        rows.each(plan.top, name, "PSNR, dB, worst frame", {s: min(v) for s, v in found.items()}, min)
        rows.each(plan.top, name, "PSNR, dB, median", {s: float(np.median(v)) for s, v in found.items()}, min)
        rows.each(plan.top, name, f"{LOSS}, worst frame", {s: loss(min(v)) for s, v in found.items()}, max)


FIGURES = (
    Figure(
        "table2", "Table 2: quality", table2_cases, table2,
        (Panel("PSNR, dB, worst frame", across="scene"), Panel(f"{LOSS}, worst frame", across="scene")),
        (
            Pivot(("PSNR, dB, worst frame",), "scene", "hardware", True),
            Pivot((f"{LOSS}, worst frame",), "scene", "hardware", True),
        ),
    ),
)  # fmt: skip
