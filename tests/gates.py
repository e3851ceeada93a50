"""Gates in place of RTL: builds of a bench in which the module is its mapped netlist.

The netlist has no parameters, so it stands inside of a module with the RTL's header, and the bench sees no difference.
"""

from __future__ import annotations

import re
from pathlib import Path

from synth import cells, flow
from synth.flow import Library, Module
from tests import builds
from tests.builds import ROOT, Bench

WAIVED = ("DECLFILENAME", "UNUSEDSIGNAL", "UNUSEDPARAM", "LATCH")
LINT_OFF = "".join(f"/* verilator lint_off {rule} */\n" for rule in WAIVED)


def header(text: str) -> str:
    """A module's text up to the end of its ports; every output is a wire."""
    found = re.search(r"^module .*?^\);", text, re.MULTILINE | re.DOTALL)
    return re.sub(r"\boutput\s+reg\b", "output wire", found[0])


def files(module: Module, library: Library) -> tuple[Path, ...]:
    """Verilog of a module without parts: wrapper, gates, cells."""
    mapped = flow.map_module(module, library)
    (rtl,) = (path for path in builds.sources(module.name) if path.stem == module.name)
    head = header(rtl.read_text())
    ports = re.findall(r"^\s*(?:input|output)\s+wire\s*(?:\[.*\])?\s*(\w+)\s*,?\s*(?://.*)?$", head, re.MULTILINE)
    wires = ", ".join(f".{port}({port})" for port in ports)
    body = f'`include "gs_params.vh"\n{head}\n    {module.name}_gates gates ({wires});\nendmodule\n'
    folder = mapped.folder / "bench"
    folder.mkdir(exist_ok=True)
    gates = (mapped.folder / "netlist.v").read_text()
    gates = re.sub(rf"\bmodule {module.name}\b", f"module {module.name}_gates", gates)
    texts = {f"{module.name}.v": body, "gates.v": gates, "cells.v": cells.verilog(library.cells)}
    for name, text in texts.items():
        (folder / name).write_text(LINT_OFF + text)
    memory = (ROOT / "rtl" / "common" / "gs_ram.v",) if "gs_ram" in gates else ()
    return (*(folder / name for name in texts), *memory)


def benches(module: str, library: Library) -> list[Bench]:
    """The module's builds in tb/, with gates for RTL."""
    found = []
    for bench in builds.discover():
        if bench.top == module:
            sizes = tuple(sorted(bench.parameters.items()))
            gates = files(Module(module, sizes), library)
            found.append(Bench(bench.top, bench.bench, bench.parameters, ("verilator",), bench.slow, gates, few=True))
    return found
