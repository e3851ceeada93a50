"""One setting of the golden model on some accelerators: what a worker of the accuracy study does."""

from __future__ import annotations

import argparse
import hashlib
import json
from dataclasses import dataclass, fields, replace
from functools import lru_cache

import numpy as np

from golden import oracle, params, settings
from golden.errors import InputError
from golden.frame import Frame, Renderer
from golden.job import Job, prepare
from golden.records import indices_of
from golden.timing import hardware, simulate
from golden.timing.memory import STAGES

Config = tuple[str, tuple[str, ...], str | None]  # accelerator, its KEY=VALUE, sorting


@dataclass(frozen=True)
class Study(Job):
    """A job whose truth is that of the reference setting, whatever its own settings are."""

    truths: tuple[np.ndarray, ...] = ()  # float64 [H, W, 3], one a frame
    inputs: str = ""  # sha256 of Gaussians and cameras

    def truth(self, index: int) -> np.ndarray:
        return self.truths[index]


def inputs_hash(job: Job) -> str:
    """sha256 of what is drawn and from where: every array of the scene and of the cameras."""
    text = hashlib.sha256()
    for part in (job.gaussians, *job.cameras):
        for spec in fields(part):
            value = getattr(part, spec.name)
            if isinstance(value, np.ndarray):
                text.update(np.ascontiguousarray(value).tobytes())
            elif isinstance(value, int | float):
                text.update(repr(value).encode())
    return text.hexdigest()


@lru_cache(1)
def study(common: str) -> Study:
    """The job of the command line's common options (JSON), with the truth of each frame."""
    job = prepare(argparse.Namespace(**json.loads(common)))
    truths = tuple(job.truth(index) for index in range(len(job.cameras)))
    own = {spec.name: getattr(job, spec.name) for spec in fields(Job)}
    return Study(**own, truths=truths, inputs=inputs_hash(job))


def _lsb(difference: np.ndarray) -> dict:
    """Of a difference of pictures: largest and root mean square in LSB, percent of the pixels above 1 LSB."""
    lsb = 255 * np.abs(difference)
    return {
        "max_lsb": float(lsb.max(initial=0)),
        "rms_lsb": float(np.sqrt(np.mean(np.square(lsb)))),
        "percent_above_1_lsb": 100 * float(np.mean(lsb.max(axis=2) > 1)),
    }


def parts(frame: Frame, truth: np.ndarray, background: tuple) -> dict:
    """Where the error of a picture comes from, each as `_lsb`.

    order: exact arithmetic on the frame's lists, order and colours, against the truth. decisions: the picture against
    that. arithmetic: the picture against exact arithmetic that is given the golden model's decisions as well.
    """
    size = frame.camera.width, frame.camera.height
    tables = frame.order.offsets, indices_of(frame.order.words), params.TILE
    exact = oracle.render(frame.projection, frame.camera, background, tables=tables)
    given = oracle.render_injected(frame.formats, frame.features, frame.projection, tables, *size, background)
    image = frame.image.astype(np.float64)
    return {"order": _lsb(exact - truth), "decisions": _lsb(image - exact), "arithmetic": _lsb(image - given)}


class Judge:
    """Looks at the pictures of each accelerator, frame after frame; those that are one picture are judged once."""

    def __init__(self, job: Study, count: int):
        self.job = job
        self.errors: list[np.ndarray | None] = [None] * count
        self.changes: list[list[dict | None]] = [[] for _ in range(count)]  # of the error, from frame to frame
        self.parts: list[dict] = [{}] * count  # of the last frame

    def __call__(self, index: int, frames: list[Frame]) -> None:
        truth = self.job.truth(index)
        seen: dict[int, tuple] = {}
        for k, frame in enumerate(frames):
            if id(frame) not in seen:
                error = frame.image - truth
                change = None if self.errors[k] is None else _lsb(error - self.errors[k])
                last = index == len(self.job.cameras) - 1
                found = parts(frame, truth, self.job.settings.background_colour()) if last else {}
                seen[id(frame)] = error, change, found
            self.errors[k], change, self.parts[k] = seen[id(frame)]
            self.changes[k].append(change)


def _frame(record: dict, change: dict | None, pixels: int) -> dict:
    """What is kept of a frame of simulate's JSON. Milliseconds, MB, LSB, dB (None: no value differs)."""
    return {
        "ms": record["cycles"] / simulate.CLOCK * 1e3,
        "psnr_db": record["psnr_db"],
        "max_lsb": record["max_lsb"],
        "share_above_1_lsb": record["flips"] / pixels,
        "change": change,
        "mb": {stage: sum(record["dram_bytes"][stage].values()) / 1e6 for stage in STAGES},
        "entries": record["entries"],
        "incoming": record["incoming"],
        "sha256": record["sha256"],
    }


def _machines(configs: list[Config]) -> list[tuple]:
    found = []
    for name, pairs, sorting in configs:
        machine = hardware.configure(name, list(pairs))
        found.append((machine, simulate.strategy(machine, sorting)))
    return found


def last_error(common: str, row: dict) -> np.ndarray:
    """[H, W] LSB of a row of the table: the last frame's distance from the truth, largest channel."""
    base = study(common)
    sets, pairs = simulate.split_settings(row["set"].split())
    job = replace(base, settings=settings.parse(sets))
    machine, sorting = _machines([(row["hardware"], tuple(pairs), row["sorting"] or None)])[0]
    renderer = Renderer(job.gaussians, job.settings, sorting, simulate.is_late(machine, sorting))
    for camera in job.cameras:
        image = renderer.frame(camera).image
    return 255 * np.abs(image - base.truths[-1]).max(axis=2)


def measure(common: str, inputs: str, sets: tuple[str, ...], configs: list[Config]) -> list[dict]:
    """One JSON value a config, all with the golden model's settings `sets` behind those of the common options."""
    base = study(common)
    if base.inputs != inputs:
        raise InputError("--scheduler: a worker has another scene or path of that name; wants the same files")
    job = replace(base, settings=settings.parse([*json.loads(common)["set"], *sets]))
    judge = Judge(job, len(configs))
    results = simulate.compare_job(job, _machines(configs), "oracle", on_pictures=judge)
    pixels = job.cameras[0].width * job.cameras[0].height
    if any(result["frames"] < len(job.cameras) for result in results):
        raise KeyboardInterrupt  # a sequence that was cut short
    return [
        {
            **{key: result[key] for key in ("fps", "p50_ms", "p99_ms", "first_ms")},
            "entry_bytes": result["set"]["entry_bytes"],
            "record_bytes": result["set"]["record_stride"],
            "parts": judge.parts[k],
            "frames": [_frame(*pair, pixels) for pair in zip(result["per_frame"], judge.changes[k], strict=True)],
        }
        for k, result in enumerate(results)
    ]
