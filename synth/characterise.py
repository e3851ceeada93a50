"""Reduces a Liberty library to a cell table (cells.py): how asap7_cells.csv was made, and how LIBERTY=PATH is timed.

Each delay table becomes five coefficients: least squares of the relative error over slews up to 160 ps and all but the
heaviest loads, where mapped nets lie. Tables of one arc that hold under different conditions (when) count with their
larger value. Cells with latches, presets or scan are passed over, but for clock gates of the kind latch_posedge.

python -m synth.characterise LIBRARY.lib OUT.csv [--energy FILE.csv] [--cells NAMES]
"""

from __future__ import annotations

import argparse
import csv
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from golden.errors import InputError
from synth.cells import Arc, Cell, basis, save

KIND = {"positive_unate": "positive", "negative_unate": "negative", "non_unate": "both"}
TABLES = ("cell_rise", "cell_fall", "rise_transition", "fall_transition")
GATE_PINS = ("clock_gate_clock_pin", "clock_gate_enable_pin", "clock_gate_out_pin", "clock_gate_test_pin")
SLEW_END = 160.0  # ps
CLOCK_SLEW = 20.0  # ps, where setup is read
HEAD = """Cells of ASAP7 7.5-track RVT at the typical corner (TT, 0.70 V, 25 C), reduced by synth/characterise.py; made
from the libraries asap7sc7p5t_*_RVT_TT_nldm of The-OpenROAD-Project, BSD 3-Clause, see asap7_LICENSE. A row's meaning:
synth/cells.py. Units: um2, pW, fF, fJ a toggle (supply rail, 20 ps slew), ps."""


@dataclass
class Group:
    """A Liberty group: kind (args) { attributes and groups }."""

    kind: str
    args: str
    attributes: dict[str, str] = field(default_factory=dict)
    groups: list[Group] = field(default_factory=list)

    def all(self, kind: str) -> list[Group]:
        return [group for group in self.groups if group.kind == kind]


TOKEN = re.compile(r'\s*(?:(\w+)\s*\(([^()]*)\)\s*(\{|;?)|(\w+)\s*:\s*("[^"]*"|[^;]*);|(\}))')


def parse(text: str) -> Group:
    """The library group of a Liberty file."""
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL).replace("\\\n", " ")
    root = Group("", "")
    stack = [root]
    at = 0
    while match := TOKEN.match(text, at):
        at = match.end()
        if match[6]:
            stack.pop()
        elif match[4]:
            stack[-1].attributes[match[4]] = match[5].strip('" ')
        elif match[3] == "{":
            group = Group(match[1], match[2].strip('" '))
            stack[-1].groups.append(group)
            stack.append(group)
        else:
            stack[-1].attributes[match[1]] = match[2]
        if not stack:
            break
    libraries = root.all("library")
    if text[at:].strip() or len(libraries) != 1 or len(stack) != 1:
        line = text.count("\n", 0, at) + 1
        raise InputError(f"not a Liberty file from about line {line}: {text[at : at + 40].strip()!r}")
    templates = {group.args: group.attributes for group in libraries[0].all("lu_table_template")}
    fill_indices(libraries[0], templates)
    return libraries[0]


def fill_indices(group: Group, templates: dict[str, dict[str, str]]) -> None:
    """Give each table the indices of its template where it has none of its own."""
    for inner in group.groups:
        if "values" in inner.attributes:
            inner.attributes = {**templates.get(inner.args, {}), **inner.attributes}
        fill_indices(inner, templates)


def numbers(text: str) -> np.ndarray:
    return np.array([float(x) for x in re.findall(r"[-+.\deE]+", text)])


def table(group: Group) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First index, second index, values [first, second] of a delay table."""
    first, second = numbers(group.attributes["index_1"]), numbers(group.attributes["index_2"])
    return first, second, numbers(group.attributes["values"]).reshape(len(first), len(second))


def fit(slew: np.ndarray, load: np.ndarray, values: np.ndarray) -> np.ndarray:
    """[5] coefficients of values [slew, load]."""
    slews, loads = np.meshgrid(slew[slew <= SLEW_END], load[: len(load) - 2], indexing="ij")
    wanted = values[: slews.shape[0], : slews.shape[1]].ravel()
    weight = 1 / (np.abs(wanted) + 5.0)
    design = basis(slews.ravel(), loads.ravel()) * weight[:, None]
    return np.linalg.lstsq(design, wanted * weight, rcond=None)[0]


def arcs_of(output: Group, inputs: set[str]) -> list[Arc]:
    """Arcs that end at an output pin."""
    found: dict[tuple[str, str], dict[str, list]] = {}
    for timing in output.all("timing"):
        pin = timing.attributes["related_pin"]
        edge = timing.attributes.get("timing_type", "combinational")
        if pin not in inputs or not (edge.startswith("combinational") or edge == "rising_edge"):
            continue
        kind = "clock" if edge == "rising_edge" else KIND[timing.attributes["timing_sense"]]
        kind = "gated" if "clock_gate_out_pin" in output.attributes else kind
        tables = found.setdefault((pin, kind), {})
        for group in timing.groups:
            tables.setdefault(group.kind, []).append(table(group))
    arcs = []
    for (pin, kind), tables in found.items():
        rows = [
            fit(tables[name][0][0], tables[name][0][1], np.max([t[2] for t in tables[name]], axis=0))
            for name in TABLES
            if name in tables
        ]
        if len(rows) == len(TABLES):
            arcs.append(Arc(output.args, pin, kind, np.array(rows)))
    return arcs


def setup_of(pin: Group) -> list[Arc]:
    """The setup time of a data pin at CLOCK_SLEW, over the data's slew."""
    for timing in pin.all("timing"):
        if timing.attributes.get("timing_type") == "setup_rising":
            rows = np.zeros((4, 5))
            for row, name in enumerate(("rise_constraint", "fall_constraint")):
                (group,) = timing.all(name)
                first, second, values = table(group)  # [data slew, clock slew]
                at = [np.interp(CLOCK_SLEW, second, line) for line in values]
                keep = first <= SLEW_END
                design = basis(first[keep], np.zeros(keep.sum()))[:, [0, 2, 3]]
                rows[row, [0, 2, 3]] = np.linalg.lstsq(design, np.array(at)[keep], rcond=None)[0]
            return [Arc("", pin.args, "setup", rows)]
    return []


