"""The table of `make synth` and of docs/synthesis.md."""

from __future__ import annotations

import re

from golden.report.accuracy.area import SLICES
from golden.report.reproduce.paper import BOTH_ENGINES, COUNT
from synth import results, units
from synth.units import LIST
from tests.builds import ROOT

PAGE = ROOT / "docs" / "synthesis.md"
MARK = re.compile(r"(<!-- table -->\n).*(<!-- end -->)", re.DOTALL)


def ratio(ours: float, other: float | None) -> str:
    return "" if other is None else f"{other:,.0f} (x {ours / other:.2f})"


def row(unit: units.Unit, found: dict) -> str:
    """A unit's line; the paper's rows of whole engines hold buffers, so ours stand with theirs there."""
    area, memory = found["area_um2"], found["memory_um2"]
    theirs = unit.theirs(0)
    whole = area + memory if unit.paper and any("Engine" in name for name in unit.paper) else area
    period, clock = found["period_ps"], found["clock_mhz"]
    plain = found.get("plain")  # kept results of an older recipe have none
    plain_area, plain_period = (f"{plain['area_um2']:,.0f}", f"{plain['period_ps']['0']:,.0f}") if plain else ("", "")
    columns = [
        f"`{unit.module}`", unit.what, f"{area:,.0f}", plain_area, f"{found['kge']:,.1f}", f"{found['flip_flops']:,}",
        f"{memory:,.0f}" if memory else "", ratio(whole, theirs and 1e6 * theirs), ratio(area, unit.aim),
        f"{period['0']:,.0f}", plain_period, f"{clock['0']:,}", f"{clock['2.5']:,}", f"{clock['5']:,}",
    ]  # fmt: skip
    return f"| {' | '.join(columns)} |"


def table(found: dict[str, dict]) -> str:
    """Units and their results as Markdown."""
    head = ["module", "what", "cells um2", "plain um2", "kGE", "flip-flops", "memory um2", "the paper's um2", "aim um2"]
    head += ["path ps", "plain ps", "MHz", "MHz, 2.5 um", "MHz, 5 um"]
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    lines += [row(unit, found[unit.module]) for unit in LIST if unit.module in found]
    return "\n".join(lines)


def total(found: dict[str, dict]) -> str:
    """All sorting and raster cores of the paper's size beside its engines, and the memories by size."""

    def whole(module: str) -> float:
        return found[module]["area_um2"] + found[module]["memory_um2"]

    paper = BOTH_ENGINES[0]
    sorting = COUNT * whole("gs_sorting_core") / 1e6
    lines = [f"| {COUNT} sorting cores and {SLICES} raster cores | mm2 | the paper's {paper:.3f} mm2 |"]
    lines.append("|---|---|---|")
    for module in ("gs_raster_core", "gs_late_core"):
        ours = SLICES * whole(module) / 1e6 + sorting
        lines.append(f"| `gs_sorting_core`, `{module}` | {ours:.3f} | x {ours / paper:.2f} |")
    lines += [
        "",
        "| memory | in a sorting core | in a raster core | in a late core | um2 each | pJ an access, 22 nm |",
    ]
    lines.append("|---|---|---|---|---|---|")
    columns = [
        {(m["depth"], m["width"]): m for m in found[module]["memories"]}
        for module in ("gs_sorting_core", "gs_raster_core", "gs_late_core")
    ]
    for size in sorted(set().union(*columns)):
        kept = [column.get(size) for column in columns]
        one = next(m for m in kept if m)
        each = f"{one['area_um2']:,.0f} | {one['access_pj']:.2f}"
        counts = " | ".join(str(m["count"]) if m else "" for m in kept)
        lines.append(f"| {size[0]} x {size[1]} bits | {counts} | {each} |")
    return "\n".join(lines)


def text() -> str:
    """What stands between the marks of docs/synthesis.md."""
    found = {unit.module: kept for unit in LIST if (kept := results.load(unit.module))}
    parts = [table(found)]
    missing = [f"`{unit.module}`" for unit in LIST if unit.module not in found]
    if missing:
        parts.append(f"No results yet: {', '.join(missing)}.")
    if {"gs_sorting_core", "gs_raster_core", "gs_late_core"} <= set(found):
        parts.append(total(found))
    return "\n\n".join(parts) + "\n"


def write() -> None:
    page = PAGE.read_text()
    if not MARK.search(page):
        raise RuntimeError(f"{PAGE.name} has lost its marks <!-- table --> and <!-- end -->")
    PAGE.write_text(MARK.sub(lambda match: match[1] + text() + match[2], page))
