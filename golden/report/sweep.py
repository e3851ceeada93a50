"""Lists of independent tasks: on this process, on local ones, or on a Dask cluster; results are kept as JSON.

A result's file is named after a hash of its case and of the sources that it depends on, so that an interrupted sweep
goes on where it was and a changed model starts anew. Results travel back and are written on this side: workers need
the project and the scenes, but no shared folder. A task whose process is lost runs again (Dask, up to three times).
"""

from __future__ import annotations

import argparse
import hashlib
import inspect
import json
import os
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numba

from golden import compiled
from golden.errors import InputError
from golden.report.stats import write_json

MEMORY = 4 << 30  # bytes that a QHD run takes, at most
ANSWER = 10  # seconds within which a scheduler has to answer, and
WORKERS = 60  # within which its first worker has to be there
_ONE = threading.Lock()  # a worker with several threads works on one task at a time: numba's kernels use them all


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where a sweep runs. --jobs is the command's own."""
    parser.add_argument("--scheduler", metavar="tcp://HOST:PORT", help="a Dask cluster instead of local processes")


@dataclass(frozen=True)
class Task:
    """What one process works on at a time: cases that share something."""

    work: Callable[..., list]  # of a module: (*arguments) -> one JSON value for each record
    arguments: tuple
    records: tuple[tuple[Path, dict], ...]  # where each result is kept, and the case written beside it
    weight: int
    words: str


class Kept:
    """Results in a folder."""

    def __init__(self, folder: Path, work: Callable):
        self.folder = folder / "runs"
        self.folder.mkdir(parents=True, exist_ok=True)
        self.sources = sources(work)

    def file(self, words: dict) -> Path:
        """Of the case that `words` describe."""
        text = json.dumps({**words, "sources": self.sources}, sort_keys=True)
        return self.folder / f"{hashlib.sha256(text.encode()).hexdigest()[:20]}.json"


def read(file: Path) -> dict:
    """A result that is kept."""
    return json.loads(file.read_text())["result"]


def sources(work: Callable) -> str:
    """Hash of every source that a function's results depend on."""
    return compiled.stamp(Path(inspect.getfile(work)).resolve())


def workers() -> int:
    """Processes that cores and memory have room for."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return max(1, min(os.cpu_count() or 1, memory // MEMORY))


def run(tasks: list[Task], args: argparse.Namespace, on_step: Callable[[int, int], None]) -> Iterator[str]:
    """Work through the tasks as --jobs (0: as many processes as fit) and --scheduler say.

    Yields a line about each finished one, whose results are then kept; on_step(work done, all work) in between.
    """
    if not tasks:
        return
    total = sum(task.weight for task in tasks)
    jobs = min(args.jobs or workers(), len(tasks))
    done, begin = 0, time.perf_counter()
    yield f"{len(tasks)} runs on {args.scheduler or f'{jobs} processes'}"
    for number, (task, seconds) in enumerate(_finished(tasks, jobs, args.scheduler), 1):
        done += task.weight
        on_step(done, total)
        left = (time.perf_counter() - begin) * (total - done) / done / 60
        yield f"run {number} of {len(tasks)}: {task.words}, {seconds:.0f} s; about {left:.0f} min left"


def _keep(task: Task, results: list) -> None:
    for (file, case), result in zip(task.records, results, strict=True):
        write_json(file, {"case": case, "result": result})


def _timed(work: Callable, arguments: tuple, wanted: str, threads: int) -> tuple[list, float]:
    """(results, seconds) of a task on a worker; threads of numba, 0: as the worker was started."""
    if sources(work) != wanted:
        raise InputError("--scheduler: a worker has other sources of splatcore; wants the same on each machine")
    with _ONE:
        begin = time.perf_counter()
        if threads:
            numba.set_num_threads(threads)
        return work(*arguments), time.perf_counter() - begin


def _finished(tasks: list[Task], jobs: int, scheduler: str | None) -> Iterator[tuple[Task, float]]:
    if jobs == 1 and scheduler is None:
        for task in tasks:
            begin = time.perf_counter()
            _keep(task, task.work(*task.arguments))
            yield task, time.perf_counter() - begin
        return
    from concurrent.futures import CancelledError

    from distributed import KilledWorker, as_completed

    threads = 0 if scheduler else max(1, (os.cpu_count() or 1) // jobs)
    with _client(jobs, scheduler) as client:
        running = {
            client.submit(_timed, t.work, t.arguments, sources(t.work), threads, pure=False): t for t in tasks
        }  # fmt: skip
        for future in as_completed(running):
            task = running[future]
            try:
                results, seconds = future.result()
            except KilledWorker:
                raise InputError(f"{task.words}: its process was lost again and again; wants more memory?") from None
            except CancelledError:
                raise InputError("the scheduler is gone; what is finished is kept: run it again") from None
            _keep(task, results)
            yield task, seconds


@contextmanager
def _client(jobs: int, scheduler: str | None) -> Iterator:
    """A Dask client: of the cluster at an address, or of one made of local processes."""
    import logging

    import dask
    from distributed import Client, LocalCluster

    quiet = {f"distributed.{part}": "critical" for part in ("client", "worker", "nanny", "scheduler", "core", "comm")}
    with dask.config.set({"distributed.scheduler.worker-ttl": None, "logging": quiet}):
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        if scheduler:
            try:
                client = Client(scheduler, timeout=ANSWER)
                client.wait_for_workers(1, timeout=WORKERS)
            except (OSError, ValueError, TimeoutError):
                raise InputError(
                    f"--scheduler {scheduler}: no scheduler with workers answers; wants the tcp://HOST:PORT of one"
                ) from None
            with client:
                yield client
            return
        with (
            tempfile.TemporaryDirectory() as folder,
            LocalCluster(
                n_workers=jobs, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0", memory_limit=0,
                local_directory=folder, silence_logs=logging.CRITICAL,
            ) as cluster,
            Client(cluster) as client,
        ):  # fmt: skip
            yield client
