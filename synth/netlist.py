"""Puts mapped modules together: flat arrays of cells and nets, from which area and timing are read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from synth.cells import Cell
from synth.flow import MACRO, Library, Module, map_module
from synth.memories import Memory

CONSTANTS = 2  # nets 0 and 1 hold these values


@dataclass
class Netlist:
    """A flat design. `gates[name]` [n, pins] holds nets, pins in the order of `pins`; unconnected: net 0."""

    nets: int = CONSTANTS
    gates: dict[str, np.ndarray] = field(default_factory=dict)
    inputs: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    outputs: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    ports: dict[str, np.ndarray] = field(default_factory=dict)  # nets of each port, lowest bit first
    memory_in: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    memory_out: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    memories: dict[Memory, int] = field(default_factory=dict)
    rams: list[tuple[Memory, dict[str, np.ndarray]]] = field(default_factory=list)  # each with the nets of its ports
    left_out: list[tuple[int, float]] = field(default_factory=list)  # (net, fF) of inputs of parts that are not inside


def pins(cell: Cell) -> list[str]:
    """Pins of a cell in the order of Netlist.gates: inputs, then outputs."""
    return [*cell.caps, *cell.functions]


def integer(bits: str) -> int:
    """A parameter as Yosys writes it: 32 binary digits, two's complement."""
    value = int(bits, 2)
    return value - (1 << 32) if len(bits) == 32 and bits[0] == "1" else value


def module_of(cell: dict, netlist: dict) -> Module:
    """The module that a black box stands for."""
    defaults = netlist["modules"][cell["type"]].get("parameter_default_values", {})
    given = {name: integer(bits) for name, bits in cell["parameters"].items()}
    return Module(cell["type"], tuple(sorted((n, v) for n, v in given.items() if v != integer(defaults[n]))))


@cache
def parts(module: Module, library: Library) -> tuple[tuple[str, Module], ...]:
    """Instances of other modules in a mapped module: (name, module)."""
    netlist = map_module(module, library).netlist
    cells = netlist["modules"][module.name]["cells"].items()
    return tuple(
        (name, module_of(cell, netlist))
        for name, cell in cells
        if cell["type"] in netlist["modules"] and cell["type"] != MACRO and cell["type"] not in library.cells
    )


@cache
def mapped_tree(module: Module, library: Library) -> dict[Module, int]:
    """How often each module occurs in a module, itself included."""
    counts = {module: 1}
    for _, part in parts(module, library):
        for name, count in mapped_tree(part, library).items():
            counts[name] = counts.get(name, 0) + count
    return counts


def pin_loads(design: Netlist, library: Library, wire: float = 0.0) -> np.ndarray:
    """[nets] fF of the pins of cells on each net, `wire` fF of wire for each of them."""
    load = np.zeros(design.nets)
    for kind, nets in design.gates.items():
        cell = library.cells[kind]
        for at, pin in enumerate(cell.caps):
            np.add.at(load, nets[:, at], cell.caps[pin] + wire)
    return load


@cache
def port_loads(part: Module, library: Library) -> dict[str, list[float]]:
    """{port: fF of each of its bits} inside a module."""
    design = netlist(part, library)
    load = pin_loads(design, library)
    return {port: [float(load[net]) for net in nets] for port, nets in design.ports.items()}


