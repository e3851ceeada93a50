"""Proves that a surviving mutant cannot be told from its unit.

Unit and mutant get the same inputs and the same answers from their parts; the inputs of the parts count as outputs.
Each register starts with the same unknown value in both, and the first two cycles are a reset. ABC shows that no output
differs behind it: first with the same value in each pair of registers in any state (a change without any effect), then
by induction and property directed reachability over the states that occur.
"""

from __future__ import annotations

import json
from pathlib import Path

from tests import formal
from tests.builds import ROOT
from tests.mutation.netlist import Mutant, Unit

SECONDS = 100  # of processor time for one proof
PORT = {"input": "output", "output": "input"}


def opened(module: dict) -> tuple[dict, dict[str, str]]:
    """The module without registers and parts, whose connections are ports; register's output port -> input port."""
    ports, registers = dict(module["ports"]), {}
    clk = module["ports"]["clk"]["bits"]
    cut = {n: c for n, c in sorted(module["cells"].items()) if c["type"] == "$dff" or not c["type"].startswith("$")}
    cells = {name: cell for name, cell in module["cells"].items() if name not in cut}
    for at, cell in enumerate(cut.values()):
        for port, bits in cell["connections"].items():
            if bits and bits != clk:
                ports[f"c{at}_{port}"] = {"direction": PORT[cell["port_directions"][port]], "bits": bits}
        if cell["type"] == "$dff":
            registers[f"c{at}_Q"] = f"c{at}_D"
    return {"attributes": {}, "ports": ports, "cells": cells, "netnames": {}}, registers


def product(ports: dict[str, dict], registers: dict[str, str], states: bool) -> str:
    """Verilog: both modules side by side, `differs` when an output does; registers free (equal) or real."""
    width = {name: len(info["bits"]) for name, info in ports.items()}
    inputs = [
        n for n, i in ports.items() if i["direction"] == "input" and n not in registers and n not in ("clk", "rst")
    ]
    outputs = [n for n, i in ports.items() if i["direction"] == "output"]
    free = [f"input wire [{width[n] - 1}:0] {n}" for n in [*inputs, *registers]]
    lines = [f"module product ({', '.join(['input wire clk, input wire rst', *free, 'output wire differs'])});"]
    lines += ["reg first = 1'b1; reg second = 1'b1;", "always @(posedge clk) begin first <= 1'b0; second <= first; end"]
    reset = "rst || first || second" if states else "rst"
    shown = [n for n in outputs if not (states and n in registers.values())]
    for side in ("gold", "gate"):
        lines += [f"wire [{width[n] - 1}:0] {side}_{n};" for n in outputs]
        if states:
            for q, d in registers.items():
                lines += [f"reg [{width[q] - 1}:0] {side}_{q};"]
                lines += [f"always @(posedge clk) {side}_{q} <= first ? {q} : {side}_{d};"]
        pins = [
            ".clk(clk)",
            *([f".rst({reset})"] if "rst" in ports else []),
            *[f".{n}({n})" for n in inputs],
            *[f".{n}({side}_{n})" for n in outputs],
        ]
        pins += [f".{q}({f'{side}_{q}' if states else q})" for q in registers]
        lines.append(f"{side} {side} ({', '.join(pins)});")
    different = " || ".join(f"gold_{n} != gate_{n}" for n in shown)
    lines += [f"assign differs = ({different}){' && !first && !second' if states else ''};", "endmodule", ""]
    return "\n".join(lines)


def prove(unit: Unit, mutant: Mutant) -> str:
    """How it was proven ("any state" or "reachable states"), or nothing."""
    folder = unit.folder / "equivalent" / str(mutant.number)
    folder.mkdir(parents=True, exist_ok=True)
    place = folder.relative_to(ROOT)
    change = mutant.command.replace(f"-module {unit.module} ", "-module gate ")
    script = [f"read_rtlil {unit.folder.relative_to(ROOT)}/unit.il", f"rename {unit.module} gold", "copy gold gate"]
    script += [change, "memory_map", "dffunmap", f"write_json {place}/pair.json"]
    (folder / "pair.json").unlink(missing_ok=True)
    done = formal.yosys(folder, script)
    if done.returncode or not (folder / "pair.json").exists():
        return ""
    pair = json.loads((folder / "pair.json").read_text())["modules"]
    gold, registers = opened(pair["gold"])
    gate, _ = opened(pair["gate"])
    (folder / "open.json").write_text(json.dumps({"modules": {"gold": gold, "gate": gate}}))
    for states, said in ((False, "any state"), (True, "reachable states"))[: 1 + bool(registers)]:
        (folder / "product.v").write_text(product(gold["ports"], registers, states))
        if decide(folder):
            return said
    return ""


def decide(folder: Path) -> bool:
    """Whether ABC proves that `differs` stays 0."""
    place = folder.relative_to(ROOT)
    for name in ("proof.aig", "status.txt"):
        (folder / name).unlink(missing_ok=True)
    (folder / "one.v").write_text("module one(input a, b, output y); assign y = a & b; endmodule\n")
    abc = [f"read_aiger {place}/proof.aig", "scorr", "pdr", f"write_status {place}/status.txt"]
    (folder / "abc.txt").write_text("\n".join([*abc, ""]))
    script = [
        f"read_json {place}/open.json",
        f"read_verilog {place}/product.v",
        "hierarchy -check -top product",
        "proc",
    ]
    script += ["flatten", "setundef -undriven -zero", "opt -full", "techmap", "opt", "dffunmap", "aigmap", "opt_clean"]
    script += [f"write_aiger -zinit {place}/proof.aig", "design -reset", f"read_verilog {place}/one.v", "simplemap"]
    formal.yosys(folder, [*script, f"abc -script {place}/abc.txt"], SECONDS)  # fails at the end: ABC hands nothing back
    if not (folder / "proof.aig").exists():
        return False
    head, *lines = (folder / "proof.aig").read_bytes().split(b"\n")
    if lines[int(head.split()[3])] == b"0":  # `differs` is constant: Yosys has found that both are the same
        return True
    status = folder / "status.txt"
    return status.exists() and status.read_text().split()[0] == "snl_UNSAT"