def clock_gate(group: Group) -> Cell:
    """A clock gate: output = clock and what its enable was while the clock was low; a test enable is held at 0."""
    pins = {role: pin for pin in group.all("pin") for role in GATE_PINS if role in pin.attributes}
    clock, enable, out = (pins[role] for role in GATE_PINS[:3])
    cell = Cell(group.args, float(group.attributes["area"]), float(group.attributes.get("cell_leakage_power", 0)))
    cell.caps = {pin.args: float(pin.attributes["capacitance"]) for role, pin in pins.items() if pin is not out}
    cell.functions = {out.args: f"({clock.args} * {enable.args})"}
    cell.max_load = {out.args: float(out.attributes.get("max_capacitance", 0))}
    cell.arcs = [*arcs_of(out, {clock.args}), *setup_of(enable)]
    if GATE_PINS[3] in pins:
        cell.arcs.append(Arc("", pins[GATE_PINS[3]].args, "tie", np.zeros((4, 5))))
    return cell


def cells_of(library: Group) -> dict[str, Cell]:
    """Every combinational cell, plain flip-flop and clock gate of a library."""
    cells = {}
    for group in library.all("cell"):
        flops = group.all("ff")
        kinds = (
            {inner.kind for inner in group.groups} | set(group.attributes) | set(flops[0].attributes if flops else ())
        )
        if group.attributes.get("clock_gating_integrated_cell", "").startswith("latch_posedge"):
            cells[group.args] = clock_gate(group)
        if kinds & {"latch", "statetable", "clock_gating_integrated_cell", "clear", "preset"}:
            continue
        pins = {pin.args: pin for pin in group.all("pin")}
        inputs = {name for name, pin in pins.items() if pin.attributes["direction"] == "input"}
        cell = Cell(group.args, float(group.attributes["area"]), float(group.attributes.get("cell_leakage_power", 0)))
        for name, pin in pins.items():
            if name in inputs:
                cell.caps[name] = float(pin.attributes["capacitance"])
                cell.arcs += setup_of(pin)
            elif "function" in pin.attributes:
                function = pin.attributes["function"]
                if flops:  # next_state is what Q takes; the output may be its inverse
                    held, inverse = (x.strip() for x in flops[0].args.split(","))
                    state = flops[0].attributes["next_state"]
                    function = {held: state, inverse: f"!({state})"}[function]
                cell.functions[name] = function
                cell.max_load[name] = float(pin.attributes.get("max_capacitance", 0))
                cell.arcs += arcs_of(pin, inputs)
        timed = {(arc.output, arc.pin) for arc in cell.arcs if arc.output}
        if cell.functions and (not inputs or timed):
            cells[cell.name] = cell
    return cells


def add_energy(cells: dict[str, Cell], path: Path) -> None:
    """Leakage and energy a toggle from a table with columns cell, leakage_pW, pin, dir, energy_fJ_per_toggle.

    Inputs of gates are left out: theirs is below 0.02 fJ.
    """
    with path.open(newline="") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            if row["cell"] in cells:
                cells[row["cell"]].leakage = float(row["leakage_pW"])
                energy = float(row["energy_fJ_per_toggle"] or 0)
                if row["dir"] == "output":
                    cells[row["cell"]].energy[row["pin"]] = energy
                elif energy >= 0.02:
                    cells[row["cell"]].pin_energy[row["pin"]] = energy


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m synth.characterise", description="Liberty file to cell table.")
    parser.add_argument("library", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--energy", type=Path, help="csv with leakage and energy of each cell")
    parser.add_argument("--cells", help="only these, by name without the library's suffix, separated by commas")
    args = parser.parse_args()
    cells = cells_of(parse(args.library.read_text()))
    if args.cells:
        wanted = set(args.cells.split(","))
        cells = {name: cell for name, cell in cells.items() if name.split("_")[0] in wanted}
    if args.energy:
        add_energy(cells, args.energy)
    save(cells, args.out, HEAD)


if __name__ == "__main__":
    main()
