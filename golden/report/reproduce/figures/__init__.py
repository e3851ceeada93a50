"""Figures and tables of the paper, each as data: the runs it needs, the rows it makes of them, how it is drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

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
    from golden.report.reproduce.figures import extra, quality, speed, summary, temporal, traffic

    found = {figure.name: figure for module in (speed, traffic, temporal, quality) for figure in module.FIGURES}
    order = (
        "fig3",
        "fig4",
        "fig5",
        "fig6",
        "fig7",
        "fig10",
        "fig15",
        "fig16",
        "fig17a",
        "fig17b",
        "fig18",
        "fig19",
        "table2",
    )
    return {
        **{name: found[name] for name in order},
        **{figure.name: figure for figure in (*extra.FIGURES, *summary.FIGURES)},
    }
