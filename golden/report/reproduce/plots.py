"""Pictures of the figures, drawn from their rows."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

from golden.report.reproduce.rows import MEAN, Row


@dataclass(frozen=True)
class Panel:
    """Bars of quantities, or lines over the number that follows one ("fps at motion x", then 2, 4, 8)."""

    quantity: str | tuple[str, ...]
    across: str = "size"  # column whose values are the groups of bars
    series: str = "hardware"  # column whose values are the bars of a group, or the lines
    scene: str | None = None  # only this one; None: all
    size: str | None = None
    lines: bool = False
    log: bool = False
    unit: str = ""  # on the axis where there are several quantities

    @property
    def quantities(self) -> tuple[str, ...]:
        return (self.quantity,) if isinstance(self.quantity, str) else self.quantity

    def chosen(self, rows: list[Row]) -> list[Row]:
        return [
            row
            for row in rows
            if (row.quantity.startswith(self.quantity) if self.lines else row.quantity in self.quantities)
            and self.scene in (None, row.scene)
            and self.size in (None, row.size)
            and row.ours is not None
        ]


def _unique(values) -> list:
    return list(dict.fromkeys(values))


def _bars(axes, panel: Panel, rows: list[Row]) -> None:
    groups = _unique(getattr(row, panel.across) for row in rows)
    series = _unique(getattr(row, panel.series) for row in rows)
    width = 0.8 / max(len(series), 1)
    for k, name in enumerate(series):
        mine = [row for row in rows if getattr(row, panel.series) == name]
        x = [groups.index(getattr(row, panel.across)) + (k - (len(series) - 1) / 2) * width for row in mine]
        axes.bar(x, [row.ours for row in mine], width, label=name)
        known = [(at, row.paper) for at, row in zip(x, mine) if row.paper is not None]
        if known:
            axes.plot(*zip(*known), "kD", markersize=4, label="_paper")
    if any(row.paper is not None for row in rows):
        axes.plot([], [], "kD", markersize=4, label="the paper's")
    turned = {"rotation": 25, "ha": "right"} if max(map(len, groups), default=0) > 8 else {}
    axes.set_xticks(range(len(groups)), groups, fontsize=7, **turned)


def _lines(axes, panel: Panel, rows: list[Row]) -> None:
    for name in _unique(getattr(row, panel.series) for row in rows):
        mine = [row for row in rows if getattr(row, panel.series) == name]
        x = [float(re.search(r"\d+", row.quantity[len(panel.quantity) :])[0]) for row in mine]
        points = sorted(zip(x, (row.ours for row in mine)))
        axes.plot(*zip(*points), marker=".", label=name)


def draw(path: Path, title: str, panels: tuple[Panel, ...], rows: list[Row]) -> None:
    """One picture with the panels side by side; panels without rows are left out."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    panels = [panel for panel in panels if panel.chosen(rows)]
    figure, axes = pyplot.subplots(
        1, len(panels), figsize=(6.4 * len(panels), 4.2), squeeze=False, layout="constrained"
    )
    for panel, own in zip(panels, axes[0]):
        chosen = panel.chosen(rows)
        (_lines if panel.lines else _bars)(own, panel, chosen)
        where = [
            word for word in (f"{panel.scene} of scenes" if panel.scene == MEAN else panel.scene, panel.size) if word
        ]
        own.set_ylabel("" if panel.lines else panel.unit or panel.quantity)
        own.set_xlabel(panel.quantity.strip() if panel.lines else "")
        own.set_title(", ".join(where), fontsize=8)
        if panel.log:
            own.set_yscale("log")
        own.grid(axis="y", alpha=0.3)
        if not panel.lines:
            own.margins(y=0.3)  # room for the legend
        own.legend(fontsize=7)
    figure.suptitle(title, fontsize=10)
    part = path.with_name(path.name + ".part")
    figure.savefig(part, format="png", dpi=110)
    pyplot.close(figure)
    os.replace(part, path)
