"""Buffers and gate sizes of a mapped module, by our own timing.

ABC sees a full adder or a clock gate as the end of all paths, so it takes its time in front of one. Here its buffers go
out, nets of heavy load get balanced trees of buffers with the most urgent pins outside, and gates on paths longer than
the clock allows are exchanged for stronger ones of the same function as long as that helps.
"""

from __future__ import annotations

import numpy as np

from synth.cells import Cell, basis, cheapest
from synth.flow import MACRO, Library, Module
from synth.memories import PIN_CAP
from synth.netlist import Builder, Netlist, module_of, pins, port_loads
from synth.timing import Analysis, analyse, slack

HEAVY = 8.0  # fF that one gate drives
CROWD = 64.0  # fF of memory pins on a net that stand behind buffers; a strong gate drives fewer
ROUNDS = 12


def is_buffer(cell: Cell) -> bool:
    return not cell.sequential and [f.strip("()") for f in cell.functions.values()] == list(cell.caps)


def strip(top: dict, library: Library) -> None:
    """Take the buffers out, but those between two ports."""
    ports = {bit for port in top["ports"].values() for bit in port["bits"]}
    same: dict = {}
    for name, cell in list(top["cells"].items()):
        if cell["type"] in library.cells and is_buffer(library.cells[cell["type"]]):
            (out,) = (cell["connections"][pin][0] for pin in library.cells[cell["type"]].functions)
            (into,) = (cell["connections"][pin][0] for pin in library.cells[cell["type"]].caps)
            if out not in ports:
                same[out] = into
                del top["cells"][name]

    def final(bit):
        while bit in same:
            bit = same[bit]
        return bit

    for cell in top["cells"].values():
        cell["connections"] = {pin: [final(bit) for bit in bits] for pin, bits in cell["connections"].items()}


def sinks(json: dict, top: dict, library: Library) -> dict[int, list[tuple[str, str, int, float]]]:
    """{net: [(cell, pin, bit of the pin, fF)]} of the pins of library cells, of parts, and of memories in crowds.

    Without their clocks.
    """
    found: dict[int, list] = {}
    crowds: dict[int, list] = {}
    for name, cell in top["cells"].items():
        if cell["type"] == MACRO:
            for pin, bits in cell["connections"].items():
                if pin != "clk" and cell["port_directions"][pin] == "input":
                    for at, net in enumerate(bits):
                        if isinstance(net, int):
                            crowds.setdefault(net, []).append((name, pin, at, PIN_CAP))
        elif cell["type"] not in library.cells:
            loads = port_loads(module_of(cell, json), library)
            for pin, bits in cell["connections"].items():
                if pin != "clk" and cell["port_directions"][pin] == "input":
                    for at, net in enumerate(bits):
                        if isinstance(net, int):
                            found.setdefault(net, []).append((name, pin, at, loads[pin][at]))
        else:
            kind = library.cells[cell["type"]]
            clocks = {arc.pin for arc in kind.arcs if arc.kind in ("clock", "gated")}
            for pin, cap in kind.caps.items():
                (net,) = cell["connections"][pin]
                if pin not in clocks and isinstance(net, int):
                    found.setdefault(net, []).append((name, pin, 0, cap))
    for net, crowd in crowds.items():
        if sum(cap for *_, cap in crowd) > CROWD:
            found.setdefault(net, []).extend(crowd)
    return found


def buffers(json: dict, top: dict, library: Library, left: dict[int, float]) -> None:
    """Split nets of heavy load; pins stay outside of the buffers by the slack `left` of the nets behind them."""
    buffer = cheapest(library.cells, "buffer")
    (into,), (out,) = buffer.caps, buffer.functions
    wires = [bit for cell in top["cells"].values() for bits in cell["connections"].values() for bit in bits]
    fresh = 1 + max(bit for bit in wires if isinstance(bit, int))

    def behind(sink: tuple[str, str, int, float]) -> float:
        cell = top["cells"][sink[0]]
        if cell["type"] not in library.cells:
            return 0.0
        outs = [
            cell["connections"][pin][0] for pin in library.cells[cell["type"]].functions if pin in cell["connections"]
        ]
        return min((left.get(net, np.inf) for net in outs), default=np.inf)

    for net, found in sinks(json, top, library).items():
        ordered = sorted(found, key=behind)
        while sum(cap for *_, cap in ordered) > HEAVY and len(ordered) > 1:
            taken: list = []
            while ordered and sum(cap for *_, cap in taken) < HEAVY:
                taken.append(ordered.pop())
            for cell, pin, at, _ in taken:
                top["cells"][cell]["connections"][pin][at] = fresh
            name, sides = f"buffer{fresh}", {into: "input", out: "output"}
            wires = {into: [net], out: [fresh]}
            top["cells"][name] = {"type": buffer.name, "port_directions": sides, "connections": wires, "parameters": {}}
            ordered.insert(0, (name, into, 0, buffer.caps[into]))
            fresh += 1


