"""The table of a figure: ours beside the paper's, as CSV."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from golden.report.reproduce import paper

MEAN, WORST = "mean", "worst"  # over the scenes, where others have a scene's name
WHOLE = "machine"  # of no scene
SUMMARY = (MEAN, WORST, WHOLE)
COLUMNS = ("scene", "size", "hardware", "quantity", "paper", "ours", "ratio")
DIGITS = 6


@dataclass(frozen=True)
class Row:
    scene: str
    size: str
    hardware: str
    quantity: str
    paper: float | None
    ours: float | None

    @property
    def ratio(self) -> float | None:
        """Ours over the paper's."""
        return self.ours / self.paper if self.paper and self.ours is not None else None


class Rows(list[Row]):
    """Rows of one figure; the paper's number is looked up beside each mean or worst."""

    def __init__(self, figure: str, rows: Iterable[Row] = ()):
        super().__init__(rows)
        self.figure = figure

    def put(self, scene: str, size: str, hardware: str, quantity: str, ours: float | None) -> None:
        claim = paper.find(self.figure, size, hardware, quantity) if scene in SUMMARY else None
        self.append(Row(scene, size, hardware, quantity, claim.value if claim else None, ours))

    def each(self, size: str, hardware: str, quantity: str, values: dict[str, float | None], over=np.mean) -> None:
        """A row a scene, then their mean; over=max or min: then the worst."""
        for scene, value in values.items():
            self.put(scene, size, hardware, quantity, value)
        known = [value for value in values.values() if value is not None]
        if known:
            self.put(MEAN if over is np.mean else WORST, size, hardware, quantity, float(over(known)))

    def summary(self, size: str, hardware: str, quantity: str, ours: float | None) -> None:
        """The one row of a quantity of all scenes together."""
        self.put(MEAN, size, hardware, quantity, ours)

    def whole(self, size: str, hardware: str, quantity: str, ours: float | None) -> None:
        """A row of the hardware itself."""
        self.put(WHOLE, size, hardware, quantity, ours)


def _text(value: float | None) -> str:
    return "" if value is None else f"{value:.{DIGITS}g}"


def write(path: Path, rows: Iterable[Row]) -> None:
    """Beside the final name, then renamed."""
    part = path.with_name(path.name + ".part")
    with open(part, "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        for row in rows:
            named = (row.scene, row.size, row.hardware, row.quantity)
            table.writerow([*named, _text(row.paper), _text(row.ours), _text(row.ratio)])
    os.replace(part, path)


def read(path: Path) -> Rows:
    """What `write` wrote."""

    def number(text: str) -> float | None:
        return float(text) if text else None

    with open(path, newline="") as file:
        lines = [
            Row(*(line[key] for key in COLUMNS[:4]), number(line["paper"]), number(line["ours"]))
            for line in csv.DictReader(file)
        ]
    return Rows(path.stem, lines)
