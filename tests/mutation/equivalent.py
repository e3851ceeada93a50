"""Proves that a surviving mutant cannot be told from its unit.

Unit and mutant get the same inputs and the same answers from their parts; the inputs of the parts count as outputs.
ABC shows that no output differs: first with the same values in all registers, in any state (a change without any
effect); then by induction and property directed reachability over the states that occur. There, each register starts
with the same unknown value in both, the first two cycles are a reset, and the fields of a stream count while its valid
is high, an address of a memory while its enable is. What a part does with a bit counts too: in any state, with the
part at whose port the change is, or with all of them.
"""

from __future__ import annotations

import json
from pathlib import Path

from tests import builds, formal
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


def guards(ports: dict[str, dict]) -> dict[str, str]:
    """Output -> the output that says when it counts: valid of a stream, enable of a gs_ram."""
    found = {f: s.name + "valid" for s in formal.streams(ports) if s.output for f in s.fields}
    for name in ports:
        for field, enable in (("_wr_addr", "_wr_en"), ("_wr_data", "_wr_en"), ("_rd_addr", "_rd_en")):
            if name.endswith(field) and name.removesuffix(field) + enable in ports:
                found[name] = name.removesuffix(field) + enable
    return {name: enable for name, enable in found.items() if ports[enable]["direction"] == "output"}


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
    guard = guards(ports) if states else {}
    counts = {name: f" && gold_{enable}" for name, enable in guard.items()}
    different = ", ".join(f"gold_{name} != gate_{name}{counts.get(name, '')}" for name in shown)
    lines += [f"assign differs = |{{{different}}}{' && !first && !second' if states else ''};", "endmodule", ""]
    return "\n".join(lines)


def prove(unit: Unit, mutant: Mutant) -> str:
    """How it was proven, one of those below, or nothing."""
    folder = unit.folder / "equivalent" / str(mutant.number)
    folder.mkdir(parents=True, exist_ok=True)
    part, parts = changed_part(unit, mutant), below(unit.module)
    ways = [("any state", [], False)]
    ways += [("any state, with the part that is changed", part, False)] * bool(part)
    ways += [("reachable states", [], True)]
    ways += [("any state, with its parts", parts, False)] * bool(parts)
    for said, inside, states in ways:
        ports, registers = open_pair(unit, mutant, folder, inside)
        if not ports or (states and not registers):
            continue
        (folder / "product.v").write_text(product(ports, registers, states))
        if decide(folder):
            return said
    return ""


def below(module: str) -> list[Path]:
    """Files of the modules inside a module, down to the memories."""
    return [path for path in builds.sources(module) if path.stem not in (module, "gs_ram")]


def changed_part(unit: Unit, mutant: Mutant) -> list[Path]:
    """The part at whose port the mutant is, and what is inside it; nothing where it is not at a part."""
    cells = json.loads((unit.folder / "unit.json").read_text())["modules"][unit.module]["cells"]
    kind = cells[mutant.cell.lstrip("\\")]["type"]
    if kind not in builds.modules() or kind == "gs_ram":
        return []
    return [builds.modules()[kind], *below(kind)]


def open_pair(unit: Unit, mutant: Mutant, folder: Path, inside: list[Path]) -> tuple[dict, dict[str, str]]:
    """Unit and mutant as `opened` gives them, in open.json; inside: files of the parts that are not left out."""
    place = folder.relative_to(ROOT)
    change = mutant.command.replace(f"-module {unit.module} ", "-module gate ")
    script = [
        f"read_rtlil {unit.folder.relative_to(ROOT)}/unit.il",
        f"rename {unit.module} gold",
        "copy gold gate",
        change,
    ]
    if inside:
        script += [f"delete ={path.stem}" for path in inside]
        script += [f"read_verilog -Irtl {path.relative_to(ROOT)}" for path in inside]
        script += ["setattr -mod -unset top *", "hierarchy -check", "proc", "opt_expr", "flatten", "opt_clean"]
    script += ["memory_map", "dffunmap", f"write_json {place}/pair.json"]
    (folder / "pair.json").unlink(missing_ok=True)
    done = formal.yosys(folder, script)
    if done.returncode or not (folder / "pair.json").exists():
        return {}, {}
    pair = json.loads((folder / "pair.json").read_text())["modules"]
    gold, registers = opened(pair["gold"])
    gate, _ = opened(pair["gate"])
    (folder / "open.json").write_text(json.dumps({"modules": {"gold": gold, "gate": gate}}))
    return gold["ports"], registers


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
    script += ["flatten", "opt -full", "setundef -undriven -zero", "techmap", "opt", "setundef -zero"]
    script += ["dffunmap", "aigmap", "opt_clean"]
    script += [f"write_aiger -zinit {place}/proof.aig", "design -reset", f"read_verilog {place}/one.v", "simplemap"]
    formal.yosys(folder, [*script, f"abc -script {place}/abc.txt"], SECONDS)  # fails at the end: ABC hands nothing back
    model = folder / "proof.aig"
    head, *lines = model.read_bytes().split(b"\n") if model.exists() else [b""]
    if lines and lines[int(head.split()[3])] == b"0":  # `differs` is constant: Yosys has found that both are the same
        return True
    status = folder / "status.txt"
    return status.exists() and status.read_text().split()[0] == "snl_UNSAT"
