"""docs/reproduction.md from the tables of a reproduction."""

from __future__ import annotations

import json
import os
from pathlib import Path

from golden.errors import InputError
from golden.report.reproduce import paper
from golden.report.reproduce.figures import Figure, all_figures
from golden.report.reproduce.rows import MEAN, WORST, Row, Rows, read

HEAD = """# The paper's figures beside ours

Written by `splatcore reproduce page`; change nothing here by hand. Every number under *paper* is the paper's (*Neo*,
ASPLOS '26) or its public artifact's, on its own scenes; every number under *ours* comes from the runs below. No scene
of the paper's is among ours, so a ratio compares designs and scenes at once: what is meant to hold is the direction
and the order of size. Accelerators: `golden/timing/hardware.py`. *mean* and *worst* are over the scenes.
"""


def _number(value: float | None) -> str:
    if value is None:
        return ""
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def _table(head: list[str], lines: list[list[str]]) -> str:
    rule = ["---"] * len(head)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (head, rule, *lines)) + "\n"


def _paper(figure: str, row: Row) -> str:
    claim = paper.find(figure, row.size, row.hardware, row.quantity)
    return f"{claim.relation} {_number(row.paper)}".strip() if claim and row.paper is not None else _number(row.paper)


def _summary(figure: Figure, rows: Rows) -> str:
    """The rows over all scenes."""
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
        if row.scene in (MEAN, WORST)
    ]
    return _table(["quantity", "of", "size", "hardware", "paper", "ours", "ours / paper"], lines)


def _matrix(rows: Rows, quantity: str) -> str:
    """One quantity, scene by scene, at its largest size."""
    mine = [row for row in rows if row.quantity == quantity]
    size = mine[-1].size
    found = {(row.scene, row.hardware): row.ours for row in mine if row.size == size}
    machines = list(dict.fromkeys(hardware for _, hardware in found))
    scenes = list(dict.fromkeys(scene for scene, _ in found if scene not in (MEAN, WORST)))
    lines = [[scene, *(_number(found.get((scene, machine))) for machine in machines)] for scene in scenes]
    return f"{quantity}, {size}:\n\n" + _table(["scene", *machines], lines)


def section(figure: Figure, rows: Rows) -> str:
    places = sorted({claim.place for claim in paper.CLAIMS if claim.figure == figure.name})
    parts = [f"## {figure.title}\n", _summary(figure, rows)]
    parts += [_matrix(rows, quantity) for quantity in figure.matrix if any(row.quantity == quantity for row in rows)]
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
