"""Results of a unit: measured, kept as synth/results/MODULE.json, and the digest that says what they were made from."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import replace
from pathlib import Path

from synth import cells, flow, joint, netlist, timing
from synth.flow import DELAY, Library, Module
from tests.builds import ROOT

FOLDER = Path(__file__).parent / "results"
AREAS = ROOT / "golden" / "report" / "accuracy" / "area.json"
CORES = ("gs_sorting_core", "gs_raster_core", "gs_late_core")
WIRES = (0.0, 2.5, 5.0)  # um for each pin of a net


def rtl_text(module: str) -> str:
    """All RTL below a module without comments and spaces, and the macros that it uses."""
    macros = dict(re.findall(r"^`define (\w+) (.+)$", (ROOT / "rtl" / "gs_params.vh").read_text(), re.MULTILINE))
    files, todo = {}, [module]
    while todo:
        inside, edge = flow.sources(todo.pop())
        new = [path for path in inside + edge if path.stem not in files]
        files |= {path.stem: path for path in new}
        todo += [path.stem for path in new]
    words = []
    for _, path in sorted(files.items()):
        text = re.sub(r"//[^\n]*", "", path.read_text())
        used = sorted(set(re.findall(r"`(GS_\w+)", text)) & set(macros))
        words.append(" ".join([*text.split(), *(f"{name}={macros[name]}" for name in used)]))
    return "".join(words)


def digest(module: str) -> str:
    """Of the RTL of a module, the cell table and the recipe."""
    rows = cells.TABLE.read_text().splitlines()
    table = [line for line in rows if not line.startswith("#") and ",energy,,,," not in line]
    recipe = [
        f"{flow.LIMIT} {flow.CLOCK} {flow.OUTSIDE} {flow.ATTEMPTS}",
        flow.COARSE,
        flow.FINE,
        flow.CLOCK_GATES,
        flow.ABC,
        *(path.read_text() for path in [*flow.PASSES, Path(joint.__file__)]),
    ]
    text = rtl_text(module) + "\n".join([*table, *recipe])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def measure(module: str, library: Library) -> dict:
    """Map a module with its parts and measure it."""
    top = Module(module)
    design = joint.joined(top, library)
    runs = {part: flow.map_module(part, library) for part in netlist.mapped_tree(top, library)}
    paths = {wire: timing.longest(design, library, wire) for wire in WIRES}
    area = netlist.area(design, library)
    nand = cells.cheapest(library.cells, "nand2").area
    counts = netlist.mapped_tree(top, library)
    memories = [
        {"width": m.width, "depth": m.depth, "count": n, "area_um2": round(m.area, 1), "access_pj": round(m.energy, 3)}
        for m, n in sorted(design.memories.items())
    ]
    return {
        "module": module,
        "made_from": digest(module),
        "area_um2": round(area, 1),
        "kge": round(area / nand / 1000, 2),
        "cells": sum(len(rows) for rows in design.gates.values()),
        "flip_flops": netlist.flip_flops(design, library),
        "array_bits": sum(runs[part].memory_bits * count for part, count in counts.items()),
        "memories": memories,
        "memory_um2": round(sum(m.area * n for m, n in design.memories.items()), 1),
        "period_ps": {f"{wire:g}": round(path.period, 1) for wire, path in paths.items()},
        "clock_mhz": {f"{wire:g}": round(1e6 / path.period) for wire, path in paths.items()},
        "path": " > ".join(map(cells.short, paths[0.0].cells)),
        "abc_ps": max((run.abc_ps for run in runs.values() if run.abc_ps), default=None),
        "asked_ps": DELAY,
        "parts": own_areas(top, library),
    }


def with_plain(plain: dict, ours: dict) -> dict:
    """The result of a unit and beside it, under `plain`, what Yosys and ABC alone make of it."""
    return {**ours, "plain": {key: plain[key] for key in ("area_um2", "period_ps")}}


def setting_area(setting: str, module: str, library: Library) -> float:
    """um2 of a core with its memories at a setting of the formats.

    Of the modules as they are mapped, before joint.py: it adds less than 1 %, and most of the run time.
    """
    named = library.name if setting == "reference" else f"{library.name}-{setting}"
    design = netlist.netlist(Module(module), replace(library, setting=setting, name=named))
    memories = sum(memory.area * count for memory, count in design.memories.items())
    return round(netlist.area(design, library) + memories, 1)


def save_settings(areas: dict[tuple[str, str], float]) -> None:
    """Write AREAS, for the accuracy study: um2 by (setting, core)."""
    found: dict[str, dict] = {"made_from": {module: digest(module) for module in CORES}}
    for (setting, module), area in areas.items():
        found.setdefault(setting, {})[module] = area
    AREAS.write_text(json.dumps(found, indent=1) + "\n")


def own_areas(top: Module, library: Library) -> dict[str, list]:
    """{part: [how often it occurs, um2 of one without its own parts]} of everything below a module, itself first."""
    found = {}
    for part, count in netlist.mapped_tree(top, library).items():
        inner = sum(netlist.area(netlist.netlist(child, library), library) for _, child in netlist.parts(part, library))
        own = netlist.area(netlist.netlist(part, library), library) - inner
        found[part.label] = [count, round(own, 1)]
    return found


def save(result: dict) -> None:
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f"{result['module']}.json").write_text(json.dumps(result, indent=1) + "\n")


def load(module: str) -> dict | None:
    """The committed result, if there is one."""
    path = FOLDER / f"{module}.json"
    return json.loads(path.read_text()) if path.exists() else None