def variants(cells: dict[str, Cell]) -> dict[str, list[str]]:
    """{cell: cells of the same function and pins}, itself included, the smallest first."""
    groups: dict[tuple, list[str]] = {}
    for name, cell in sorted(cells.items(), key=lambda pair: (pair[1].area, max(pair[1].max_load.values(), default=0))):
        if not (cell.sequential or cell.clock_gate) and cell.caps:
            key = (tuple(cell.caps), tuple((pin, text) for pin, text in cell.functions.items()))
            groups.setdefault(key, []).append(name)
    return {name: group for group in groups.values() for name in group}


def worst(cell: Cell, into: np.ndarray, load: np.ndarray) -> np.ndarray:
    """[n] ps of the slowest arc of gates with input slews and loads."""
    rows = [arc.coefficients[edge] for arc in cell.arcs for edge in (0, 1)]
    return np.max(basis(into, load) @ np.array(rows).T, axis=-1)


def stronger(design: Netlist, library: Library, found: Analysis, left: np.ndarray, below: float) -> list[tuple]:
    """(kind, row, new kind) of gates with a slack below `below` that another size of themselves makes faster.

    A size gains what its own delay falls, and costs what its inputs slow down the gates in front.
    """
    choice = variants(library.cells)
    slope = np.zeros(design.nets)  # ps/fF of what drives a net
    for kind, nets in design.gates.items():
        cell = library.cells[kind]
        for arc in cell.arcs:
            if arc.output:
                slope[nets[:, pins(cell).index(arc.output)]] = max(arc.coefficients[0][1], arc.coefficients[1][1])
    changes = []
    for kind, nets in design.gates.items():
        cell, group = library.cells[kind], choice.get(kind, [kind])
        if len(group) < 2:
            continue
        out = nets[:, pins(cell).index(next(iter(cell.functions)))]
        rows = np.flatnonzero(left[out] < below)
        if not len(rows):
            continue
        inputs = nets[rows, : len(cell.caps)]
        into = found.slew.reshape(-1, 2).max(axis=1)[inputs].max(axis=1)
        now = worst(cell, into, found.load[out[rows]])
        best, gain = np.full(len(rows), -1), np.full(len(rows), 0.5)
        for at, name in enumerate(group):
            other = library.cells[name]
            heavier = np.array([other.caps[pin] - cell.caps[pin] for pin in cell.caps])
            less = now - worst(other, into, found.load[out[rows]]) - (slope[inputs] * heavier).max(axis=1)
            best, gain = np.where(less > gain, at, best), np.maximum(less, gain)
        changes += [(kind, int(row), group[at]) for row, at in zip(rows, best) if at >= 0]
    return changes


def repair(json: dict, module: Module, library: Library, limit: float, outside: float = 0.0) -> float:
    """Mend a mapped module in place; returns its period, which may stay above `limit`.

    `outside`: ps of the period that are spent in front of its inputs, and as many behind its outputs.
    """
    top = json["modules"][module.name]
    strip(top, library)
    build = Builder(json, module, library)
    design = build.build(None)
    left = slack(analyse(design, library, outside=outside), design, library, limit, outside)
    buffers(json, top, library, {net: left[at] for net, at in build.net.items() if isinstance(net, int)})
    best, kinds = np.inf, {}
    for _ in range(ROUNDS):
        build = Builder(json, module, library)
        design = build.build(None)
        found = analyse(design, library, outside=outside)
        left = slack(found, design, library, limit, outside)
        period = limit - float(min(left.min(), 0.0))
        if period < best - 1:
            best, kinds = period, {name: cell["type"] for name, cell in top["cells"].items()}
        if period <= limit:
            break
        for kind, row, new in stronger(design, library, found, left, min(0.0, (limit - period) / 2)):
            top["cells"][build.names[kind][row]]["type"] = new
    for name, kind in kinds.items():
        top["cells"][name]["type"] = kind
    return best
