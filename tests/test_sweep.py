"""Lists of tasks: the same results wherever they run, lost workers, interruptions."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

import pytest
from distributed import LocalCluster

from golden.errors import InputError
from golden.report import sweep
from tests import sweep_tools


def tasks(folder: Path, work, count: int = 4, arguments: tuple = ()) -> list[sweep.Task]:
    """`count` tasks of two values each."""
    kept = sweep.Kept(folder, work)
    return [
        sweep.Task(
            work,
            (*arguments, [k, k + 1]),
            tuple((kept.file({"task": k, "value": v}), {"value": v}) for v in (k, k + 1)),
            1,
            f"task {k}",
        )
        for k in range(count)
    ]


def run(todo: list[sweep.Task], jobs: int = 1, scheduler: str | None = None) -> list[str]:
    args = argparse.Namespace(jobs=jobs, scheduler=scheduler)
    return list(sweep.run(todo, args, lambda done, total: None))


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in (folder / "runs").iterdir()}


@pytest.fixture(scope="module")
def cluster():
    """A Dask cluster of two processes, as `dask scheduler` and two times `dask worker` make one."""
    with LocalCluster(n_workers=2, threads_per_worker=2, dashboard_address="127.0.0.1:0", memory_limit=0) as made:
        yield made.scheduler_address


def test_the_same_bits_here_on_two_processes_and_on_a_cluster(tmp_path, cluster):
    places = {"here": (1, None), "processes": (2, None), "cluster": (0, cluster)}
    for name, place in places.items():
        lines = run(tasks(tmp_path / name, sweep_tools.halves), *place)
        assert len(lines) == 5 and "run 4 of 4: task" in lines[-1]
    here, processes, cluster_ = (contents(tmp_path / name) for name in places)
    assert here == processes == cluster_ and len(here) == 8
    first = tasks(tmp_path / "here", sweep_tools.halves)[0]
    assert [sweep.read(file) for file, _ in first.records] == [0, 1 / 3]


@pytest.mark.parametrize("place", ["processes", "cluster"])
def test_the_work_of_a_lost_process_is_done_again(tmp_path, cluster, place):
    todo = tasks(tmp_path, sweep_tools.die_once, 3, (str(tmp_path),))
    run(todo, 2, cluster if place == "cluster" else None)
    assert (tmp_path / "mark").read_text() != str(os.getpid())
    assert [[sweep.read(file) for file, _ in task.records] for task in todo] == [[0, 1], [1, 4], [4, 9]]


def test_a_task_that_loses_every_process_is_an_error(tmp_path):
    with pytest.raises(InputError, match="task 0: its process was lost"):
        run([*tasks(tmp_path, sweep_tools.die, 1), *tasks(tmp_path, sweep_tools.die, 1)], 2)


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_of_a_task_is_that_of_the_sweep(tmp_path, jobs):
    with pytest.raises(InputError, match=r"values \[0, 1\]: wants others"):
        run(tasks(tmp_path, sweep_tools.refuse, 1) * 2, jobs)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "no address"])
def test_no_scheduler_is_said_in_one_line(tmp_path, monkeypatch, address):
    monkeypatch.setattr(sweep, "ANSWER", 1)
    with pytest.raises(InputError, match=f"--scheduler {address}: no scheduler.*wants the tcp://HOST:PORT"):
        run(tasks(tmp_path, sweep_tools.squares), scheduler=address)


def test_a_worker_with_other_sources_is_refused():
    with pytest.raises(InputError, match="other sources"):
        sweep._timed(sweep_tools.squares, ([1],), "an older stamp", 1)


def test_results_are_kept_by_case_and_sources(tmp_path, monkeypatch):
    kept = sweep.Kept(tmp_path, sweep_tools.squares)
    case = {"knob": "key_bits", "value": 16}
    assert kept.file(case) == sweep.Kept(tmp_path, sweep_tools.squares).file(dict(reversed(case.items())))
    assert kept.file(case) != kept.file({**case, "value": 17})
    monkeypatch.setattr(sweep.compiled, "stamp", lambda path: "other")
    assert kept.file(case) != sweep.Kept(tmp_path, sweep_tools.squares).file(case)
