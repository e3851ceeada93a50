"""`splatcore accuracy`: what each knob does to the picture, the time and the bytes of a scene (docs/accuracy.md)."""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Callable
from pathlib import Path

from golden import cameras
from golden.errors import InputError
from golden.job import Job, add_common, prepare
from golden.report import sweep
from golden.report.stats import Output

COMMON = (
    "scene", "cameras", "path", "camera", "fps", "speed", "size", "frames", "effects", "set", "seed", "jobs", "sorting",
    "out",
)  # fmt: skip
COMMITTED = ("accuracy.csv", "simulators.csv", "answer.md", "accuracy.png", "bits.png", "grid.png", "difference.png")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `splatcore accuracy`."""
    add_common(parser, jobs="processes (default: cores, as memory allows)")
    parser.set_defaults(size="384x256", frames="6")
    parser.add_argument("--knobs", metavar="LIST", help="names with commas between; grid is one (default: all)")
    parser.add_argument("--no-simulators", action="store_true", help="leave out the table of the models themselves")
    parser.add_argument("--page", metavar="DIR", help="copy what is committed there: tables, pictures, answer")
    sweep.add_arguments(parser)


def accuracy(args: argparse.Namespace, on_step: Callable[[int, int], None] = lambda done, total: None) -> int:
    """Run the command; on_step(work done, all work) is called behind each run."""
    from golden.report.accuracy import plan

    if args.out is None:
        raise InputError("accuracy: wants -o DIR for its tables and pictures")
    if args.sorting is not None:
        raise InputError(f"--sorting {args.sorting}: accuracy varies it itself; wants none")
    points, left_out = plan.points(plan.chosen(args.knobs))
    common = {name: getattr(args, name) for name in COMMON} | {"jobs": 0, "out": None}
    job = prepare(argparse.Namespace(**common))
    if len(job.frames) < 2:
        raise InputError(f"--frames {args.frames}: wants 2 or more; the first one is sorted from scratch")
    folder = Path(args.out)
    Output(args.out, {})  # makes the folder, or says why not
    about = head(args, job)
    for line in left_out:
        print(f"left out: {line}")
    results = _measured(points, json.dumps(common), about, folder, args, on_step)
    _write(folder, about, left_out, points, results, json.dumps(common), not args.no_simulators)
    if args.page:
        _publish(folder, Path(args.page))
    return 0


def head(args: argparse.Namespace, job: Job) -> dict:
    """What a study is of, without any path of this machine."""
    from golden.report.accuracy import measure

    motion = f"{Path(args.cameras).name if args.cameras else args.path}, {args.fps:g} frames a second"
    return {
        "scene": Path(args.scene).name,
        "size": list(cameras.parse_size(args.size)),
        "frames": args.frames,
        "motion": motion + (f", motion x{args.speed:g}" if args.speed != 1 else ""),
        "set": args.set,
        "inputs_sha256": measure.inputs_hash(job),
    }


def _measured(points: list, common: str, about: dict, folder: Path, args: argparse.Namespace, on_step) -> list[dict]:
    """The result of each point, measured where none is kept."""
    from golden.report.accuracy.measure import measure

    kept = sweep.Kept(folder, measure)
    files = {}
    groups: dict[tuple, list] = {}
    for point in points:
        words = {**about, **point.words()}
        file = kept.file(words)
        if file not in files:
            files[file] = words
            if not file.is_file():
                groups.setdefault((point.sets, point.value == "again"), []).append((file, point.config))
    tasks = [
        sweep.Task(
            measure,
            (common, about["inputs_sha256"], sets, [config for _, config in members]),
            tuple((file, files[file]) for file, _ in members),
            2 + len(members),
            f"{' '.join(sets) or 'reference'}, {len(members)} configurations",
        )
        for (sets, _), members in groups.items()
    ]
    for line in sweep.run(tasks, args, on_step):
        print(line, flush=True)
    return [sweep.read(kept.file({**about, **point.words()})) for point in points]


def _write(folder: Path, about: dict, left_out: list, points: list, results: list, common: str, models: bool) -> None:
    """Every table, picture and the answer."""
    from golden.report.accuracy import answer, charts, rows, simulators
    from golden.report.stats import write_json

    table = rows.table(about, points, results)
    rows.write(folder / "accuracy.csv", table)
    found = [
        {**{key: rows.json_value(value) for key, value in row.items()}, "per_frame": result["frames"]}
        for row, result in zip(table, results)
    ]
    write_json(folder / "accuracy.json", {**about, "left_out": left_out, "points": found})
    charts.draw(folder, about, table, common)
    compared = simulators.write(folder / "simulators.csv", common) if models else []
    (folder / "answer.md").write_text(answer.text(about, table, left_out, compared))
    print(f"accuracy.csv, accuracy.json, answer.md and pictures in {folder}")


def _publish(folder: Path, page: Path) -> None:
    try:
        page.mkdir(parents=True, exist_ok=True)
        for name in COMMITTED:
            if (folder / name).is_file():
                shutil.copyfile(folder / name, page / name)
    except OSError as error:
        raise InputError(f"--page {page}: cannot be written ({error.strerror}); wants a folder") from None
