"""All mutants of a unit in one netlist: register `mutsel` picks one, and 0 none.

Yosys elaborates the unit alone; its parts stay instances. `mutate` draws changes of single bits at ports of cells
(inverted, constant, or inverted where a neighbouring bit is 0 or 1), evenly over lines and wires, from a fixed seed.
"""

from __future__ import annotations

import json
import random
import re
from dataclasses import dataclass
from pathlib import Path

from golden.errors import InputError
from tests import builds, formal
from tests.builds import ROOT

SEED = 1
SELECT = "mutsel"
RESULTS = ROOT / "build" / "mutate"
# Not drawn: clocks (cut or turned around they are no fault of logic), and pins of a memory that must be constant.
LEFT_OUT = re.compile(r"-port \\?(CLK|clk|RD_CLK|WR_CLK|RD_EN|RD_ARST|RD_SRST) ")


@dataclass(frozen=True)
class Unit:
    """A module of rtl/ and the first build of its own bench."""

    module: str
    bench: builds.Bench

    @property
    def source(self) -> Path:
        return builds.modules()[self.module]

    @property
    def files(self) -> list[Path]:
        """What is compiled: the unit, its parts, and the wrapper that the bench drives, if any."""
        return builds.sources(self.bench.top)

    @property
    def parameters(self) -> dict[str, int]:
        """Parameters of the module; a bench that drives a wrapper sets none."""
        return self.bench.parameters if self.bench.top == self.module else {}

    @property
    def folder(self) -> Path:
        return RESULTS / self.module


@dataclass(frozen=True)
class Mutant:
    """One change: `mode` at bit `bit` of a port of a cell; `wire` and `line` (of the source) say where."""

    number: int
    mode: str
    cell: str
    port: str
    bit: int
    wire: str
    line: int
    command: str

    @property
    def name(self) -> str:
        """What and where, in words that outlive an edit of another line."""
        kind = re.sub(r"^\$(?:flatten\S*\\)?(\w+).*", r"\1", self.cell).lstrip("\\")
        return f"{self.mode} at {kind}.{self.port}[{self.bit}]" + (f", {self.wire}" if self.wire else "")


def units() -> dict[str, Unit]:
    """Every module of rtl/ with its bench (tb/x/test_y.py is that of gs_y)."""
    rtl = {name for name, path in builds.modules().items() if ROOT / "rtl" in path.parents}
    found: dict[str, Unit] = {}
    for bench in builds.discover():
        module = "gs_" + bench.bench.rpartition(".")[2].removeprefix("test_")
        if module in rtl:
            found.setdefault(module, Unit(module, bench))
    return found


def elaborate(unit: Unit) -> list[str]:
    """Yosys commands: the unit as cells, its parts as black boxes."""
    parts = [path for path in builds.sources(unit.module) if path != unit.source]
    read = [f"read_verilog -Irtl {unit.source.relative_to(ROOT)}"]
    read += [f"read_verilog -lib -Irtl {path.relative_to(ROOT)}" for path in parts]
    read += [f"chparam -set {name} {value} {unit.module}" for name, value in unit.parameters.items()]
    # narrowing removes the copies of sign bits and the zeros above, at which a change means nothing
    return [*read, f"hierarchy -check -top {unit.module}", "proc", "opt_expr", "opt_clean", "wreduce", "opt_clean"]


def parse(number: int, line: str) -> Mutant:
    """One line of `mutate -list`."""
    words = line.split()
    options = dict(zip(words[1::2], words[2::2], strict=True))  # of two -src the last: the cell's, not the wire's
    wire = options.get("-wire", "")
    place = options.get("-src", "").rpartition(":")[2]
    return Mutant(
        number=number,
        mode=options["-mode"],
        cell=options["-cell"],
        port=options["-port"].lstrip("\\"),
        bit=int(options["-portbit"]),
        wire=wire.lstrip("\\") + (f"[{options['-wirebit']}]" if wire else ""),
        line=int(place.partition(".")[0] or 0),
        command=line,
    )


