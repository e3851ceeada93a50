"""One unit: netlist, one Verilator model, one process that runs its bench on every mutant."""

from __future__ import annotations

import hashlib
import json
import shutil
import time
from pathlib import Path

from cocotb_tools.check_results import get_results

from golden import compiled
from tests import builds
from tests.builds import ROOT
from tests.mutation import equivalent, netlist
from tests.mutation.netlist import Unit
from tests.mutation.server import ALIVE

EQUIVALENT = "equivalent"


def stamp(unit: Unit, count: int) -> str:
    """Changes with everything that a result depends on."""
    text = hashlib.sha256(f"{unit.module} {unit.bench} {count} {netlist.SEED} {builds.seed()}".encode())
    bench = ROOT / (unit.bench.bench.replace(".", "/") + ".py")
    helpers = [path for place in (bench.parent, ROOT / "tb/lib") for path in place.glob("*.py")]
    files = {*unit.files, ROOT / "rtl" / "gs_params.vh"}
    for path in (bench, *(path for path in helpers if not path.stem.startswith("test_"))):
        files |= compiled.sources(path)
    files |= {Path(__file__).with_name(f"{name}.py") for name in ("netlist", "server", "unit", "equivalent")}
    for path in sorted(files):
        text.update(path.read_bytes())
    return text.hexdigest()[:16]


def build(unit: Unit) -> None:
    """Verilator model of the netlist with its parts and, where the bench drives one, its wrapper."""
    others = [path for path in unit.files if path != unit.source]
    settings = unit.folder / "visible.vlt"
    settings.write_text(netlist.visible(unit))
    runtime = builds.Runtime()
    args = ["-O3", "-Wno-lint", "-Wno-style", "-Wno-UNOPTFLAT", "--x-assign", "unique", "--x-initial", "unique"]
    builds.Quiet().build(
        sources=[settings, unit.folder / f"{unit.module}.v", *others],
        hdl_toplevel=unit.bench.top,
        includes=[ROOT / "rtl"],
        parameters=unit.bench.parameters,
        build_args=[*args, *runtime.args()],
        build_dir=unit.folder / "model",
        log_file=unit.folder / "build.txt",
    )
    runtime.keep(unit.folder / "model")


def simulate(unit: Unit, mutants: int) -> dict:
    """The report of tests/mutation/server.py."""
    report, results = unit.folder / "report.json", unit.folder / "results.xml"
    report.unlink(missing_ok=True)
    builds.Quiet().test(
        test_module=[unit.bench.bench, "tests.mutation.server"],
        hdl_toplevel=unit.bench.top,
        hdl_toplevel_lang="verilog",
        build_dir=unit.folder / "model",
        test_dir=unit.folder,
        results_xml=str(results),
        seed=builds.seed(),
        plusargs=builds.plusargs(),
        extra_env={
            "MUTATION_BENCH": unit.bench.bench,
            "MUTATION_COUNT": str(mutants),
            "MUTATION_REPORT": str(report),
            "NUMBA_NUM_THREADS": "1",  # threads do not survive a fork,
            "NUMBA_THREADING_LAYER": "workqueue",  # and the other layers refuse to run behind one
        },
        log_file=unit.folder / "log.txt",
    )
    tests, failures = get_results(results)
    if failures or not report.exists():
        log = (unit.folder / "log.txt").relative_to(ROOT)
        raise AssertionError(f"{failures} of {tests} tests fail without a mutation, see {log}")
    return json.loads(report.read_text())


def kept(unit: Unit) -> Path:
    """File of the unit's result."""
    return unit.folder.with_suffix(".json")


def result(unit: Unit, count: int) -> dict:
    """Run the unit unless its result is there."""
    now = stamp(unit, count)
    if not kept(unit).exists() or json.loads(kept(unit).read_text())["stamp"] != now:
        kept(unit).write_text(json.dumps(run(unit, count) | {"stamp": now}, indent=1) + "\n")
    return json.loads(kept(unit).read_text())


def run(unit: Unit, count: int) -> dict:
    """What became of each mutant of the unit."""
    start = time.monotonic()
    shutil.rmtree(unit.folder, ignore_errors=True)
    mutants = netlist.write(unit, count)
    build(unit)
    report = simulate(unit, len(mutants))
    lines = unit.source.read_text().splitlines()
    found = []
    for mutant, (status, test) in zip(mutants, report.pop("mutants"), strict=True):
        one = {"name": mutant.name, "line": mutant.line, "text": lines[mutant.line - 1].strip(), "status": status}
        if status == ALIVE and (proof := equivalent.prove(unit, mutant)):
            one |= {"status": EQUIVALENT, "proof": proof}
        found.append(one | ({"test": test} if test else {}))
    seconds = round(time.monotonic() - start)
    return {"unit": unit.module, "parameters": unit.bench.label, "seconds": seconds, "mutants": found, **report}
