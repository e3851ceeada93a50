"""What `splatcore simulate` prints: a table that a person reads."""

from __future__ import annotations

import numpy as np
from rich.console import Console
from rich.table import Table

from golden.timing.hardware import Hardware
from golden.timing.memory import STAGES


def _mean(frames: list[dict], *path: str) -> float:
    values = []
    for value in frames:
        for key in path:
            value = value[key]
        values.append(value)
    return float(np.mean(values))


def show(result: dict, machine: Hardware) -> None:
    """Print a result of simulate.compare_job."""
    console = Console()
    frames = result["per_frame"]
    width, height = result["size"]
    console.print(f"{machine.name}: {machine.note}", highlight=False)
    console.print(
        f"{result['scene']}, {width}x{height}, {result['frames']} frames, sorting {result['sorting']}: "
        f"[bold]{result['fps']:.1f} frames a second[/bold] "
        f"(p50 {result['p50_ms']:.2f} ms, p99 {result['p99_ms']:.2f} ms, first {result['first_ms']:.2f} ms)",
        highlight=False,
    )
    steady = frames[1:] or frames
    stages = Table("stage, mean of a frame", "million cycles", "MB read", "MB written")
    for stage in STAGES:
        if steady[0]["stage_cycles"][stage] is None:
            continue
        stages.add_row(
            stage,
            f"{_mean(steady, 'stage_cycles', stage) / 1e6:.2f}",
            f"{_mean(steady, 'dram_bytes', stage, 'read') / 1e6:.1f}",
            f"{_mean(steady, 'dram_bytes', stage, 'write') / 1e6:.1f}",
        )
    console.print(stages)
    if result["utilisation"]:
        units = Table("unit", "busy")
        for unit, share in result["utilisation"].items():
            units.add_row(unit, f"{100 * share:.0f} %")
        console.print(units)
    if steady[0]["stall_cycles"]:
        total = machine.slices * _mean(steady, "cycles")
        causes = Table("raster cores wait for", "share of their time")
        for cause in steady[0]["stall_cycles"]:
            if cause != "memory_in_sort":
                causes.add_row(cause, f"{100 * _mean(steady, 'stall_cycles', cause) / total:.0f} %")
        console.print(causes)
    quality = [f["psnr_db"] for f in frames if f["psnr_db"] is not None]
    if quality:
        console.print(
            f"against the oracle: {min(quality):.1f} dB in the worst frame, {np.median(quality):.1f} dB median"
        )
