"""The runs behind the figures: each accelerator on each sequence of frames once, kept by golden.report.sweep."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from golden import cameras
from golden.report import sweep
from golden.report.reproduce.measure import measure
from golden.report.reproduce.plan import Case, Plan, case_words


class Runs(sweep.Kept):
    """What is kept of a plan in a folder."""

    def __init__(self, plan: Plan, folder: Path):
        super().__init__(folder, measure)
        self.plan = plan

    def of(self, case: Case) -> Path:
        return self.file({**case_words(case), "spec": Path(self.plan.spec(case.scene)).name})

    def kept(self, case: Case) -> Path | None:
        """The case's file, or the same case's with its quality measured as well."""
        for candidate in (case, replace(case, quality=True)):
            if self.of(candidate).is_file():
                return self.of(candidate)
        return None

    def __getitem__(self, case: Case) -> dict:
        return sweep.read(self.kept(case))

    def missing(self, cases: Iterable[Case]) -> list[tuple[tuple, list[Case]]]:
        """(pictures, cases that share them) of what is not kept yet, the longest first."""
        wanted = {case for case in cases if self.kept(case) is None}
        wanted -= {replace(case, quality=False) for case in wanted if case.quality}
        groups: dict[tuple, list[Case]] = {}
        for case in sorted(wanted, key=repr):
            groups.setdefault(case.pictures, []).append(case)
        return sorted(groups.items(), key=lambda item: -weight(*item))

    def task(self, pictures: tuple, cases: list[Case]) -> sweep.Task:
        """The task of one group."""
        scene, size, frames, settings, speed = pictures
        more = "".join(f", {word}" for word in (*settings, *([f"motion x{speed:g}"] if speed != 1 else [])))
        return sweep.Task(
            measure,
            (pictures, self.plan.spec(scene), cases),
            tuple((self.of(case), case_words(case)) for case in cases),
            weight(pictures, cases),
            f"{scene}, {size}{more}, {frames} frames, {len(cases)} configurations",
        )

    def fill(self, cases: Iterable[Case], args: argparse.Namespace, on_step: Callable) -> Iterator[str]:
        """Measure what is missing: sweep.run."""
        return sweep.run([self.task(*group) for group in self.missing(cases)], args, on_step)


def weight(pictures: tuple, cases: list[Case]) -> int:
    """Work of a group, in thousand pixels: pictures and the timing of each case cost about the same."""
    width, height = cameras.parse_size(pictures[1])
    strategies = 2 + 2 * any(case.quality for case in cases)
    return width * height * pictures[2] * (strategies + len(cases)) // 1000 + 1
