"""Gates in place of RTL: builds of a bench in which the module is its mapped netlist.

The netlist has no parameters, so it stands inside of a module with the RTL's header, and the bench sees no difference.
"""

from __future__ import annotations

import re
from pathlib import Path

from synth import cells, flow, netlist
from synth.flow import Library, Module
from tests import builds
from tests.builds import ROOT, Bench

WAIVED = ("DECLFILENAME", "UNUSEDSIGNAL", "UNUSEDPARAM", "LATCH", "UNDRIVEN")  # UNDRIVEN: bits that mapping dropped
LINT_OFF = "".join(f"/* verilator lint_off {rule} */\n" for rule in WAIVED)


def header(text: str) -> str:
    """A module's text up to the end of its ports; every output is a wire."""
    found = re.search(r"^module .*?^\);", text, re.MULTILINE | re.DOTALL)
    return re.sub(r"\boutput\s+reg\b", "output wire", found[0])


def wrapped(module: Module, library: Library, folder: Path) -> list[Path]:
    """The gates of one module under another name, inside of a module with the header of its RTL."""
    (rtl,) = (path for path in builds.sources(module.name) if path.stem == module.name)
    head = header(rtl.read_text())
    ports = re.findall(r"^\s*(?:input|output)\s+wire\s*(?:\[.*\])?\s*(\w+)\s*,?\s*(?://.*)?$", head, re.MULTILINE)
    wires = ", ".join(f".{port}({port})" for port in ports)
    body = f'`include "gs_params.vh"\n{head}\n    {module.name}_gates gates ({wires});\nendmodule\n'
    gates = (flow.map_module(module, library).folder / "netlist.v").read_text()
    gates = re.sub(rf"\bmodule {module.name}\b", f"module {module.name}_gates", gates)
    texts = {f"{module.name}.v": body, f"{module.name}_gates.v": gates}
    for name, text in texts.items():
        (folder / name).write_text(LINT_OFF + text)
    return [folder / name for name in texts]


def files(module: Module, library: Library) -> tuple[Path, ...]:
    """Verilog of a module and its parts: wrappers, gates, cells. A part may occur with one set of parameters only."""
    tree = netlist.mapped_tree(module, library)
    assert len({part.name for part in tree}) == len(tree), f"{module.label}: a part in two sizes"
    folder = flow.map_module(module, library).folder / "bench"
    folder.mkdir(exist_ok=True)
    found = [path for part in tree for path in wrapped(part, library, folder)]
    (folder / "cells.v").write_text(LINT_OFF + cells.verilog(library.cells))
    memory = [ROOT / "rtl" / "common" / "gs_ram.v"] if netlist.netlist(module, library).memories else []
    return (*found, folder / "cells.v", *memory)


def bench_of(module: str, library: Library) -> Bench:
    """The module's first build in tb/, of the sizes that `make synth` reports, with gates for RTL."""
    bench = next(one for one in builds.discover() if one.top == module)
    gates = files(Module(module, tuple(sorted(bench.parameters.items()))), library)
    return Bench(bench.top, bench.bench, bench.parameters, ("verilator",), bench.slow, gates, few=True)
