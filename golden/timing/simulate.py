"""Frames of a scene on accelerators: pictures by the golden model, cycles and bytes by the timing model, as JSON.

Accelerators that need the same pictures share them. A frame's time is the time from one picture to the next: a later
frame's preprocessing that runs beside it (preprocess_ahead) is part of it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import asdict, replace

import numpy as np

from golden import keys, metrics, params
from golden.errors import InputError
from golden.formats import REFERENCE
from golden.frame import Frame, Renderer
from golden.records import SHORT_BYTES
from golden.report.stats import Output, frame_record
from golden.settings import Settings
from golden.timing import gpu, hardware, memory, raster_state, tiles16
from golden.timing.accelerator import Accelerator
from golden.timing.address_map import LINE, record_bytes
from golden.timing.hardware import Hardware

CLOCK = 1e9  # core cycles a second


def strategy(machine: Hardware, sorting: str | None) -> str:
    """The sorting strategy that a hardware runs; InputError where it cannot run the one asked for."""
    if machine.scratch:
        if sorting not in (None, "full"):
            raise InputError(f"--sorting {sorting}: {machine.name} sorts from scratch in every frame; wants full")
        return "full"
    return sorting or "reuse"


def check(machine: Hardware, settings: Settings) -> None:
    """InputError where a hardware cannot do what a setting of the golden model asks for."""
    record = record_bytes(settings.formats(), settings.depth == "predicted")
    entry = SHORT_BYTES if machine.late_sort else settings.formats().entry_bytes
    late = machine.late_sort and machine.raster == "groups"
    rules = (
        (f"refresh={settings.refresh}", settings.refresh != "all" and machine.tile != params.TILE, "tile=64"),
        (f"entry_bytes={machine.entry_bytes}", machine.entry_bytes < entry, f"{entry} or more"),
        (
            f"record_stride={machine.record_stride}",
            record > machine.record_stride,
            f"{record} or more with depth={settings.depth}",
        ),
        (f"chunk={settings.chunk}", late and settings.chunk != params.CHUNK, "raster=candidates where the core sorts"),
    )
    for what, broken, wanted in rules:
        if broken:
            raise InputError(f"--set {what}: wants {wanted}")


def fitted(name: str, pairs: list[str], settings: Settings) -> list[str]:
    """KEY=VALUE of a hardware, and with them entries and records as small as the formats allow where none is given.

    A machine with packed records keeps them packed; others have a power of two, so that none lies across two lines.
    """
    machine = hardware.configure(name, pairs)
    given = {pair.partition("=")[0] for pair in pairs}
    f = settings.formats()
    need = record_bytes(f, settings.depth == "predicted")
    packed = machine.record_stride == record_bytes(REFERENCE, False)
    fit = {"record_stride": need if packed else 1 << (need - 1).bit_length()}
    if not (machine.late_sort or machine.scratch):
        fit["entry_bytes"] = f.entry_bytes
    return pairs + [f"{k}={value}" for k, value in fit.items() if k not in given and value != getattr(machine, k)]


class Run:
    """One accelerator over the frames of a job; `add` takes each frame as it is drawn, `finish` the last."""

    def __init__(self, job, machine: Hardware, sorting: str):
        check(machine, job.settings)
        if not is_late(machine, sorting):
            least = job.settings.formats().entry_bytes
            machine = replace(machine, late_sort=False, entry_bytes=max(machine.entry_bytes, least))
        self.job, self.machine, self.sorting = job, machine, sorting
        camera = job.cameras[0]
        self.size = camera.width, camera.height
        self.accelerator = None
        if machine.raster != "gpu":
            self.accelerator = Accelerator(machine, job.gaussians, *self.size, job.settings)
        self.held = None  # preprocess_ahead: drawn when the next frame is preprocessed
        self.lead = 0  # cycles of the first frame's preprocessing
        self.records: list[dict] = []
        self.busy: dict[str, list[float]] = {}

    def add(self, frame: Frame, quality: dict | None) -> None:
        if self.accelerator is None:
            self._record(self._gpu(frame), frame, quality)
            return
        drawn = self.accelerator.prepare(frame)
        if not self.machine.preprocess_ahead:
            self._draw(drawn, drawn.blocks, frame, quality)
            return
        if self.held is None:
            self.lead = self.accelerator.run(drawn.blocks, None)[0]
        else:
            self._draw(*self.held[:1], drawn.blocks, *self.held[1:])
        self.held = drawn, frame, quality

    def _gpu(self, frame: Frame) -> dict:
        """Cycles (of the accelerators' clock, so that times compare) and bytes of a GPU's frame."""
        entries = tiles16.boxes(frame.projection, *self.size).square
        worked = frame.raster.scu_ops.sum() / max(frame.raster.pairs.sum(), 1)
        gaussians = self.job.gaussians
        degree = min(gaussians.degree, self.job.settings.sh_degree)
        cost = gpu.frame(len(gaussians), degree, int(frame.features.visible.sum()), entries, *self.size, worked)
        stages = {stage: round(seconds * CLOCK) for stage, seconds in cost.seconds.items()}
        return {"cycles": sum(stages.values()), "stage_cycles": stages, "bytes": cost.bytes}

    def finish(self) -> dict:
        """The JSON of the run."""
        if self.held is not None:
            self._draw(self.held[0], self.held[0].blocks, *self.held[1:])
            self.held = None
        ms = [record["cycles"] / CLOCK * 1e3 for record in self.records]
        steady = ms[1:] or ms
        return {
            **self.job.head,
            "hardware": self.machine.name,
            "sorting": self.sorting,
            "set": {**asdict(self.job.settings), **self.machine.settings()},
            "frames": len(ms),
            "fps": 1e3 / float(np.mean(steady)) if steady else None,
            "p50_ms": float(np.percentile(steady, 50)) if steady else None,
            "p99_ms": float(np.percentile(steady, 99)) if steady else None,
            "first_ms": ms[0] + self.lead / CLOCK * 1e3 if ms else None,
            "utilisation": {unit: float(np.mean(shares)) for unit, shares in self.busy.items()},
            "per_frame": self.records,
        }

    def _draw(self, drawn, blocks, frame: Frame, quality: dict | None) -> None:
        """One frame in its stages."""
        a, machine = self.accelerator, self.machine
        lines, lost = a.memory.lines.copy(), a.lanes[-1].copy()
        begin = a.cycle
        preprocess = 0
        if not machine.preprocess_ahead:
            preprocess, _ = a.run(blocks, None)
            blocks = drawn.beside
        trace = a.run(blocks, drawn)[1]
        after, _ = a.run(drawn.after, None) if len(drawn.after.cycles) else (0, None)
        cycles = max(a.cycle - begin, 1)  # a picture that stays blank takes no time at all
        lost = (a.lanes[-1] - lost).sum(axis=0)
        stages = {
            "preprocess": preprocess or int(trace.preprocess[1] - trace.preprocess[0]),
            "sorting": int(trace.ready.max() - trace.accepted.min()) if len(trace.ready) else 0,
            "raster": int(trace.done.max() - trace.started.min()) + after if len(trace.done) else 0,
        }
        used = (a.memory.lines - lines) * LINE
        cores = machine.slices
        shares = {
            "subtile compute units": drawn.scu_ops * params.BEATS / (cores * params.UNITS * cycles),
            "intersection test units": drawn.tests / (cores * cycles) if machine.raster != "given" else 0.0,
            "sorting cores": float(drawn.jobs.cycles.sum()) / (cores * machine.sort_cores * cycles),
            "preprocessing units": float(drawn.blocks.cycles.sum()) / cycles,
            "memory bus": float(used.sum()) / (cycles / CLOCK * machine.bandwidth),
        }
        for unit, share in shares.items():
            self.busy.setdefault(unit, []).append(share)
        cost = {
            "cycles": cycles,
            "stage_cycles": stages,
            "stall_cycles": {
                **{cause: int(lost[k]) for k, cause in enumerate(raster_state.CAUSES)},
                "memory_in_sort": int(trace.slip.sum()),
            },
            "bytes": {
                stage: {"read": int(used[k, 0]), "write": int(used[k, 1])} for k, stage in enumerate(memory.STAGES)
            },
        }
        self._record(cost, frame, quality, {"record_hit_permille": round(1000 * a.hit_rate)})

    def _record(self, cost: dict, frame: Frame, quality: dict | None, more: dict | None = None) -> None:
        record = frame_record(frame.image, {**frame.counters, **(more or {})}, quality, cost)
        self.records.append(record)


def is_late(machine: Hardware, sorting: str) -> bool:
    """Does the raster core sort? Another strategy than reuse needs keys in its tables, and goes without."""
    return bool(machine.late_sort) and sorting == "reuse"


def _picture_key(machine: Hardware, sorting: str) -> tuple[str, bool]:
    return sorting, is_late(machine, sorting)


def compare_job(
    job,
    machines: list[tuple[Hardware, str]],
    quality: str = "oracle",
    on_frame: Callable | None = None,
    output: Output | None = None,
    on_pictures: Callable | None = None,
) -> list[dict]:
    """One JSON of `simulate` for each (hardware, sorting), all on the same frames.

    quality: "oracle" compares each picture with the float64 oracle, "exact" with the golden model's exactly sorted
    picture, "none" with nothing. on_frame(done, number of frames) is called behind each frame. output keeps the first
    one's pictures. on_pictures(index, [golden.frame.Frame of each pair]) looks at them. Ctrl-C ends the
    sequence: the frames so far are returned.
    """
    runs = [Run(job, machine, sorting) for machine, sorting in machines]
    wanted = {_picture_key(run.machine, run.sorting) for run in runs}
    if quality == "exact":
        wanted.add(("full", False))
    renderers = {key: Renderer(job.gaussians, job.settings, *key) for key in sorted(wanted)}
    try:
        for index, camera in enumerate(job.cameras):
            frames = {key: renderer.frame(camera) for key, renderer in renderers.items()}
            truth = None
            if quality == "oracle":
                truth = job.truth(index)
            elif quality == "exact":
                truth = frames["full", False].image.astype(np.float64)
            marks = {key: None if truth is None else metrics.compare(f.image, truth) for key, f in frames.items()}
            for run in runs:
                key = _picture_key(run.machine, run.sorting)
                run.add(frames[key], marks[key])
            if on_pictures:
                on_pictures(index, [frames[_picture_key(run.machine, run.sorting)] for run in runs])
            if output:
                output.add(job.frames[index], frames[_picture_key(runs[0].machine, runs[0].sorting)].image, {})
            if on_frame:
                on_frame(index + 1, len(job.cameras))
    except KeyboardInterrupt:
        if not any(run.records for run in runs):
            raise
    return [run.finish() for run in runs]


def compare(
    scene: str,
    size: str,
    frames: int | str,
    configs: list[tuple[str, str | None, dict[str, str]]],
    cameras: str | None = None,
    path: str = "orbit",
    fps: float = 30.0,
    speed: float = 1.0,
    quality: str = "none",
    settings: list[str] | None = None,
    on_frame: Callable | None = None,
) -> list[dict]:
    """`compare_job` from the words of the command line; configs: (hardware, sorting or None, its keys)."""
    from golden.job import add_common, prepare

    parser = argparse.ArgumentParser()
    add_common(parser)
    words = [scene, "--size", size, "--frames", str(frames), "--fps", str(fps), "--speed", str(speed), "--path", path]
    words += ["--cameras", cameras] if cameras else []
    for pair in settings or []:
        words += ["--set", pair]
    job = prepare(parser.parse_args(words))
    machines = []
    for name, sorting, changes in configs:
        pairs = fitted(name, [f"{key}={value}" for key, value in changes.items()], job.settings)
        machine = hardware.configure(name, pairs)
        machines.append((machine, strategy(machine, sorting)))
    return compare_job(job, machines, quality, on_frame)


def split_settings(pairs: list[str]) -> tuple[list[str], list[str]]:
    """--set pairs of (the golden model, the hardware); InputError for what neither knows."""
    names = {owner: keys.known(owner) for owner in (Settings, Hardware)}
    split = {owner: [pair for pair in pairs if pair.partition("=")[0] in names[owner]] for owner in names}
    for pair in pairs:
        if not any(pair in mine for mine in split.values()):
            raise keys.unknown(pair, [name for owner in names.values() for name in owner])
    return split[Settings], split[Hardware]
