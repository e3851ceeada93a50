"""What each command of `splatcore` does, on top of the models."""

from __future__ import annotations

import argparse
import os
import sys
import time

import numba
import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from golden import keys, metrics, scene, settings
from golden.errors import InputError
from golden.frame import Renderer
from golden.job import prepare
from golden.report import summary
from golden.report.stats import Output, frame_record, write_json
from golden.timing import hardware


def _progress() -> Progress:
    """A bar on stderr while a person watches, nothing otherwise."""
    console = Console(stderr=True)
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
        transient=True,
    )


def info(args: argparse.Namespace) -> int:
    """`splatcore info SCENE` or `splatcore info --keys`."""
    console = Console()
    if args.keys:
        table = Table("key", "default", "unit", "valid", "what it sets")
        for row in keys.table(settings.Settings()):
            table.add_row(*row)
        console.print(table)
        table = Table("key of simulate", "splatcore's", "unit", "valid", "what it sets")
        for row in keys.table(hardware.HARDWARE["splatcore"]):
            table.add_row(*row)
        console.print(table)
    if args.scene:
        gaussians = scene.load(args.scene)
        table = Table("field", "value", show_header=False)
        table.add_row("Gaussians", f"{gaussians.means.shape[0]:,}")
        table.add_row("SH degree", str(gaussians.degree))
        table.add_row("opacity compensation", "yes" if gaussians.antialias else "no")
        if gaussians.means.size:
            for name, values in (
                ("position x", gaussians.means[:, 0]),
                ("position y", gaussians.means[:, 1]),
                ("position z", gaussians.means[:, 2]),
                ("sigma (longest axis)", gaussians.scales.max(1)),
                ("opacity", gaussians.opacities),
            ):
                low, middle, high = np.percentile(values, [5, 50, 95])
                table.add_row(f"{name} p5 / p50 / p95", f"{low:.4g} / {middle:.4g} / {high:.4g}")
        for name, value in gaussians.counters.items():
            table.add_row(name, f"{value:,}")
        console.print(table)
    elif not args.keys:
        raise InputError("info: wants a SCENE or --keys")
    return 0


def _threads(args: argparse.Namespace) -> None:
    if args.jobs:
        numba.set_num_threads(min(args.jobs, numba.config.NUMBA_NUM_THREADS))


def render(args: argparse.Namespace) -> int:
    """`splatcore render`: pictures, no comparison with the oracle (it has its own --model)."""
    if args.out is None:
        raise InputError("render: wants -o DIR for its pictures")
    if args.model == "rtl":
        return cosim(args)
    job = prepare(args)
    _threads(args)
    output = Output(args.out, {**job.head, "model": args.model})
    renderer = Renderer(job.gaussians, job.settings, args.sorting)
    try:
        with _progress() as progress:
            for index, number in enumerate(progress.track(job.frames, description=f"render {args.model}")):
                begin = time.perf_counter()
                if args.model == "oracle":
                    image, counters = job.truth(index).astype(np.float32), {}
                else:
                    frame = renderer.frame(job.cameras[index])
                    image, counters = frame.image, frame.counters
                seconds = time.perf_counter() - begin
                output.add(number, image, frame_record(image, counters, None))
                text = " ".join(
                    f"{key} {counters[key]:,}" for key in ("entries", "incoming", "pairs") if key in counters
                )
                print(f"frame {number}: {seconds:.2f} s {text}".rstrip(), flush=True)
    finally:
        output.finish()
    print(f"pictures and stats.json in {args.out}", file=sys.stderr)
    return 0


def cosim(args: argparse.Namespace) -> int:
    """`splatcore cosim`: RTL and golden model side by side, exit status 1 at the first difference."""
    from golden.cosim.compare import Cosim

    if args.sorting not in (None, "reuse", "full"):
        raise InputError(f"--sorting {args.sorting}: the RTL's host wants reuse or full")
    job = prepare(args)
    _threads(args)
    output = Output(args.out, {**job.head, "model": "rtl"})
    status = 0
    try:
        with _progress() as progress:
            pair = Cosim(job, args.sorting, progress, args.seed)
            for index, number in enumerate(job.frames):
                result = pair.frame(index)
                quality = None
                if not getattr(args, "no_oracle", False) and result.difference is None:
                    quality = metrics.compare(result.image, job.truth(index))
                output.add(number, result.image, frame_record(result.image, result.counters, quality, result.cycles))
                print(result.line(number, quality), flush=True)
                if result.difference is not None:
                    print(f"splatcore: {result.difference}", file=sys.stderr)
                    status = 1
                    break
    finally:
        output.finish()
    if status == 0:
        print(pair.summary())
    return status


def simulate(args: argparse.Namespace) -> int:
    """`splatcore simulate`: an accelerator's time, bytes and picture, frame by frame."""
    from golden.timing import simulate as simulation

    args.set, pairs = simulation.split_settings(args.set)
    machine = hardware.configure(args.hardware, simulation.fitted(args.hardware, pairs, settings.parse(args.set)))
    sorting = simulation.strategy(machine, args.sorting)
    args.sorting = sorting
    if args.json and (os.path.isdir(args.json) or not os.path.isdir(os.path.dirname(args.json) or ".")):
        raise InputError(f"--json {args.json}: wants the name of a file in a folder that exists")
    job = prepare(args)
    _threads(args)
    output = Output(args.out, {}) if args.out else None
    with _progress() as progress:
        task = progress.add_task(f"simulate {machine.name}", total=len(job.frames))
        quality = "none" if args.no_oracle else "oracle"
        result = simulation.compare_job(
            job, [(machine, sorting)], quality, lambda done, _: progress.update(task, completed=done), output
        )[0]
    if output:
        output.finish(result)
    if args.json:
        write_json(args.json, result)
    summary.show(result, machine)
    return 0 if result["frames"] == len(job.frames) else 130


def export(args: argparse.Namespace) -> int:
    """`splatcore export`: a trace for another simulator."""
    from golden.timing import traces

    with _progress() as progress:
        task = progress.add_task(f"export {args.trace}")
        return traces.export(args, lambda done, total: progress.update(task, completed=done, total=total))


def reproduce(args: argparse.Namespace) -> int:
    """`splatcore reproduce`: the paper's figures and tables beside ours."""
    from golden.report import reproduce as figures

    with _progress() as progress:
        task = progress.add_task("reproduce")
        return figures.reproduce(args, lambda done, total: progress.update(task, completed=done, total=total))


def hard_cases(args: argparse.Namespace) -> int:
    """`splatcore hard-cases`: the cases that break naive designs, figures beside bounds; status 1 when one fails."""
    from golden.hard_cases import command

    with _progress() as progress:
        task = progress.add_task("hard cases")
        return command.run(args, lambda done, total: progress.update(task, completed=done, total=total))


def accuracy(args: argparse.Namespace) -> int:
    """`splatcore accuracy`: the study of a scene."""
    from golden.report import accuracy as study

    with _progress() as progress:
        task = progress.add_task("accuracy")
        return study.accuracy(args, lambda done, total: progress.update(task, completed=done, total=total))
