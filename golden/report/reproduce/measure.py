"""The results of cases that share their frames: what a worker of a reproduction does."""

from __future__ import annotations

import argparse

from golden import job
from golden.report.reproduce import similarity
from golden.report.reproduce.plan import LISTS, Case, motion
from golden.timing import simulate


def measure(pictures: tuple, spec: str, cases: list[Case]) -> list[dict]:
    """One JSON value a case, in order."""
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
