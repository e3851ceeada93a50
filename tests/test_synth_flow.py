"""How runs of Yosys are made: one for each module, side by side, and what they left behind is looked at."""

import time
from dataclasses import replace
from multiprocessing import get_context

import pytest

from golden.errors import InputError
from synth import __main__ as command
from synth import flow, units
from synth.flow import Library, Module


@pytest.fixture(scope="module")
def library() -> Library:
    return command.own_library()


def test_a_yosys_that_writes_nothing_is_found_out(library, monkeypatch):
    monkeypatch.setenv("YOSYS", "true")
    monkeypatch.setattr(flow, "BUILD", flow.BUILD / "nothing")
    with pytest.raises(RuntimeError, match=r"ended without netlist\.json"):
        flow.map_module(Module("gs_merge_sort_unit"), library)


def test_arrays_that_become_flip_flops_are_counted(tmp_path):
    (tmp_path / "netlist.json").write_text("{}")
    (tmp_path / "netlist.v").write_text("\n")
    cell = "cell $mem_v2 \\a\n  parameter \\SIZE {}\n  parameter \\WIDTH {}\n  parameter \\WR_PORTS {}\n"
    (tmp_path / "memories.txt").write_text(cell.format(64, 48, 1) + cell.format(16, 32, 0))
    assert flow.read_results(tmp_path)["memory_bits"] == 64 * 48


def test_two_processes_that_want_one_module_map_it_once(library, monkeypatch, tmp_path):
    def run(folder, text):
        with (tmp_path / "runs").open("a") as log:
            log.write("run\n")
        time.sleep(0.2)
        (folder / "netlist.json").write_text("{}")
        (folder / "netlist.v").write_text("\n")
        (folder / "memories.txt").write_text("")

    monkeypatch.setattr(flow, "BUILD", tmp_path)
    monkeypatch.setattr(flow, "run", run)
    plain = replace(library, plain=True, name="plain")
    both = [
        get_context("fork").Process(target=flow.map_module, args=(Module("gs_merge_sort_unit"), plain))
        for _ in range(2)
    ]
    for process in both:
        process.start()
    for process in both:
        process.join()
    assert [process.exitcode for process in both] == [0, 0]
    assert (tmp_path / "runs").read_text() == "run\n" * 2, "words, then cells, once each"


def test_jobs_run_together_come_back_in_order_and_an_error_ends_them():
    done = dict(command.together({n: (pow, 2, n) for n in range(5)}))
    assert list(done.items()) == [(n, 2**n) for n in range(5)]
    with pytest.raises(InputError, match="UNIT=gs_nothing"):
        dict(command.together({0: (units.named, "gs_nothing"), 1: (pow, 2, 1)}))
