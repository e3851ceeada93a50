"""Buffers and gate sizes by our own timing, on netlists made by hand."""

from pathlib import Path

import pytest

from synth import cells, repair, timing
from synth.flow import Library, Module
from synth.netlist import alone

TABLE = Library(Path("none.lib"), cells.load(), "asap7")
SUFFIX = "_ASAP7_75t_R"


def gate(kind: str, output: tuple[str, int], **inputs: int) -> dict:
    wires = {pin: [net] for pin, net in inputs.items()} | {output[0]: [output[1]]}
    sides = dict.fromkeys(inputs, "input") | {output[0]: "output"}
    return {"type": kind + SUFFIX, "port_directions": sides, "connections": wires, "parameters": {}}


def fan_out(count: int) -> dict:
    """Net 2 through an inverter and a weak buffer into `count` NANDs, each with an input and an output of its own."""
    ends = [gate("NAND2xp33", ("Y", 5 + 2 * n + 1), A=4, B=5 + 2 * n) for n in range(count)]
    chain = [gate("INVxp33", ("Y", 3), A=2), gate("HB1xp67", ("Y", 4), A=3)]
    ports = {
        "in": {"direction": "input", "bits": [2, *range(5, 5 + 2 * count, 2)]},
        "out": {"direction": "output", "bits": [*range(6, 6 + 2 * count, 2)]},
    }
    named = {f"g{n}": cell for n, cell in enumerate([*chain, *ends])}
    return {"modules": {"top": {"ports": ports, "cells": named, "netnames": {}}}}


@pytest.mark.parametrize("count", [3, 40, 400])
def test_a_heavy_net_gets_a_balanced_tree(count):
    design = fan_out(count)
    repair.repair(design, Module("top"), TABLE, limit=150.0)
    found = design["modules"]["top"]["cells"].values()
    buffers = {c["connections"]["Y"][0]: c["connections"]["A"][0] for c in found if c["type"].startswith("BUF")}
    assert not any(cell["type"].startswith("HB1") for cell in found)
    depths = set()
    for cell in found:
        if cell["type"].startswith("NAND2"):
            net, depth = cell["connections"]["A"][0], 0
            while net in buffers:
                net, depth = buffers[net], depth + 1
            assert net == 3, "not behind the inverter"
            depths.add(depth)
    assert max(depths) <= {3: 0, 40: 1, 400: 2}[count]
    for net, pins in repair.sinks(design, design["modules"]["top"], TABLE).items():
        assert sum(cap for *_, cap in pins) < repair.HEAVY * 2, net


def test_gates_grow_where_the_clock_asks_for_it_and_only_there():
    slow, fast = fan_out(8), fan_out(8)
    repair.repair(slow, Module("top"), TABLE, limit=1000.0)
    said = repair.repair(fast, Module("top"), TABLE, limit=50.0)
    relaxed, pressed = (timing.longest(alone(d, Module("top"), TABLE), TABLE).period for d in (slow, fast))
    assert pressed < relaxed - 20 and said == pytest.approx(pressed)
    kinds = {name: cell["type"] for name, cell in slow["modules"]["top"]["cells"].items()}
    assert set(kinds.values()) == {"INVxp33" + SUFFIX, "NAND2xp33" + SUFFIX}
    assert fast["modules"]["top"]["cells"]["g0"]["type"] != kinds["g0"]


@pytest.mark.parametrize(("count", "depth"), [(12, 0), (16, 1), (64, 2)])
def test_a_crowd_of_memories_stands_behind_buffers_and_a_few_do_not(count, depth):
    """Net 2, a port, is the read enable of `count` memories."""
    memory = {
        "type": "gs_ram",
        "port_directions": {"clk": "input", "rd_en": "input", "rd_data": "output"},
        "parameters": {"WIDTH": f"{1:032b}", "DEPTH": f"{64:032b}"},
    }
    named = {f"m{n}": memory | {"connections": {"clk": [3], "rd_en": [2], "rd_data": [4 + n]}} for n in range(count)}
    sides = {"in": ("input", [2]), "clk": ("input", [3]), "out": ("output", [*range(4, 4 + count)])}
    ports = {name: {"direction": side, "bits": bits} for name, (side, bits) in sides.items()}
    defaults = {"parameter_default_values": {"WIDTH": "0", "DEPTH": "0"}}
    design = {"modules": {"top": {"ports": ports, "cells": named, "netnames": {}}, "gs_ram": defaults}}
    repair.repair(design, Module("top"), TABLE, limit=1000.0)
    found = design["modules"]["top"]["cells"].values()
    by = {cell["connections"]["Y"][0]: cell["connections"]["A"][0] for cell in found if cell["type"] != "gs_ram"}
    depths = set()
    for cell in found:
        if cell["type"] == "gs_ram":
            net, steps = cell["connections"]["rd_en"][0], 0
            while net != 2:
                net, steps = by[net], steps + 1
            depths.add(steps)
            assert cell["connections"]["clk"] == [3]
    assert max(depths) == depth and bool(min(depths)) == bool(depth)
    read = [*by.values(), *(cell["connections"]["rd_en"][0] for cell in found if cell["type"] == "gs_ram")]
    assert depth == 0 or max(map(read.count, read)) <= 15, "a heavy net is left"
