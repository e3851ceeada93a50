"""Sizes and buffers on a joined netlist made by hand."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from synth import cells, joint, timing
from synth.flow import Library, Module
from synth.netlist import Netlist, pins

TABLE = Library(Path("none.lib"), cells.load(), "asap7")
WEAK, SINK, CHAIN = (f"{kind}_ASAP7_75t_R" for kind in ("INVxp33", "NAND2xp5", "INVx1"))
LENGTH = 12


def shared(count: int) -> Netlist:
    """Net 2 through a weak inverter to net 3: into a chain of inverters, and into `count` gates that end at once."""
    chain = [[net, net + 1] for net in range(3, 3 + LENGTH)]
    idle = [[3, 2, 4 + LENGTH + n] for n in range(count)]
    nets = 4 + LENGTH + count
    ends = np.array([3 + LENGTH, *(out for *_, out in idle)])
    gates = {WEAK: np.array([[2, 3]]), SINK: np.array(idle), CHAIN: np.array(chain)}
    return Netlist(nets, gates, np.array([2]), ends, {"in": np.array([2]), "out": ends})


def drivers(design: Netlist) -> dict[int, tuple]:
    """{net: (function, nets)} of what drives it."""
    found = {}
    for kind, rows in design.gates.items():
        cell = TABLE.cells[kind]
        ((_, function),) = cell.functions.items()
        for row in rows.tolist():
            found[row[-1]] = (function.strip("()"), tuple(row[: len(pins(cell)) - 1]))
    return found


def final(net: int, by: dict[int, tuple]) -> int:
    """The net in front of all buffers."""
    while net in by and by[net][0] == "A":
        (net,) = by[net][1]
    return net


def function(design: Netlist) -> dict[int, tuple]:
    """`drivers` without buffers."""
    by = drivers(design)
    return {net: (f, tuple(final(i, by) for i in ins)) for net, (f, ins) in by.items() if f != "A"}


@pytest.mark.parametrize("count", [20, 60])
def test_pins_that_can_wait_stand_behind_buffers_and_the_function_stays(count):
    design = shared(count)
    before = timing.longest(design, TABLE).period
    mended = joint.mend(design, TABLE, 0.3 * before)
    assert timing.longest(mended, TABLE).period < 0.8 * before
    assert function(mended) == function(design) and len(drivers(design)) == count + LENGTH + 1
    by = drivers(mended)
    assert by[4][1] == (3,), "the chain waits for a buffer"
    assert sum(ins == (3,) for _, ins in by.values()) < count, "no buffer"
    load = timing.loads(mended, TABLE, 0.0)
    assert load[3] < timing.loads(design, TABLE, 0.0)[3] / 2, "its load stayed"
    assert all(load[net] < 2 * joint.HEAVY for net in range(design.nets, mended.nets))
    assert timing.longest(design, TABLE).period == before, "the given netlist was changed"


def test_only_gates_on_long_paths_change():
    design = shared(20)
    before = timing.longest(design, TABLE).period
    assert joint.mend(design, TABLE, before + 1) is design
    sized = joint.mend(design, TABLE, 0.7 * before)
    assert not np.array_equal(sized.gates.get(WEAK, []), design.gates[WEAK])
    assert np.array_equal(np.sort(sized.gates[SINK][:, -1]), np.sort(design.gates[SINK][:, -1])), "a sink grew"


def test_a_design_is_mended_only_where_it_misses_the_clock(monkeypatch):
    design = shared(60)
    period = timing.longest(design, TABLE).period
    inner = []
    monkeypatch.setattr(joint, "map_module", lambda module, library: SimpleNamespace(netlist={}))
    monkeypatch.setattr(joint, "Builder", lambda *_: SimpleNamespace(build=lambda part: inner.append(part) or design))
    for clock, same in ((period + 1, True), (period - 1, False)):
        monkeypatch.setattr(joint, "CLOCK", clock)
        monkeypatch.setattr(joint, "AIM", 0.9 * period)
        found = joint.joined.__wrapped__(Module("top"), TABLE)
        assert (found is design) == same
    assert inner == [joint.joined, joint.joined], "parts as they are mapped, not mended"


def test_mending_ends_when_it_no_longer_helps(monkeypatch):
    """An aim out of reach: rounds go on after the last gain, but not many."""
    design, periods = shared(60), []

    def watched(*args, **more):
        found = timing.analyse(*args, **more)
        periods.append(float(found.arrival.max()))
        return found

    monkeypatch.setattr(joint, "analyse", watched)
    monkeypatch.setattr(joint, "ROUNDS", 100)
    mended = joint.mend(design, TABLE, 1.0)
    assert len(periods) < 40 and min(periods[: -joint.HOPELESS]) < min(periods[-joint.HOPELESS :]) + 1
    assert timing.analyse(mended, TABLE).arrival.max() < min(periods) + 1
