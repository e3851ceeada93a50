"""`make fpga`: the wrapper around a unit, and the results that are kept."""

import json
import subprocess

import pytest

from golden.errors import InputError
from synth import fpga

PORTS = {"clk": ("input", 1), "a": ("input", 3), "q": ("output", 2), "b": ("input", 5), "r": ("output", 4)}


def test_every_bit_of_every_port_has_its_own_flip_flop():
    text = fpga.wrapper("unit_of_test", PORTS)
    assert ".a(to_unit[0 +: 3])" in text and ".b(to_unit[3 +: 5])" in text
    assert ".q(from_unit[0 +: 2])" in text and ".r(from_unit[2 +: 4])" in text
    assert "reg  [7:0] to_unit;" in text and "reg  [5:0] signature;" in text
    assert ".clk(clk)" in text and text.count("clk(") == 1


def test_a_tool_that_writes_nothing_is_found_out(tmp_path, monkeypatch):
    done = subprocess.CompletedProcess([], 0, "", "")
    monkeypatch.setattr(fpga, "program", lambda: "nextpnr")
    monkeypatch.setattr(subprocess, "run", lambda *args, **options: done)
    with pytest.raises(RuntimeError, match="nextpnr failed"):
        fpga.place_and_route(tmp_path)


def test_a_missing_program_is_named(monkeypatch, tmp_path):
    monkeypatch.setattr("sys.executable", str(tmp_path / "python"))
    with pytest.raises(InputError, match="make setup"):
        fpga.program()


def test_an_unknown_unit_is_refused_in_one_line(capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["fpga", "gs_nothing"])
    assert fpga.main() == 2
    assert "UNIT=gs_nothing" in capsys.readouterr().err


def test_the_page_shows_the_results_that_are_kept():
    assert fpga.table(fpga.load()) in fpga.PAGE.read_text(), "run `python -m synth.fpga --page`"


@pytest.mark.parametrize("module", fpga.PARTS)
def test_results_fit_the_chip_and_count_the_wrapper(module):
    kept = fpga.load().get(module) or pytest.skip(f"no result yet: make fpga UNIT={module}")
    for resource in fpga.CELLS.values():
        assert 0 <= kept[resource] <= kept["available"][resource]
    assert kept["wrapper"]["flip_flops"] < kept["flip_flops"] and kept["wrapper"]["lut"] < kept["lut"]
    assert kept["clock_mhz"] > 10
    json.dumps(kept)


@pytest.mark.slow  # an honest failure between a change of RTL and the next `make fpga`
@pytest.mark.parametrize("module", fpga.PARTS)
def test_results_are_those_of_this_rtl(module):
    kept = fpga.load().get(module) or pytest.skip(f"no result yet: make fpga UNIT={module}")
    assert kept["made_from"] == fpga.digest(module), f"run `make fpga UNIT={module}`"
