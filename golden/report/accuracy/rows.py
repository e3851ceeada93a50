"""The table of a study: one row a point, from the JSON of its run. Milliseconds, MB, dB, LSB, percent."""

from __future__ import annotations

import csv
import hashlib
import math
import os
from pathlib import Path

import numpy as np

from golden.report.accuracy import area
from golden.report.accuracy.plan import Point
from golden.timing.memory import STAGES

PARTS = ("order", "decisions", "arithmetic")  # of the error
COLUMNS = (
    "knob", "family", "value", "unit", "machine", "hardware", "sorting", "set", "scene", "size", "frames",
    "psnr_mean_db", "psnr_min_db", "psnr_max_db", "psnr_first_db", "max_lsb", "percent_above_1_lsb",
    *(f"{part}_{kind}" for part in PARTS for kind in ("max_lsb", "rms_lsb", "percent_above_1_lsb")),
    "change_max_lsb", "change_rms_lsb", "ms_p50", "ms_p99", "ms_first",
    *(f"mb_{stage}" for stage in STAGES), "mb", "area_mm2", "entry_bytes", "record_bytes",
    "inputs_sha256", "pictures_sha256",
)  # fmt: skip
DIGITS = 6


def decibels(values: list[float | None]) -> float:
    """PSNR of the mean square error of several; infinite where nothing differs."""
    square = np.mean([0.0 if value is None else 10 ** (-value / 10) for value in values])
    return -10 * math.log10(square) if square > 0 else math.inf


def row(head: dict, point: Point, result: dict) -> dict:
    """One row. Quality, bytes and steady times are of the frames behind the first, which is sorted from scratch."""
    steady = result["frames"][1:]
    quality = [math.inf if frame["psnr_db"] is None else frame["psnr_db"] for frame in steady]
    mb = {stage: float(np.mean([frame["mb"][stage] for frame in steady])) for stage in STAGES}
    parts = {
        f"{part}_{kind}": value for part, values in result["parts"].items() for kind, value in values.items()
    }  # fmt: skip
    pictures = hashlib.sha256("".join(frame["sha256"] for frame in result["frames"]).encode())
    return {
        "knob": point.knob,
        "family": point.family,
        "value": point.value,
        "unit": point.unit,
        "machine": point.machine,
        "hardware": point.hardware,
        "sorting": point.sorting or "",
        "set": " ".join((*head["set"], *point.sets, *point.pairs)),
        "scene": head["scene"],
        "size": "x".join(map(str, head["size"])),
        "frames": head["frames"],
        "psnr_mean_db": decibels([frame["psnr_db"] for frame in steady]),
        "psnr_min_db": min(quality),
        "psnr_max_db": max(quality),
        "psnr_first_db": decibels([result["frames"][0]["psnr_db"]]),
        "max_lsb": max(frame["max_lsb"] for frame in steady),
        "percent_above_1_lsb": 100 * max(frame["share_above_1_lsb"] for frame in steady),
        **parts,
        "change_max_lsb": max(frame["change"]["max_lsb"] for frame in steady),
        "change_rms_lsb": max(frame["change"]["rms_lsb"] for frame in steady),
        "ms_p50": result["p50_ms"],
        "ms_p99": result["p99_ms"],
        "ms_first": result["first_ms"],
        **{f"mb_{stage}": value for stage, value in mb.items()},
        "mb": sum(mb.values()),
        "area_mm2": area.mm2(point.hardware, (*head["set"], *point.sets, *point.pairs)),
        "entry_bytes": result["entry_bytes"],
        "record_bytes": result["record_bytes"],
        "inputs_sha256": head["inputs_sha256"],
        "pictures_sha256": pictures.hexdigest(),
    }


def table(head: dict, points: list[Point], results: list[dict]) -> list[dict]:
    return [row(head, point, result) for point, result in zip(points, results, strict=True)]


def text(value: object) -> str:
    """A cell of the CSV; empty where a number does not exist."""
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.{DIGITS}g}"
    return str(value)


def json_value(value: object) -> object:
    """JSON has neither: a picture without any difference has no PSNR, a machine that was not mapped no area."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write(path: Path, rows: list[dict]) -> None:
    """As CSV, beside its final name, then renamed."""
    part = path.with_name(path.name + ".part")
    with open(part, "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(COLUMNS)
        out.writerows([text(row[column]) for column in COLUMNS] for row in rows)
    os.replace(part, path)


def read(path: Path) -> list[dict[str, str]]:
    """The cells that `write` wrote."""
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def cheapest(rows: list[dict], meets) -> dict | None:
    """Of the rows that meet a target the fastest; of equally fast ones that with fewer bytes."""
    fitting = [row for row in rows if meets(row)]
    return min(fitting, key=lambda row: (row["ms_p50"], row["mb"]), default=None)


def front(rows: list[dict], better: str = "psnr_min_db") -> list[dict]:
    """The rows that no other beats in time and quality at once, from fast to exact."""
    found: list[dict] = []
    for row in sorted(rows, key=lambda row: (row["ms_p50"], -row[better])):
        if not found or row[better] > found[-1][better]:
            found.append(row)
    return found
