"""What figures read from the JSON of a run (golden.timing.simulate)."""

from __future__ import annotations

import math

import numpy as np

from golden.report.reproduce.paper import GROUND_TRUTH_DB

STAGES = ("preprocess", "sorting", "raster")
FRAMES = 60  # that the paper adds traffic over


def steady(result: dict) -> list[dict]:
    """The frames behind the first, which is sorted from scratch."""
    return result["per_frame"][1:] or result["per_frame"]


def frame_bytes(frame: dict, stages: tuple[str, ...] = STAGES) -> int:
    return sum(sum(frame["dram_bytes"][stage].values()) for stage in stages)


def gigabytes(result: dict, stages: tuple[str, ...] = STAGES) -> float:
    """Traffic of FRAMES frames: the first, and the mean of the others for the rest."""
    others = np.mean([frame_bytes(frame, stages) for frame in steady(result)])
    return (frame_bytes(result["per_frame"][0], stages) + (FRAMES - 1) * float(others)) / 1e9


def seconds(frame: dict, stage: str | None = None) -> float:
    """Of a frame or one of its stages, at 1 GHz."""
    return (frame["cycles"] if stage is None else frame["stage_cycles"][stage]) / 1e9


def less(ours: float, other: float) -> float:
    """By how many percent `ours` is below `other`."""
    return 100 * (1 - ours / other)


def decibels(result: dict) -> list[float]:
    """PSNR of the frames behind the first; a frame without any difference is left out."""
    return [frame["psnr_db"] for frame in steady(result) if frame["psnr_db"] is not None]


def loss(psnr: float) -> float:
    """dB that a picture of GROUND_TRUTH_DB loses when an independent error of `psnr` dB is added to it."""
    return GROUND_TRUTH_DB + 10 * math.log10(10 ** (-GROUND_TRUTH_DB / 10) + 10 ** (-psnr / 10))
