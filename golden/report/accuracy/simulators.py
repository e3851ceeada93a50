"""The models themselves, on the same frames: seconds and memory of each, and what its answer misses.

Each runs in a process of its own. Timing model and RTL are the same machine here: one slice of Neo on a memory of fixed
latency, where the timing model is to take the RTL's cycles. Of the RTL's run only its own seconds count; the golden
model, which prepares its memory and checks it, is in its memory.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from golden import metrics
from golden.errors import InputError
from golden.frame import Renderer
from golden.job import Job, prepare

SIZE, FRAMES = "256x192", 4  # a small picture, and as many frames; the first is not timed
ANSWERS = {
    "oracle": "the exact picture",
    "golden": "the RTL's picture, to the bit",
    "timing": "that picture; frames a second, bytes and stalls of an accelerator",
    "rtl": "the hardware itself, cycle by cycle",
}
COLUMNS = ("model", "answers", "seconds_a_frame", "peak_mb", "misses")


def _oracle(job: Job) -> Callable:
    def frame(index: int):
        begin = time.perf_counter()
        return job.truth(index), None, time.perf_counter() - begin

    return frame


def _golden(job: Job) -> Callable:
    renderer = Renderer(job.gaussians, job.settings)

    def frame(index: int):
        begin = time.perf_counter()
        return renderer.frame(job.cameras[index]).image, None, time.perf_counter() - begin

    return frame


def _timing(job: Job) -> Callable:
    from golden.timing import memory, raster_state
    from golden.timing.accelerator import Accelerator, no_blocks
    from golden.timing.hardware import HARDWARE

    renderer = Renderer(job.gaussians, job.settings)
    camera = job.cameras[0]
    one = replace(HARDWARE["neo"], slices=1, record_stride=24)
    accelerator = Accelerator(one, job.gaussians, camera.width, camera.height, job.settings)

    def frame(index: int):
        begin = time.perf_counter()
        drawn = renderer.frame(job.cameras[index])
        accelerator.memory = memory.fixed()
        accelerator.order = np.arange(len(drawn.order.offsets) - 1)
        accelerator.lanes = raster_state.new_state(accelerator.core, 1, 0)
        accelerator.cycle = 0
        trace = accelerator.run(no_blocks(), accelerator.prepare(drawn))[1]
        return drawn.image, int(trace.done.max()), time.perf_counter() - begin

    return frame


def _rtl(job: Job) -> Callable:
    from rich.progress import Progress

    from golden.cosim.compare import Cosim

    pair = Cosim(job, "reuse", Progress(disable=True))

    def frame(index: int):
        before = pair.seconds
        result = pair.frame(index)
        return result.image, result.cycles["stage_cycles"]["raster"], pair.seconds - before

    return frame


MODELS = {"oracle": _oracle, "golden": _golden, "timing": _timing, "rtl": _rtl}


def peak() -> float:
    """MB of memory that this process has had at most. (ru_maxrss would be the parent's where that had more.)"""
    status = Path("/proc/self/status")
    if status.is_file():
        return float(re.search(r"VmHWM:\s*(\d+) kB", status.read_text())[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def run(model: str, common: str, pictures: str) -> None:
    """In a process of its own: writes the pictures, prints seconds a frame, MB and each frame's cycles as JSON."""
    job = prepare(argparse.Namespace(**json.loads(common)))
    frame = MODELS[model](job)
    found = [frame(index) for index in range(len(job.cameras))]
    np.save(pictures, np.stack([image for image, _, _ in found]))
    seconds = [spent for _, _, spent in found[1:]]
    print(
        json.dumps({"seconds": float(np.median(seconds)), "mb": peak(), "cycles": [cycles for _, cycles, _ in found]})
    )


def _pixels(images: np.ndarray, others: np.ndarray) -> str:
    found = metrics.compare(np.concatenate(images), np.concatenate(others))
    if found["psnr_db"] is None:
        return "0 differences"
    return f"{found['psnr_db']:.1f} dB, at most {found['max_lsb']:.2f} LSB"


def rows(common: str) -> list[dict]:
    """A row a model. common: of the study, whose path and settings it shares."""
    options = {**json.loads(common), "size": SIZE, "frames": str(FRAMES)}
    found, images = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        for model in MODELS:
            pictures = str(Path(folder) / f"{model}.npy")
            code = "import sys; from golden.report.accuracy import simulators; simulators.run(*sys.argv[1:])"
            words = [sys.executable, "-c", code, model, json.dumps(options), pictures]
            ran = subprocess.run(words, stdout=subprocess.PIPE, text=True)
            if ran.returncode:
                raise InputError(f"accuracy: {model} did not run; --no-simulators leaves this table out")
            found[model] = json.loads(ran.stdout)
            images[model] = np.load(pictures)
    ours, theirs = (np.array(found[model]["cycles"]) for model in ("timing", "rtl"))
    misses = {
        "oracle": "time",
        "golden": f"against the RTL {_pixels(images['golden'], images['rtl'])}; time",
        "timing": f"against the RTL {_pixels(images['timing'], images['rtl'])}, {np.abs(ours - theirs).max()} cycles",
        "rtl": f"against the oracle {_pixels(images['rtl'], images['oracle'])}; preprocessing and DRAM",
    }
    return [
        {
            "model": model,
            "answers": ANSWERS[model],
            "seconds_a_frame": f"{found[model]['seconds']:.3f}",
            "peak_mb": f"{found[model]['mb']:.0f}",
            "misses": misses[model],
        }
        for model in MODELS
    ]


def write(path: Path, common: str) -> list[dict]:
    """Measure, keep as CSV, return the rows."""
    table = rows(common)
    part = path.with_name(path.name + ".part")
    with open(part, "w", newline="") as file:
        out = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        out.writeheader()
        out.writerows(table)
    os.replace(part, path)
    return table
