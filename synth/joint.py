"""Gate sizes and buffers where joined modules meet, on the flat netlist.

A module is mapped without knowing what its neighbours' paths add, so a joined path may miss the clock where no module
does. Gates on such paths get the size that is fastest there, and pins that are not on them go behind a buffer. The
parts of a module are mended before it, each once however often it occurs.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from synth.cells import cheapest
from synth.flow import CLOCK, Library, Module, map_module
from synth.netlist import CONSTANTS, Builder, Netlist, netlist, pins
from synth.repair import HEAVY, stronger
from synth.timing import Analysis, analyse, longest, slack

AIM = 950.0  # ps for designs that miss CLOCK
ROUNDS = 16
HOPELESS = 4  # rounds without gain that end it
SPARE = 20.0  # ps that a pin must be ahead of its net's most urgent one to stand behind a buffer


def exchange(design: Netlist, changes: list[tuple[str, int, str]]) -> Netlist:
    """A netlist in which (kind, row) are gates of another kind with the same pins."""
    gates, fresh = dict(design.gates), {}
    for kind in {change[0] for change in changes}:
        rows = {row: new for at, row, new in changes if at == kind}
        gates[kind] = np.delete(design.gates[kind], list(rows), axis=0)
        for row, new in sorted(rows.items()):
            fresh.setdefault(new, []).append(design.gates[kind][row])
    for kind, rows in fresh.items():
        gates[kind] = np.concatenate([gates[kind], rows] if kind in gates else [rows])
    return replace(design, gates=dict(sorted(gates.items())))


def relieve(design: Netlist, library: Library, found: Analysis, left: np.ndarray, below: float) -> Netlist:
    """Nets with a slack under `below` keep their urgent pins; the others go behind buffers, HEAVY each."""
    buffer = cheapest(library.cells, "buffer")
    (cap,) = buffer.caps.values()
    urgent = left < below
    urgent[:CONSTANTS] = False
    late = found.arrival.reshape(-1, 2).max(axis=1)
    end = late.max() + left.min()  # ps, of the paths that are asked for
    others: dict[int, list] = {}  # of each net: (slack, fF, kind, row, pin), pins that can wait
    for kind, nets in design.gates.items():
        cell = library.cells[kind]
        clocks = {arc.pin for arc in cell.arcs if arc.kind in ("clock", "gated")}
        stops = cell.sequential or cell.clock_gate
        outs = [left[nets[:, pins(cell).index(pin)]] for pin in cell.functions]
        for at, (pin, load) in enumerate(cell.caps.items()):
            if pin in clocks:
                continue
            net = nets[:, at]
            behind = end - late[net] if stops else np.min(outs, axis=0)
            for row in np.flatnonzero(urgent[net] & (behind > left[net] + SPARE)):
                others.setdefault(int(net[row]), []).append((-float(behind[row]), load, kind, int(row), at))
    gates, fresh, count = {kind: nets.copy() for kind, nets in design.gates.items()}, [], design.nets
    for net, waiting in sorted(others.items()):
        waiting.sort()
        while sum(pin[1] for pin in waiting) > 2 * cap:
            taken: list = []
            while waiting and sum(pin[1] for pin in taken) < HEAVY:
                taken.append(waiting.pop(0))
            for _, _, kind, row, at in taken:
                gates[kind][row, at] = count
            fresh.append([net, count])
            count += 1
    if fresh:
        gates[buffer.name] = np.concatenate([gates.get(buffer.name, np.zeros((0, 2), int)), fresh])
    return replace(design, nets=count, gates=dict(sorted(gates.items())))


def mend(design: Netlist, library: Library, limit: float) -> Netlist:
    """The design with its paths brought towards `limit` ps, as far as that helps."""
    best, shortest, gained = design, np.inf, 0
    for at in range(ROUNDS):
        found = analyse(design, library)
        left = slack(found, design, library, limit)
        period = limit - float(left.min())
        if period < shortest - 1:
            best, shortest, gained = design, period, at
        if period <= limit or at - gained == HOPELESS:
            break
        below = (limit - period) / 2
        if at % 2:
            design = relieve(design, library, found, left, below)
        else:
            design = exchange(design, stronger(design, library, found, left, below))
    return best


@cache
def joined(module: Module, library: Library) -> Netlist:
    """The flat netlist of a module and its parts, mended where it misses CLOCK."""
    if library.plain:
        return netlist(module, library)
    design = Builder(map_module(module, library).netlist, module, library).build(joined)
    return design if longest(design, library).period <= CLOCK else mend(design, library, AIM)
