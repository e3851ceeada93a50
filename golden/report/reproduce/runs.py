"""The runs behind the figures: each accelerator on each sequence of frames once, kept as JSON in DIR/runs.

A run's file is named after a hash of its case and of the sources that it depends on, so that an interrupted
reproduction goes on where it was and a changed model starts anew.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import os
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path

import numba

from golden import cameras, job
from golden.report.reproduce import similarity
from golden.report.reproduce.plan import LISTS, ROOT, Case, Plan, case_words, motion
from golden.report.stats import write_json

MEMORY = 4 << 30  # bytes that a QHD run takes, at most
OUTSIDE = ("golden/report", "golden/cosim")  # sources that change no result, but for similarity.py


def sources_hash() -> str:
    """Of every source that a run's numbers depend on."""
    text = hashlib.sha256()
    for path in sorted((ROOT / "golden").rglob("*.py")):
        name = path.relative_to(ROOT).as_posix()
        if not name.startswith(OUTSIDE) or path.name == "similarity.py":
            text.update(name.encode() + path.read_bytes())
    return text.hexdigest()


def measure(pictures: tuple, spec: str, cases: list[Case]) -> list[dict]:
    """The results of cases that share their frames, in order."""
    from golden.timing import simulate

    _, size, frames, settings, speed = pictures
    timed = [case for case in cases if case.hardware != LISTS]
    quality = "oracle" if any(case.quality for case in cases) else "none"
    found = {}
    if timed:
        configs = [(case.hardware, case.sorting, dict(case.keys)) for case in timed]
        results = simulate.compare(
            spec, size, configs=configs, **motion(frames, speed), speed=speed, quality=quality, settings=list(settings)
        )
        found.update(zip(timed, results))
    if len(timed) < len(cases):
        parser = argparse.ArgumentParser()
        job.add_common(parser)
        words = [spec, "--size", size, "--speed", str(speed)]
        words += [part for pair in settings for part in ("--set", pair)]
        words += [part for key, value in motion(frames, speed).items() for part in (f"--{key}", value)]
        lists = similarity.measure(job.prepare(parser.parse_args(words)))
        found.update((case, lists) for case in cases if case.hardware == LISTS)
    if any(result["frames"] < frames for result in found.values()):
        raise KeyboardInterrupt  # a sequence that was cut short
    return [found[case] for case in cases]


def _work(pictures: tuple, spec: str, cases: list[Case], files: list[Path]) -> float:
    """Measure and keep; returns the seconds it took."""
    begin = time.perf_counter()
    for case, file, result in zip(cases, files, measure(pictures, spec, cases)):
        write_json(file, {"case": case_words(case), "result": result})
    return time.perf_counter() - begin


class Runs:
    """What is kept of a plan in a folder."""

    def __init__(self, plan: Plan, folder: Path):
        self.plan = plan
        self.folder = folder / "runs"
        self.folder.mkdir(parents=True, exist_ok=True)
        self.sources = sources_hash()

    def file(self, case: Case) -> Path:
        words = {**case_words(case), "sources": self.sources, "spec": Path(self.plan.spec(case.scene)).name}
        return self.folder / f"{hashlib.sha256(json.dumps(words).encode()).hexdigest()[:20]}.json"

    def kept(self, case: Case) -> Path | None:
        """The case's file, or the same case's with its quality measured as well."""
        for candidate in (case, replace(case, quality=True)):
            if self.file(candidate).is_file():
                return self.file(candidate)
        return None

    def __getitem__(self, case: Case) -> dict:
        return json.loads(self.kept(case).read_text())["result"]

    def missing(self, cases: Iterable[Case]) -> list[tuple[tuple, list[Case]]]:
        """(pictures, cases that share them) of what is not kept yet, the longest first."""
        wanted = {case for case in cases if self.kept(case) is None}
        wanted -= {replace(case, quality=False) for case in wanted if case.quality}
        groups: dict[tuple, list[Case]] = {}
        for case in sorted(wanted, key=repr):
            groups.setdefault(case.pictures, []).append(case)
        return sorted(groups.items(), key=lambda item: -weight(*item))

    def fill(self, cases: Iterable[Case], jobs: int, on_step: Callable) -> Iterator[str]:
        """Measure what is missing on `jobs` processes (0: as many as cores and memory allow).

        Yields a line about each finished group; on_step(work done, all work) in between.
        """
        groups = self.missing(cases)
        total = sum(weight(*group) for group in groups)
        jobs = min(jobs or workers(), max(len(groups), 1))
        done, begin = 0, time.perf_counter()
        if groups:
            yield f"{len(groups)} runs on {jobs} processes"
        for number, (group, seconds) in enumerate(self._finished(groups, jobs), 1):
            done += weight(*group)
            on_step(done, total)
            left = (time.perf_counter() - begin) * (total - done) / done / 60
            scene, size, frames, settings, speed = group[0]
            more = "".join(f", {word}" for word in (*settings, *([f"motion x{speed:g}"] if speed != 1 else [])))
            words = f"{scene}, {size}{more}, {frames} frames, {len(group[1])} configurations"
            yield f"run {number} of {len(groups)}: {words}, {seconds:.0f} s; about {left:.0f} min left"

    def _finished(self, groups, jobs: int) -> Iterator:
        tasks = [(*group, [self.file(case) for case in group[1]]) for group in groups]
        if jobs == 1:
            for group, (pictures, cases, files) in zip(groups, tasks):
                yield group, _work(pictures, self.plan.spec(pictures[0]), cases, files)
            return
        spawn = multiprocessing.get_context("spawn")
        threads = max(1, (os.cpu_count() or 1) // jobs)
        with ProcessPoolExecutor(jobs, spawn, numba.set_num_threads, (threads,)) as pool:
            try:
                running = {}
                for group, (pictures, cases, files) in zip(groups, tasks):
                    running[pool.submit(_work, pictures, self.plan.spec(pictures[0]), cases, files)] = group
                for future in as_completed(running):
                    yield running[future], future.result()
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                for child in multiprocessing.active_children():
                    child.terminate()
                raise


def weight(pictures: tuple, cases: list[Case]) -> int:
    """Work of a group, in thousand pixels: pictures and the timing of each case cost about the same."""
    width, height = cameras.parse_size(pictures[1])
    strategies = 2 + 2 * any(case.quality for case in cases)
    return width * height * pictures[2] * (strategies + len(cases)) // 1000 + 1


def workers() -> int:
    """Processes that cores and memory have room for."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return max(1, min(os.cpu_count() or 1, memory // MEMORY))
