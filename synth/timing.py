"""Static timing of a flat netlist: the longest path between registers, and so the clock.

Each net has an arrival time and a slew for its rising and its falling edge, both the worst of the arcs that end there.
Paths start at flip-flops, memories and ports and end there; a port counts as a flip-flop of the neighbour, so that a
unit is timed as if registers stood around it. The enable of a clock gate ends a path as the data of a flip-flop do. A
net's load is its pins and `wire` um of wire for each of them. No wire resistance, clock skew, cross talk or variation;
hold is not looked at.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from synth import memories
from synth.cells import Cell, basis, cheapest
from synth.characterise import CLOCK_SLEW
from synth.flow import Library
from synth.netlist import CONSTANTS, Netlist, pin_loads, pins

WIRE_CAP = 0.173  # fF/um, signal wires of OpenROAD-flow-scripts' ASAP7 platform (setRC.tcl)
RISE, FALL = 0, 1
# what an input edge does: (edge in, edge out)
EDGES = {
    "positive": ((RISE, RISE), (FALL, FALL)),
    "negative": ((FALL, RISE), (RISE, FALL)),
    "both": ((RISE, RISE), (FALL, FALL), (FALL, RISE), (RISE, FALL)),
}


@dataclass(frozen=True)
class Path:
    """The longest path: its time with setup in ps, and its steps (cell, arrival in ps), first to last."""

    period: float
    start: str
    end: str
    steps: tuple[tuple[str, float], ...]

    @property
    def cells(self) -> list[str]:
        return [self.start, *(name for name, _ in self.steps), self.end]


@dataclass
class Arcs:
    """All combinational arcs of a design, one entry for each gate, arc and pair of edges."""

    source: np.ndarray  # [n] node of the input edge: 2 * net + edge
    target: np.ndarray  # [n]
    table: np.ndarray  # [n] row of `coefficients`
    coefficients: np.ndarray  # [rows, 2, 5]: delay, slew
    names: list[str]  # [rows] cell


def arcs_of(design: Netlist, library: Library) -> Arcs:
    source, target, table, rows, names = [], [], [], [], []
    for kind, nets in design.gates.items():
        cell = library.cells[kind]
        column = {pin: at for at, pin in enumerate(pins(cell))}
        for arc in cell.arcs:
            for into, out in EDGES.get(arc.kind, ()):
                source.append(2 * nets[:, column[arc.pin]] + into)
                target.append(2 * nets[:, column[arc.output]] + out)
                table.append(np.full(len(nets), len(rows)))
                rows.append(arc.coefficients[[out, 2 + out]])
                names.append(kind)
    flat = [np.concatenate(part) if part else np.zeros(0, int) for part in (source, target, table)]
    live = flat[0] >= 2 * CONSTANTS  # a constant has no edges
    return Arcs(*(part[live] for part in flat), np.array(rows).reshape(-1, 2, 5), names)


def loads(design: Netlist, library: Library, wire: float) -> np.ndarray:
    """[nets] fF on each net."""
    load = pin_loads(design, library, wire * WIRE_CAP)
    for net, cap in design.left_out:
        load[net] += cap
    flop = cheapest(library.cells, "flop")
    np.add.at(load, design.memory_in, memories.PIN_CAP + wire * WIRE_CAP)
    np.add.at(load, design.outputs, flop.caps[flop.pin("setup")] + wire * WIRE_CAP)
    return load


def clock_arc(flop: Cell):
    (arc,) = (arc for arc in flop.arcs if arc.kind == "clock")
    return arc


def levels(arcs: Arcs, nodes: int) -> list[np.ndarray]:
    """Arcs in the order in which they can be evaluated: indices, a level each."""
    waiting = np.bincount(arcs.target, minlength=nodes)
    order = np.argsort(arcs.source, kind="stable")
    first = np.searchsorted(arcs.source[order], np.arange(nodes + 1))
    ready = np.flatnonzero(waiting == 0)
    found, done = [], 0
    while len(ready):
        counts = first[ready + 1] - first[ready]
        starts = np.repeat(first[ready] - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts)
        level = order[starts + np.arange(counts.sum())]
        if len(level):
            found.append(level)
        done += len(level)
        np.subtract.at(waiting, arcs.target[level], 1)
        touched = np.unique(arcs.target[level])
        ready = touched[waiting[touched] == 0]
    if done != len(arcs.target):
        raise RuntimeError("the netlist has a combinational loop")
    return found


def starts(design: Netlist, library: Library, load: np.ndarray) -> tuple[np.ndarray, np.ndarray, dict[int, str]]:
    """Arrival and slew [nodes] at the start points (-inf elsewhere), and what stands there by net."""
    arrival = np.full(2 * design.nets, -np.inf)
    slew = np.zeros(2 * design.nets)
    places: dict[int, str] = {}

    def launch(nets: np.ndarray, cell: Cell, name: str) -> None:
        rows = clock_arc(cell).coefficients
        for edge in (RISE, FALL):
            numbers = basis(CLOCK_SLEW, load[nets])
            arrival[2 * nets + edge] = numbers @ rows[edge]
            slew[2 * nets + edge] = numbers @ rows[2 + edge]
        places.update(dict.fromkeys(nets.tolist(), name))

    launch(design.inputs, cheapest(library.cells, "flop"), "port")
    for kind, nets in design.gates.items():
        cell = library.cells[kind]
        if cell.sequential:
            launch(nets[:, pins(cell).index(clock_arc(cell).output)], cell, kind)
    for edge in (RISE, FALL):
        arrival[2 * design.memory_out + edge] = memories.ACCESS
        slew[2 * design.memory_out + edge] = memories.SLEW
    places.update(dict.fromkeys(design.memory_out.tolist(), "memory"))
    arrival[: 2 * CONSTANTS] = -np.inf
    return arrival, slew, places


def ends(design: Netlist, library: Library, slew: np.ndarray) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """(what, nodes, setup time in ps) of the end points."""
    found = [("memory", design.memory_in, None), ("port", design.outputs, cheapest(library.cells, "flop"))]
    for kind, nets in design.gates.items():
        cell = library.cells[kind]
        if cell.sequential or cell.clock_gate:
            found.append((kind, nets[:, pins(cell).index(cell.pin("setup"))], cell))
    result = []
    for name, nets, cell in found:
        for edge in (RISE, FALL):
            nodes = 2 * nets + edge
            setup = np.full(len(nodes), memories.SETUP)
            if cell:
                (arc,) = (arc for arc in cell.arcs if arc.kind == "setup")
                setup = basis(slew[nodes], 0.0) @ arc.coefficients[edge]
            result.append((name, nodes, setup))
    return result


@dataclass
class Analysis:
    """Arrival and slew [nodes], delay [arcs], `by` [nodes]: the arc that gave a node its arrival, -1 at a start."""

    load: np.ndarray
    arcs: Arcs
    order: list[np.ndarray]
    arrival: np.ndarray
    slew: np.ndarray
    places: dict[int, str]
    delay: np.ndarray
    by: np.ndarray


def analyse(design: Netlist, library: Library, wire: float = 0.0, outside: float = 0.0) -> Analysis:
    """Propagate arrivals and slews; inputs come `outside` ps later."""
    load = loads(design, library, wire)
    arcs = arcs_of(design, library)
    arrival, slew, places = starts(design, library, load)
    arrival[np.unique(np.concatenate([2 * design.inputs, 2 * design.inputs + 1]))] += outside
    empty = np.zeros(len(arcs.source)), np.full(2 * design.nets, -1)
    found = Analysis(load, arcs, levels(arcs, 2 * design.nets), arrival, slew, places, *empty)
    for level in found.order:
        source, target = arcs.source[level], arcs.target[level]
        numbers = basis(slew[source], load[target // 2])
        delay, edge = np.einsum("nk,nqk->qn", numbers, arcs.coefficients[arcs.table[level]])
        found.delay[level] = np.maximum(delay, 0.0)
        time = arrival[source] + found.delay[level]
        np.maximum.at(slew, target, np.where(time > -np.inf, edge, 0.0))
        order = np.lexsort((time, target))
        last = order[np.append(np.diff(target[order]) > 0, True)]  # the latest arc at each node
        last = last[time[last] > arrival[target[last]]]
        arrival[target[last]] = time[last]
        found.by[target[last]] = level[last]
    return found


def slack(found: Analysis, design: Netlist, library: Library, period: float, outside: float = 0.0) -> np.ndarray:
    """[nets] ps that a net could come later with a clock of `period` ps; outputs must be there `outside` ps earlier."""
    required = np.full(2 * design.nets, np.inf)
    for name, nodes, setup in ends(design, library, found.slew):
        np.minimum.at(required, nodes, period - setup - (outside if name == "port" else 0.0))
    for level in reversed(found.order):
        np.minimum.at(required, found.arcs.source[level], required[found.arcs.target[level]] - found.delay[level])
    left = np.where(found.arrival > -np.inf, required - found.arrival, np.inf)
    return left.reshape(-1, 2).min(axis=1)


def longest(design: Netlist, library: Library, wire: float = 0.0) -> Path:
    """The path that limits the clock, with `wire` um of wire for each pin of a net."""
    found = analyse(design, library, wire)
    best = (-np.inf, "", -1)
    for name, nodes, setup in ends(design, library, found.slew):
        if len(nodes):
            times = found.arrival[nodes] + setup
            at = int(np.argmax(times))
            best = max(best, (float(times[at]), name, int(nodes[at])))
    period, end, node = best
    steps = []
    while node >= 0 and found.by[node] >= 0:
        steps.append((found.arcs.names[found.arcs.table[found.by[node]]], round(float(found.arrival[node]), 1)))
        node = int(found.arcs.source[found.by[node]])
    return Path(period, found.places.get(node // 2, ""), end, tuple(reversed(steps)))
