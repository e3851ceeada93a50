"""Builds and runs the benches: every tb/**/test_*.py with TOP, and optionally PARAMETERS, SIMULATORS and SLOW.

python -m tests.builds tb.common.test_skid [--sim icarus] [--set WIDTH=8] [--test NAME] [--waves] [--setting small]
python -m tests.builds --setting small        # all of them
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import importlib
import os
import re
import shutil
import sys
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path

from cocotb_tools.check_results import get_results
from cocotb_tools.runner import Verilator, get_runner

from golden import formats, params, toolchain
from golden.errors import InputError

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build" / "tb"
SIMULATORS = ("verilator", "icarus")
BUILD_ARGS = {
    # unknown values are random, from the seed given at the start of the simulation
    "verilator": ["-Wall", "-O3", "--x-assign", "unique", "--x-initial", "unique"],
    "icarus": ["-g2005", "-Wall"],
}
# loops are of buses' bits, synth/timing.py finds real ones; the compiler takes long for long functions
NETLIST_ARGS = ["-Wno-UNOPTFLAT", "--output-split-cfuncs", "200"]
COVERAGE_ARGS = ["--coverage-line", "--coverage-toggle"]
RUNTIME = ("verilated.o", "verilated_dpi.o", "verilated_vpi.o", "verilated_threads.o")  # the same in every build


@dataclass(frozen=True)
class Bench:
    """One build: a bench, the module it drives, and that module's parameters."""

    top: str
    bench: str
    parameters: dict[str, int] = field(default_factory=dict)
    simulators: tuple[str, ...] = SIMULATORS
    slow: bool = False
    files: tuple[Path, ...] = ()  # instead of the sources of `top`: its gates
    setting: str = "reference"  # of the number formats, formats.PRESETS
    coverage: bool = False  # Verilator writes coverage.dat into the folder
    few: bool = False  # two pairs of stalls in place of all (tb/lib/stream.py)

    @property
    def label(self) -> str:
        """Readable name, also of the build folder."""
        text = ",".join(f"{k}={v}" for k, v in self.parameters.items()) or "default"
        text += ",gates" if self.files else ""
        short = text if len(text) <= 60 else text[:50] + "-" + hashlib.sha1(text.encode()).hexdigest()[:8]
        return re.sub(r"[^\w=,.-]", "_", short)

    def folder(self, simulator: str) -> Path:
        """Where it is built and run."""
        return BUILD / self.setting / ("coverage" if self.coverage else simulator) / self.bench / self.label


def modules() -> dict[str, Path]:
    """Module name -> file, for rtl/ and the wrappers in tb/. A file holds the module it is named after."""
    return {
        path.stem: path
        for folder in ("rtl", "tb")
        for path in sorted((ROOT / folder).rglob("*.v"))
        if path.parent != ROOT / "tb" / "formal"
    }


def sources(top: str) -> list[Path]:
    """Files that the module needs, itself included, found by the names of modules in them."""
    files = modules()
    if top not in files:
        raise InputError(f"no module {top} in rtl/ or tb/")
    found: dict[str, Path] = {}
    todo = [top]
    while todo:
        name = todo.pop()
        if name not in found:
            found[name] = files[name]
            text = re.sub(r"//[^\n]*", "", files[name].read_text())
            todo += sorted({word for word in re.findall(r"\b\w+\b", text) if word in files})
    return sorted(found.values())


def load(bench: str) -> list[Bench]:
    """The builds of one bench module."""
    module = importlib.import_module(bench)
    simulators = tuple(getattr(module, "SIMULATORS", SIMULATORS))
    slow = getattr(module, "SLOW", False)
    return [Bench(module.TOP, bench, dict(p), simulators, slow) for p in getattr(module, "PARAMETERS", [{}])]


def discover() -> list[Bench]:
    """All builds of all benches."""
    paths = sorted((ROOT / "tb").rglob("test_*.py"))
    return [one for path in paths for one in load(".".join(path.relative_to(ROOT).with_suffix("").parts))]


def includes(setting: str) -> list[Path]:
    """Folders of the include files: in front of rtl/ the one that holds the header of a setting that is not its own."""
    if setting == "reference":
        return [ROOT / "rtl"]
    folder = ROOT / "build" / "header" / setting
    header, text = folder / "gs_params.vh", params.verilog_header(formats.make(**formats.PRESETS[setting]))
    if not header.exists() or header.read_text() != text:
        folder.mkdir(parents=True, exist_ok=True)
        header.write_text(text)
    return [folder, ROOT / "rtl"]


def seed() -> int:
    """Of every random stimulus; the environment holds it for the benches."""
    return int(os.environ.setdefault("SEED", "1"))


def plusargs() -> list[str]:
    """Unknown values are random in Verilator, from the seed."""
    return [f"+verilator+seed+{seed()}", "+verilator+rand+reset+2"]


