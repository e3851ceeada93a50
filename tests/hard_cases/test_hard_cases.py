"""Every hard case by name, at the reference setting: `test_hard_case[P01]`; and the command that prints them."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path

import pytest

from golden import cli
from golden.errors import InputError
from golden.hard_cases.case import Case, Check, cases
from golden.hard_cases.command import judge, status
from golden.settings import Settings

CASES = cases()
WORKING = [name for name, one in CASES.items() if one.work]
PAGE = Path(__file__).parent.parent.parent / "docs" / "hard_cases.md"


def failed(found: list[Check]) -> list[str]:
    return [f"{check.what}: {check.figure}, bound {check.bound}" for check in found if check.ok is False]


@pytest.mark.parametrize("name", WORKING)
def test_hard_case(name):
    found = judge(CASES[name], Settings())
    assert any(check.ok for check in found)
    assert not failed(found)


@pytest.mark.slow  # builds the RTL model: a minute where it is not there yet
@pytest.mark.parametrize("name", WORKING)
def test_hard_case_in_rtl(name):
    found = judge(CASES[name], Settings(), rtl=True)
    assert not failed(found)
    by_rtl = [check for check in found if check.what.startswith("RTL against golden")]
    assert by_rtl or CASES[name].benches, "neither a frame nor a bench holds it in RTL"


def test_every_case_of_the_document_is_there():
    counts = {"P": 14, "I": 8, "S": 12, "B": 4, "M": 6, "T": 8, "O": 6, "R": 6, "N": 3}
    for letter, count in counts.items():
        assert [name for name in CASES if name[0] == letter] == [f"{letter}{k:02}" for k in range(1, count + 1)]
    later = [one for one in CASES.values() if one.work is None]
    assert all("does not exist yet" in one.title for one in later)
    assert status(later[0], judge(later[0], Settings())) == "later"


def test_the_page_names_every_case():
    page = PAGE.read_text()
    assert [name for name, one in CASES.items() if f"| {name} | {one.title} |" not in page] == []


def test_benches_exist():
    for one in CASES.values():
        for bench in one.benches:
            module, test = bench.split(": ")
            assert hasattr(import_module(f"tb.{module.replace('/', '.')}"), f"test_{test}"), bench


def test_the_command_prints_figures_and_writes_them(tmp_path, capsys):
    file = tmp_path / "cases.json"
    assert cli.run(["hard-cases", "P02", "D-b03", "O01", "--json", str(file)]) == 0
    out = capsys.readouterr().out
    assert "Near plane" in out and "culled_near" in out and "2 cases pass, 0 fail, 1 wait for their unit" in out
    assert "tests" not in out.split("test_bitonic_sort_unit")[0]
    records = json.loads(file.read_text())["cases"]
    assert [(record["case"], record["status"]) for record in records] == [
        ("P02", "pass"),
        ("B03", "pass"),
        ("O01", "later"),
    ]
    assert {"what": "culled_near", "figure": 2, "bound": "= 2", "ok": True} in records[0]["checks"]


def test_a_case_that_fails_gives_status_1(monkeypatch, capsys):
    broken = Case("P02", "broken", lambda run: run.at_most("a figure", float("nan"), 1))
    monkeypatch.setattr("golden.hard_cases.command.cases", lambda: {"P02": broken})
    assert cli.run(["hard-cases"]) == 1
    assert "FAIL" in capsys.readouterr().out


def test_an_interrupt_shows_what_is_done(monkeypatch, capsys):
    def interrupt(run):
        raise KeyboardInterrupt

    known = {"P01": Case("P01", "done", lambda run: run.equal("x", 1, 1)), "P02": Case("P02", "cut", interrupt)}
    monkeypatch.setattr("golden.hard_cases.command.cases", lambda: known)
    assert cli.run(["hard-cases"]) == 130
    assert "1 cases pass" in capsys.readouterr().out


def test_what_the_command_refuses():
    with pytest.raises(InputError, match="hard-cases Q7: no such case; known are P01"):
        cli.run(["hard-cases", "Q7"])
    with pytest.raises(InputError, match="--set capacity=1"):
        cli.run(["hard-cases", "P01", "--set", "capacity=1"])
    with pytest.raises(InputError, match="--json"):
        cli.run(["hard-cases", "P01", "--json", "/nowhere/at/all.json"])
