"""A mapped netlist as arrays: gates in the order of evaluation, delays, and the energy of each net's toggles.

A gate's delay is the mean of its arcs at its load and a slew of 20 ps, in whole ps. Energy of a toggle: what the cell
that drives the net spends inside, 1/2 C V^2 of pins and wire, and what the edge costs inside of registers behind it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from synth import memories
from synth.cells import Cell, basis, cheapest
from synth.characterise import CLOCK_SLEW
from synth.flow import Library
from synth.netlist import CONSTANTS, Netlist, pins
from synth.timing import loads

VOLT = 0.7
INPUTS = 6  # of a cell, at most
RAM_PORTS = ("wr_en", "wr_addr", "wr_data", "rd_en", "rd_addr", "rd_data")


def truth(function: str, inputs: list[str]) -> int:
    """Bit k: the output when input i is bit i of k."""
    code = compile(function.replace("!", " not ").replace("*", " and ").replace("+", " or ").strip(), function, "eval")
    values = ({pin: k >> i & 1 for i, pin in enumerate(inputs)} for k in range(1 << len(inputs)))
    return sum(bool(eval(code, {}, value)) << k for k, value in enumerate(values))


@dataclass(frozen=True)
class Circuit:
    """A netlist in the order of evaluation.

    G gates with one output each, F flip-flops, D clocks (0 itself, the others behind a clock gate), R memories.
    """

    tables: np.ndarray  # uint64[G] truth tables
    sources: np.ndarray  # int32[G, INPUTS] nets
    targets: np.ndarray  # int32[G]
    delays: np.ndarray  # int32[nets] ps from what drives a net: its inputs, or the clock edge
    flop_in: np.ndarray  # int32[F]
    flop_out: np.ndarray  # int32[F]
    flop_inverts: np.ndarray  # uint8[F]
    flop_clock: np.ndarray  # int32[F]
    clock_enable: np.ndarray  # int32[D] net
    ram_nets: np.ndarray  # int32[...] nets of all ports of all memories
    ram_at: np.ndarray  # int64[R, 7]: where each port of RAM_PORTS begins, and the last ends
    ram_words: np.ndarray  # int64[R + 1]: first bit of each memory
    toggle: np.ndarray  # float64[nets] fJ a toggle
    tick: np.ndarray  # float64[D] fJ a cycle of each clock
    leakage: float  # mW


def ordered(sources: np.ndarray, targets: np.ndarray, nets: int) -> np.ndarray:
    """Gates such that each comes behind those that drive its inputs."""
    order = _ordered(sources, targets, nets)
    if len(order) < len(targets):
        raise RuntimeError("the netlist has a combinational loop")
    return order


@numba.njit(cache=True)
def _ordered(sources, targets, nets):
    gates = len(targets)
    driver = np.full(nets, -1, np.int32)
    for g in range(gates):
        driver[targets[g]] = g
    waiting = np.zeros(gates, np.int32)
    first = np.zeros(gates + 1, np.int64)
    for g in range(gates):
        for net in sources[g]:
            if driver[net] >= 0:
                waiting[g] += 1
                first[driver[net] + 1] += 1
    first = np.cumsum(first)
    readers = np.zeros(first[-1], np.int32)
    at = first.copy()
    for g in range(gates):
        for net in sources[g]:
            if driver[net] >= 0:
                readers[at[driver[net]]] = g
                at[driver[net]] += 1
    order = np.empty(gates, np.int32)
    end = 0
    for g in range(gates):
        if waiting[g] == 0:
            order[end] = g
            end += 1
    done = 0
    while done < end:
        g = order[done]
        done += 1
        for r in readers[first[g] : first[g + 1]]:
            waiting[r] -= 1
            if waiting[r] == 0:
                order[end] = r
                end += 1
    return order[:end]


def build(design: Netlist, library: Library, wire: float) -> Circuit:
    """A netlist for gatesim.run, with `wire` um of wire for each pin of a net."""
    charge = 0.5 * loads(design, library, wire) * VOLT**2
    toggle, leakage = charge.copy(), 0.0
    load = 2 * charge / VOLT**2
    delays = np.zeros(design.nets)
    delays[design.inputs] = delay(cheapest(library.cells, "flop"), None, load[design.inputs])
    delays[design.memory_out] = memories.ACCESS
    tables, sources, targets = [], [], []
    flops, gates = [], {}
    for kind, nets in design.gates.items():
        cell = library.cells[kind]
        column = {pin: nets[:, at] for at, pin in enumerate(pins(cell))}
        leakage += cell.leakage * len(nets) * 1e-9
        for pin, energy in cell.pin_energy.items():
            if pin != clock_pin(cell):
                np.add.at(toggle, column[pin], energy)
        for pin, function in cell.functions.items():
            toggle[column[pin]] += cell.energy.get(pin, 0.0)
            delays[column[pin]] = delay(cell, pin, load[column[pin]])
            if cell.clock_gate:
                enable, clock = column[cell.pin("setup")], column[cell.pin("gated")]
                gates |= {int(out): (int(e), int(c), cell) for out, e, c in zip(column[pin], enable, clock)}
            elif cell.sequential:
                flops.append((cell, column[clock_pin(cell)], column[cell.pin("setup")], column[pin], "!" in function))
            else:
                inputs = np.zeros((len(nets), INPUTS), np.int32)
                inputs[:, : len(cell.caps)] = nets[:, : len(cell.caps)]
                tables.append(np.full(len(nets), truth(function, list(cell.caps)), np.uint64))
                sources.append(inputs)
                targets.append(column[pin])
    clocks = {int(design.ports["clk"][0]): 0} | {net: k + 1 for k, net in enumerate(gates)}
    tick = np.array([2 * toggle[net] if k else 2 * charge[net] for net, k in clocks.items()])
    for _, clock, cell in gates.values():
        if clocks[clock]:
            raise RuntimeError("a clock gate behind a clock gate")
        tick[0] += 2 * cell.pin_energy[cell.pin("gated")]
    for cell, clock, *_ in flops:
        at = np.array([clocks[int(net)] for net in clock])
        np.add.at(tick, at, 2 * cell.pin_energy[clock_pin(cell)])
    joined = [np.concatenate([np.asarray(row[k]) for row in flops] or [np.zeros(0, int)]) for k in (1, 2, 3)]
    inverts = [np.full(len(row[1]), row[4], np.uint8) for row in flops]
    ram_nets, ram_at = [], []
    for _, ports in design.rams:
        ends = np.cumsum([sum(map(len, ram_nets))] + [len(ports[p]) for p in RAM_PORTS])
        ram_at.append(ends)
        ram_nets += [ports[p] for p in RAM_PORTS]
    words = np.cumsum([0] + [memory.width << len(ports["wr_addr"]) for memory, ports in design.rams])
    flat = [np.concatenate(part or [np.zeros(0, int)]) for part in (tables, targets)]
    inputs = np.concatenate(sources or [np.zeros((0, INPUTS), np.int32)])
    order = ordered(inputs, flat[1].astype(np.int32), design.nets)
    toggle[:CONSTANTS] = 0
    return Circuit(
        tables=flat[0][order].astype(np.uint64),
        sources=inputs[order],
        targets=flat[1][order].astype(np.int32),
        delays=np.maximum(np.rint(delays), 1).astype(np.int32),
        flop_in=joined[1].astype(np.int32),
        flop_out=joined[2].astype(np.int32),
        flop_inverts=np.concatenate(inverts or [np.zeros(0, np.uint8)]),
        flop_clock=np.array([clocks[int(net)] for net in joined[0]], np.int32),
        clock_enable=np.array([1] + [gates[net][0] for net in gates], np.int32),
        ram_nets=np.concatenate(ram_nets or [np.zeros(0, int)]).astype(np.int32),
        ram_at=np.array(ram_at, np.int64).reshape(-1, len(RAM_PORTS) + 1),
        ram_words=words,
        toggle=toggle,
        tick=tick,
        leakage=leakage,
    )


def clock_pin(cell: Cell) -> str | None:
    """The pin at which a flip-flop or a clock gate has its clock."""
    kinds = {"gated"} if cell.clock_gate else {"clock"}
    return next((arc.pin for arc in cell.arcs if arc.kind in kinds), None)


def delay(cell: Cell, output: str | None, load: np.ndarray) -> np.ndarray:
    """ps from the inputs of a cell (the clock of a flip-flop) to an output, or to its only one, for each load in fF."""
    arcs = [arc.coefficients[:2] for arc in cell.arcs if arc.output and output in (None, arc.output)]
    return basis(CLOCK_SLEW, load) @ np.concatenate(arcs).mean(axis=0) if arcs else np.zeros(len(load))
