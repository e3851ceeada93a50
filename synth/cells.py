"""The cell table asap7_cells.csv: area, pins, functions and delays of the cells that mapping uses.

A row is one arc of a cell: from an input pin to an output pin (positive, negative or both: how an edge passes), from
the clock (clock), from the clock to a gated clock (gated), or the time data or an enable must be there before the clock
(setup); an input of a clock gate that is held at 0 has neither (tie).
A row of kind energy is no arc: it holds what an edge at an input costs inside of a register or clock gate, whatever
the output does. Units: um2, fF, ps, pW, fJ.

Delay and output slew are five numbers each, for an edge that rises and one that falls at the output (setup: at the data
pin):  c0 + c1 * load + c2 * sqrt(slew) + c3 * slew + c4 * sqrt(slew * load),  slew being the 10-90 % time of the edge
that comes in. Setup has no load. `grid` gives the same numbers as the tables that Liberty wants.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from golden.errors import InputError

TABLE = Path(__file__).parent / "asap7_cells.csv"
SLEWS = (5.0, 10.0, 20.0, 40.0, 80.0, 160.0)  # ps, grid of the Liberty file
DRIVE = 60.0  # fF, what a buffer must drive to stand in front of a unit
LOADS = (0.72, 1.44, 2.88, 5.76, 11.52, 23.04, 46.08)  # fF
QUANTITIES = ("rise", "fall", "rise_slew", "fall_slew")
COLUMNS = ("cell", "area", "leakage", "output", "function", "max_load", "energy", "pin", "cap", "kind", *QUANTITIES)


@dataclass(frozen=True)
class Arc:
    """One row; `coefficients` [4, 5]: quantity of QUANTITIES, c0..c4."""

    output: str
    pin: str
    kind: str
    coefficients: np.ndarray


@dataclass
class Cell:
    """`functions` {output: Liberty expression}, `caps` {input: fF}, `energy` {output: fJ a toggle}; `pin_energy`
    {input: fJ a toggle} of those inputs where it counts."""

    name: str
    area: float
    leakage: float
    functions: dict[str, str] = field(default_factory=dict)
    max_load: dict[str, float] = field(default_factory=dict)
    energy: dict[str, float] = field(default_factory=dict)
    caps: dict[str, float] = field(default_factory=dict)
    arcs: list[Arc] = field(default_factory=list)
    pin_energy: dict[str, float] = field(default_factory=dict)

    @property
    def sequential(self) -> bool:
        return any(arc.kind == "clock" for arc in self.arcs)

    @property
    def clock_gate(self) -> bool:
        return any(arc.kind == "gated" for arc in self.arcs)

    def pin(self, kind: str) -> str:
        """The one input of a kind."""
        (pin,) = {arc.pin for arc in self.arcs if arc.kind == kind}
        return pin


def basis(slew, load):
    """[..., 5]: what the coefficients multiply."""
    slew, load = np.broadcast_arrays(np.asarray(slew, float), np.asarray(load, float))
    return np.stack([np.ones_like(slew), load, np.sqrt(slew), slew, np.sqrt(slew * load)], axis=-1)


def grid(coefficients: np.ndarray) -> np.ndarray:
    """A quantity on the grid [slew, load]; a fit may dip below zero at its corner, time may not."""
    slew, load = np.meshgrid(SLEWS, LOADS, indexing="ij")
    return np.maximum(basis(slew, load) @ coefficients, 0.1)


def short(name: str) -> str:
    """NAND2xp5_ASAP7_75t_R -> NAND2xp5."""
    return name.split("_")[0]


def load(path: Path = TABLE) -> dict[str, Cell]:
    """Cells by name, in the order of the file."""
    cells: dict[str, Cell] = {}
    with path.open(newline="") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        for row in rows:
            cell = cells.setdefault(row["cell"], Cell(row["cell"], float(row["area"]), float(row["leakage"])))
            if row["output"]:
                cell.functions[row["output"]] = row["function"]
                cell.max_load[row["output"]] = float(row["max_load"] or 0)
                cell.energy[row["output"]] = float(row["energy"] or 0)
            if row["kind"] == "energy":
                cell.pin_energy[row["pin"]] = float(row["energy"])
            elif row["pin"]:
                cell.caps[row["pin"]] = float(row["cap"])
                numbers = np.array([[float(x) for x in (row[q] or "0 0 0 0 0").split()] for q in QUANTITIES])
                cell.arcs.append(Arc(row["output"], row["pin"], row["kind"], numbers))
    return cells


def save(cells: dict[str, Cell], path: Path, head: str) -> None:
    """Write the table; `head` is its comment."""

    def numbers(values) -> str:
        return " ".join(f"{v:.4g}" for v in values) if np.any(values) else ""

    with path.open("w", newline="") as file:
        file.writelines(f"# {line}\n" for line in head.splitlines())
        out = csv.writer(file, lineterminator="\n")
        out.writerow(COLUMNS)
        for cell in cells.values():
            first = [cell.name, f"{cell.area:g}", f"{cell.leakage:g}"]
            bare = [Arc(name, "", "", np.zeros((4, 5))) for name in cell.functions]
            for arc in cell.arcs or bare:
                out_pin = ["", "", "", ""]
                if arc.output:
                    load, energy = cell.max_load[arc.output], cell.energy.get(arc.output, 0.0)
                    out_pin = [arc.output, cell.functions[arc.output], f"{load:g}", f"{energy:.4g}"]
                in_pin = [arc.pin, f"{cell.caps[arc.pin]:.4g}" if arc.pin else "", arc.kind]
                out.writerow([*first, *out_pin, *in_pin, *(numbers(row) for row in arc.coefficients)])
            for pin, energy in cell.pin_energy.items():
                empty = [""] * len(QUANTITIES)
                out.writerow([*first, "", "", "", f"{energy:.4g}", pin, f"{cell.caps[pin]:.4g}", "energy", *empty])


def verilog(cells: dict[str, Cell]) -> str:
    """Functional models of the cells, without delays: what a gate netlist needs to be simulated or proved."""
    lines = []
    for cell in cells.values():
        ports = [f"input {pin}" for pin in cell.caps] + [f"output {pin}" for pin in cell.functions]
        lines.append(f"module {cell.name} ({', '.join(ports)});")
        for pin, function in cell.functions.items():
            if cell.clock_gate:  # a latch that is open while the clock is low
                lines += ["    reg open;", f"    always @* if (!{cell.pin('gated')}) open = {cell.pin('setup')};"]
                lines.append(f"    assign {pin} = {cell.pin('gated')} & open;")
            elif cell.sequential:
                data = re.sub(r"!", "~", function)
                lines += ["    reg q;", f"    always @(posedge CLK) q <= {data};", f"    assign {pin} = q;"]
            else:
                constant = {"1": "1'b1", "0": "1'b0"}.get(function)
                text = constant or function.replace("!", "~").replace("*", "&").replace("+", "|")
                lines.append(f"    assign {pin} = {text};")
        lines += ["endmodule", ""]
    return "\n".join(lines)


def cheapest(cells: dict[str, Cell], what: str) -> Cell:
    """The smallest cell of a kind: flop, buffer, nand2, clock gate, or the constants 1 and 0."""

    def fits(cell: Cell) -> bool:
        functions = [re.sub(r"[()\s]", "", text) for text in cell.functions.values()]
        pins = list(cell.caps)
        if what == "flop":
            return cell.sequential
        if what == "clock gate":
            return cell.clock_gate
        if what == "nand2":
            return len(pins) == 2 and functions == [f"!{pins[0]}+!{pins[1]}"] and "x1_" in cell.name + "_"
        if what == "buffer":  # not the slow one that repairs hold times
            return functions == pins and cell.max_load[next(iter(cell.functions))] >= DRIVE
        return functions == [what]

    found = [cell for cell in cells.values() if fits(cell)]
    if not found:
        raise InputError(f"the library has no cell for {what!r}")
    return min(found, key=lambda cell: (cell.area, cell.name))
