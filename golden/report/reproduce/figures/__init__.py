"""Figures and tables of the paper, each as data: the runs it needs, the rows it makes of them, how it is drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from golden.report.reproduce import NAMES
from golden.report.reproduce.pivots import Pivot
from golden.report.reproduce.plan import Case, Plan
from golden.report.reproduce.plots import Panel
from golden.report.reproduce.rows import Rows


@dataclass(frozen=True)
class Figure:
    name: str
    title: str
    cases: Callable[[Plan], list[Case]]
    rows: Callable  # (Rows to fill, Plan, Runs)
    panels: tuple[Panel, ...]
    tables: tuple[Pivot, ...]  # on the page

    def make(self, plan: Plan, runs) -> Rows:
        rows = Rows(self.name)
        self.rows(rows, plan, runs)
        return rows


def all_figures() -> dict[str, Figure]:
    """Name -> figure, in the paper's order, then our own."""
    from golden.report.reproduce.figures import extra, quality, silicon, speed, summary, temporal, traffic

    modules = (speed, traffic, temporal, quality, silicon, extra, summary)
    found = {figure.name: figure for module in modules for figure in module.FIGURES}
    return {name: found[name] for name in NAMES}
