"""Tables of the page: a figure's rows with two of their columns along the sides."""

from __future__ import annotations

from dataclasses import dataclass

from golden.report.reproduce.rows import SUMMARY, WHOLE, Row, Rows


@dataclass(frozen=True)
class Pivot:
    quantities: tuple[str, ...]
    down: str = "hardware"  # column of the rows along the left side
    across: str = "size"  # and along the top
    each: bool = False  # scene by scene; otherwise their mean or worst only

    def chosen(self, rows: Rows) -> list[Row]:
        """Its rows; of several sizes the largest, unless size is along a side."""
        mine = [r for r in rows if r.quantity in self.quantities and (self.each or r.scene in SUMMARY)]
        if "size" not in (self.down, self.across):
            mine = [row for row in mine if row.size == mine[-1].size]
        return mine

    def title(self, rows: Rows) -> str:
        """What its sides do not say."""
        words = [] if "quantity" in (self.down, self.across) else list(self.quantities)
        if "size" not in (self.down, self.across):
            words.append(self.chosen(rows)[-1].size)
        if not self.each:
            over = dict.fromkeys(row.scene for row in self.chosen(rows) if row.scene != WHOLE)
            words.append(" or ".join(over) + " of the scenes")
        return ", ".join(words)

    def table(self, rows: Rows) -> tuple[list[str], list[tuple[str, list[float | None]]]]:
        """(names along the top, (name, values) of each line)."""
        found = {(getattr(r, self.down), getattr(r, self.across)): r.ours for r in self.chosen(rows)}
        top = list(dict.fromkeys(across for _, across in found))
        return top, [(down, [found.get((down, a)) for a in top]) for down in dict.fromkeys(d for d, _ in found)]