class Runtime:
    """Objects of Verilator's runtime, kept from the first build: compiling them takes most of a small one's time."""

    def __init__(self, coverage: bool = False) -> None:
        self.names = (*RUNTIME, "verilated_cov.o") if coverage else RUNTIME
        self.kept = BUILD / f"runtime-{version('verilator')}{'-coverage' if coverage else ''}"

    def args(self) -> list[str]:
        """What to add to a build; sets its environment."""
        os.environ.update(toolchain.environment())
        if not self.kept.exists():
            return []
        os.environ["MAKEFLAGS"] += " VM_GLOBAL_FAST= VM_GLOBAL_SLOW="
        return [str(self.kept / name) for name in self.names]

    def keep(self, folder: Path) -> None:
        """Copy the objects out of a finished build."""
        if not self.kept.exists():
            partial = self.kept.with_name(f"{self.kept.name}.{os.getpid()}")
            partial.mkdir(parents=True)
            for name in self.names:
                shutil.copyfile(folder / name, partial / name)
            with contextlib.suppress(OSError):  # another process was first
                partial.rename(self.kept)
            shutil.rmtree(partial, ignore_errors=True)


class Quiet(Verilator):
    """cocotb's runner; a bench sees what `visible` names instead of every signal, the rest is optimised."""

    def _build_command(self):
        return [[word for word in command if word != "--public-flat-rw"] for command in super()._build_command()]


def visible(top: str, folder: Path) -> Path:
    """Settings that show a bench the signals of the module that it drives."""
    path, text = folder / "visible.vlt", f'`verilator_config\npublic_flat_rw -module "{top}" -var "*"\n'
    if not path.exists():  # a file written again is a build again
        path.write_text(text)
    return path


def run(bench: Bench, simulator: str = "verilator", test: str | None = None, waves: bool = False, log: bool = True):
    """Build and simulate; raises AssertionError with the end of the log when a test fails or none ran."""
    os.environ.update(toolchain.environment())
    folder = bench.folder(simulator)
    folder.mkdir(parents=True, exist_ok=True)
    results = folder / "results.xml"
    results.unlink(missing_ok=True)
    log_file = folder / "log.txt" if log else None
    files = list(bench.files or sources(bench.top))
    runner = get_runner(simulator)
    if simulator == "verilator":
        runner, files = Quiet(), [visible(bench.top, folder), *files]
    failed = None
    try:
        build_args = [*BUILD_ARGS[simulator], *(COVERAGE_ARGS if bench.coverage else [])]
        if bench.files:
            build_args += NETLIST_ARGS
        runtime = Runtime(bench.coverage) if simulator == "verilator" and not waves else None
        if runtime:
            build_args += runtime.args()
        runner.build(
            sources=files,
            hdl_toplevel=bench.top,
            includes=includes(bench.setting),
            parameters=bench.parameters,
            build_args=build_args,
            build_dir=folder,
            waves=waves,
            always=simulator == "icarus",  # its runner does not see a changed include file
            log_file=folder / "build.txt" if log else None,
        )
        if runtime:
            runtime.keep(folder)
        runner.test(
            test_module=bench.bench,
            hdl_toplevel=bench.top,
            hdl_toplevel_lang="verilog",
            build_dir=folder,
            test_dir=folder,
            results_xml=str(results),
            testcase=test,
            seed=seed(),
            extra_env={formats.VARIABLE: bench.setting, "STALLS": "few" if bench.few else "all"},
            plusargs=plusargs() if simulator == "verilator" else [],
            waves=waves,
            log_file=log_file,
        )
    except (SystemExit, Exception) as error:
        failed = error
    count, failures = get_results(results) if results.exists() else (0, 0)
    if failed is not None or failures or not count:
        name = f"{bench.bench} {bench.label} {bench.setting} {simulator} SEED={seed()}"
        text = f"{name}: {failures} of {count} tests failed ({failed})"
        name = "log.txt" if results.exists() else "build.txt"
        if log and (folder / name).exists():
            lines = (folder / name).read_text().splitlines()
            wrong = [line.strip() for line in lines if re.search(r"Error|%Warning|FAIL ", line)]
            text += "\n".join(["", f"--- {name}", *wrong[:40], *([] if wrong else lines[-40:])])
        raise AssertionError(text)
    return count


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.builds", description="Run benches.")
    parser.add_argument("bench", nargs="?", help="its module, as in tb.common.test_skid; all of them without it")
    parser.add_argument("--setting", choices=formats.PRESETS, default="reference", help="number formats of the build")
    parser.add_argument("--few", action="store_true", help="two pairs of stalls in place of all")
    parser.add_argument("--sim", choices=SIMULATORS, default="verilator")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="replaces PARAMETERS")
    parser.add_argument("--test", help="run the tests whose name ends so")
    parser.add_argument("--waves", action="store_true", help="write a waveform into build/tb/")
    args = parser.parse_args()
    builds = load(args.bench) if args.bench else discover()
    if args.set:
        parameters = {name: int(value, 0) for name, value in (pair.split("=") for pair in args.set)}
        builds = [replace(builds[0], parameters=parameters)]
    failed = 0
    for one in builds:
        one = replace(one, setting=args.setting, few=args.few)
        try:
            count = run(one, args.sim, args.test, args.waves, log=not args.bench)
            print(f"{one.bench} {one.label} {one.setting}: {count} tests passed", flush=True)
        except (AssertionError, InputError) as error:
            print(error, file=sys.stderr, flush=True)
            failed += 1
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
