"""docs/reproduction.md from the tables of a reproduction."""

from __future__ import annotations

import json
import os
from pathlib import Path

from golden.errors import InputError
from golden.report.reproduce import paper
from golden.report.reproduce.figures import Figure, all_figures
from golden.report.reproduce.pivots import Pivot
from golden.report.reproduce.rows import Row, Rows, read

HEAD = """# The paper's figures beside ours

Written by `splatcore reproduce page`; change nothing here by hand. Every number under *paper* is the paper's (*Neo*,
ASPLOS '26) or its public artifact's, on its own scenes; every number under *ours* comes from the runs below. No scene
of the paper's is among ours, so a ratio compares designs and scenes at once: what is meant to hold is the direction
and the order of size. Accelerators: `golden/timing/hardware.py`. *mean* and *worst* are over the scenes.
"""


def _number(value: float | None) -> str:
    if value is None:
        return ""
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"


def _table(head: list[str], lines: list[list[str]]) -> str:
    rule = ["---"] * len(head)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (head, rule, *lines)) + "\n"


def _paper(figure: str, row: Row) -> str:
    """The paper's number as it is printed there."""
    claim = paper.find(figure, row.size, row.hardware, row.quantity)
    return f"{claim.relation} {claim.value:g}".strip()


def _beside(figure: Figure, rows: Rows) -> str:
    """The rows for which the paper has a number."""
    lines = [
        [
            row.quantity,
            row.scene,
            row.size,
            row.hardware,
            _paper(figure.name, row),
            _number(row.ours),
            _number(row.ratio),
        ]
        for row in rows
        if row.paper is not None
    ]
    return _table(["quantity", "of", "size", "hardware", "paper", "ours", "ours / paper"], lines)


def _pivot(pivot: Pivot, rows: Rows) -> str:
    top, lines = pivot.table(rows)
    cells = [[name, *map(_number, values)] for name, values in lines]
    return f"Ours, {pivot.title(rows)}:\n\n" + _table([pivot.down, *top], cells)


def section(figure: Figure, rows: Rows) -> str:
    places = sorted({claim.place for claim in paper.CLAIMS if claim.figure == figure.name})
    parts = [f"## {figure.title}\n"]
    parts += [_beside(figure, rows)] if any(row.paper is not None for row in rows) else []
    parts += [_pivot(pivot, rows) for pivot in figure.tables if pivot.chosen(rows)]
    source = f" Paper: {', '.join(places)}." if places else ""
    parts.append(
        f"Why they differ: {paper.WHY[figure.name]}{source} Rows: `{figure.name}.csv`; picture: `{figure.name}.png`.\n"
    )
    return "\n".join(parts)


def text(folder: Path) -> str:
    """The page of the figures whose tables are in a folder; InputError when there are none."""
    found = [figure for figure in all_figures().values() if (folder / f"{figure.name}.csv").is_file()]
    if not found or not (folder / "plan.json").is_file():
        raise InputError(f"-o {folder}: holds no figure; wants a folder that `splatcore reproduce all` has filled")
    plan = json.loads((folder / "plan.json").read_text())
    runs = (
        f"Scenes: {', '.join(plan['scenes'])}; large: {plan['large']}. Motion: {plan['motion']}, 30 frames a second. "
        f"Sizes: {', '.join(plan['sizes'])}. {plan['frames']} frames each, the first sorted from scratch and left out "
        "of rates; traffic of 60 frames is the first and 59 times the mean of the others.\n"
    )
    return "\n".join([HEAD, runs, *(section(figure, read(folder / f"{figure.name}.csv")) for figure in found)])


def write(folder: Path, file: Path) -> None:
    """Write the page beside its name, then rename."""
    page = text(folder)
    part = file.with_name(file.name + ".part")
    try:
        part.write_text(page)
        os.replace(part, file)
    except OSError as error:
        raise InputError(f"--page {file}: cannot be written ({error.strerror}); wants a file in a folder") from None