class Builder:
    """Joins one module's cells with its parts' netlists."""

    def __init__(self, design: dict, module: Module, library: Library):
        self.json = design
        self.top = self.json["modules"][module.name]
        self.library = library
        self.net: dict = {"0": 0, "1": 1, "x": 0, "z": 0}
        self.out = Netlist()
        self.rows: dict[str, list] = {}
        self.blocks: dict[str, list[np.ndarray]] = {}
        self.memory_in: list = []
        self.memory_out: list = []
        self.names: dict[str, list[str]] = {}  # of the cells in `rows`
        self.sides: list[str] = []  # of each port: input, output, or nothing for the clock
        self.same: list[tuple[int, int]] = []  # nets that a part joins

    def id(self, bit) -> int:
        if bit not in self.net:
            self.net[bit] = self.out.nets
            self.out.nets += 1
        return self.net[bit]

    def ids(self, bits: list) -> np.ndarray:
        return np.array([self.id(bit) for bit in bits], int)

    def add_memory(self, cell: dict, module: Module) -> None:
        given = {name: integer(bits) for name, bits in cell["parameters"].items()}
        memory = Memory(given["WIDTH"], given["DEPTH"])
        self.out.memories[memory] = self.out.memories.get(memory, 0) + 1
        ports = cell["connections"].items()
        self.out.rams.append((memory, {port: self.ids(bits) for port, bits in ports if port != "clk"}))
        for port, bits in ports:
            if port != "clk":
                (self.memory_out if port == "rd_data" else self.memory_in).extend(self.ids(bits))

    def add_part(self, cell: dict, part: Netlist) -> None:
        """A part's nets behind ours, those of its ports on ours."""
        renamed = np.arange(part.nets) + self.out.nets - CONSTANTS
        renamed[:CONSTANTS] = range(CONSTANTS)
        taken = np.zeros(part.nets, bool)
        taken[:CONSTANTS] = True
        self.out.nets += part.nets - CONSTANTS
        for port, bits in cell["connections"].items():
            for theirs, ours in zip(part.ports[port], self.ids(bits), strict=True):
                if taken[theirs]:
                    self.same.append((int(renamed[theirs]), int(ours)))
                else:
                    renamed[theirs], taken[theirs] = ours, True
        for name, rows in part.gates.items():
            self.blocks.setdefault(name, []).append(renamed[rows])
        self.memory_in.extend(renamed[part.memory_in])
        self.memory_out.extend(renamed[part.memory_out])
        self.out.rams += [(m, {port: renamed[nets] for port, nets in ports.items()}) for m, ports in part.rams]
        for memory, count in part.memories.items():
            self.out.memories[memory] = self.out.memories.get(memory, 0) + count

    def leave_out(self, cell: dict) -> None:
        """A part's ports become ours."""
        for port, bits in cell["connections"].items():
            if port != "clk":
                side = "output" if cell["port_directions"][port] == "input" else "input"
                if side == "output":
                    loads = port_loads(module_of(cell, self.json), self.library)[port]
                    self.out.left_out += zip(map(self.id, bits), loads, strict=True)
                self.out.ports[f"part {len(self.out.ports)}"] = self.ids(bits)
                self.sides.append(side)

    def build(self, inner: Callable[[Module, Library], Netlist] | None) -> Netlist:
        """`inner` gives the netlist of a part; without it the ports of parts are ends of paths."""
        for port, info in self.top["ports"].items():
            self.out.ports[port] = self.ids(info["bits"])
            self.sides.append("" if port == "clk" else info["direction"])
        for name, cell in self.top["cells"].items():
            kind, wires = cell["type"], cell["connections"]
            if kind in self.library.cells:
                order = pins(self.library.cells[kind])
                self.names.setdefault(kind, []).append(name)
                self.rows.setdefault(kind, []).append([self.id(wires[p][0]) if wires.get(p) else 0 for p in order])
            elif kind == MACRO:
                self.add_memory(cell, module_of(cell, self.json))
            elif kind in self.json["modules"] and inner is None:
                self.leave_out(cell)
            elif kind in self.json["modules"]:
                self.add_part(cell, inner(module_of(cell, self.json), self.library))
            else:
                raise RuntimeError(f"{kind} is neither a cell of the library nor a module")
        for kind, rows in self.rows.items():
            self.blocks.setdefault(kind, []).append(np.array(rows, int))
        return self.joined()

    def joined(self) -> Netlist:
        out = self.out
        final = np.arange(out.nets)
        for a, b in self.same:  # the lower number stays, so that constants do
            low, high = sorted((final[a], final[b]))
            final[final == high] = low
        out.gates = {kind: final[np.concatenate(blocks)] for kind, blocks in sorted(self.blocks.items())}
        out.ports = {port: final[nets] for port, nets in out.ports.items()}
        out.rams = [(m, {port: final[nets] for port, nets in ports.items()}) for m, ports in out.rams]
        sides = {"input": [], "output": []}
        for side, nets in zip(self.sides, out.ports.values(), strict=True):
            if side:
                sides[side].append(nets)
        out.inputs, out.outputs = (np.concatenate(sides[side] or [np.zeros(0, int)]) for side in sides)
        out.memory_in, out.memory_out = final[np.array(self.memory_in, int)], final[np.array(self.memory_out, int)]
        return out


@cache
def netlist(module: Module, library: Library) -> Netlist:
    """The flat netlist of a module."""
    return Builder(map_module(module, library).netlist, module, library).build(netlist)


def alone(design: dict, module: Module, library: Library) -> Netlist:
    """The netlist of a module's own cells, from what Yosys wrote."""
    return Builder(design, module, library).build(None)


def area(design: Netlist, library: Library) -> float:
    """um2 of the cells, without memories."""
    return sum(library.cells[kind].area * len(rows) for kind, rows in design.gates.items())


def flip_flops(design: Netlist, library: Library) -> int:
    return sum(len(rows) for kind, rows in design.gates.items() if library.cells[kind].sequential)