def draw(unit: Unit, count: int) -> list[Mutant]:
    """The unit's mutants (fewer where it has fewer), and its netlist without them: unit.il, unit.json."""
    place = unit.folder.relative_to(ROOT)
    drawn = unit.folder / "list.txt"
    drawn.unlink(missing_ok=True)
    written = [f"write_rtlil {place}/unit.il", f"write_json {place}/unit.json"]
    draw = f"mutate -list {count + count // 2} -seed {SEED} -o {place}/list.txt"
    done = formal.yosys(unit.folder, [*elaborate(unit), "memory_collect", *written, draw])
    if done.returncode or not drawn.exists():
        raise InputError(f"Yosys draws no mutants, see {place}/log.txt\n{done.stderr}")
    lines = [line.strip() for line in drawn.read_text().splitlines() if not LEFT_OUT.search(line)]
    chosen = sorted(random.Random(SEED).sample(range(len(lines)), min(count, len(lines))))
    return [parse(number + 1, lines[at]) for number, at in enumerate(chosen)]


def write(unit: Unit, count: int) -> list[Mutant]:
    """Write the netlist of the unit with its mutants to its folder."""
    unit.folder.mkdir(parents=True, exist_ok=True)
    place = unit.folder.relative_to(ROOT)
    mutants = draw(unit, count)
    written = unit.folder / "netlist.v"
    written.unlink(missing_ok=True)
    width = len(mutants).bit_length()
    script = [f"read_rtlil {place}/unit.il"]
    script += [one.command.replace("mutate", f"mutate -ctrl {SELECT} {width} {one.number}", 1) for one in mutants]
    done = formal.yosys(
        unit.folder, [*script, f"write_json {place}/netlist.json", f"write_verilog -noattr {place}/netlist.v"]
    )
    if done.returncode or not written.exists():
        raise InputError(f"Yosys writes no netlist, see {place}/log.txt\n{done.stderr}")
    (unit.folder / f"{unit.module}.v").write_text(with_selector(unit, written.read_text()))
    return mutants


def with_selector(unit: Unit, text: str) -> str:
    """The netlist with the unit's parameters (already applied, read by the bench) and the selector as a register."""
    source = re.sub(r"//[^\n]*", "", unit.source.read_text())
    header = re.search(rf"module\s+{unit.module}\s*(#\(.*?\n\))?\s*\(", source, re.DOTALL)
    parameters = header[1] or ""
    text, n = re.subn(rf"^module {unit.module}\(", f"module {unit.module} {parameters} (", text, flags=re.MULTILINE)
    assert n == 1
    text, n = re.subn(rf", {SELECT}\);", ");", text)
    assert n == 1
    text, n = re.subn(
        rf"^  input (\[\d+:0\]) {SELECT};\n  wire \[\d+:0\] {SELECT};",
        rf"  reg \1 {SELECT} = 0;",
        text,
        flags=re.MULTILINE,
    )
    assert n == 1
    return '`include "gs_params.vh"\n' + text


def visible(unit: Unit) -> str:
    """Verilator settings: ports, parameters and what else the bench names can be seen, the rest is optimised."""
    netlist = json.loads((unit.folder / "netlist.json").read_text())["modules"][unit.module]
    bench = (ROOT / (unit.bench.bench.replace(".", "/") + ".py")).read_text()
    names = set(netlist["ports"]) | {SELECT} | set(netlist.get("parameter_default_values", {}))
    names |= set(re.findall(r"\bdut\.(\w+)", bench)) & set(netlist["netnames"])
    lines = [f'public_flat_rw -module "{unit.module}" -var "{name}"' for name in sorted(names)]
    if unit.bench.top != unit.module:
        lines.append(f'public_flat_rw -module "{unit.bench.top}" -var "*"')
    return "\n".join(["`verilator_config", *lines, ""])
