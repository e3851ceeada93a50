"""Work for sweeps of tests: what a task does must be importable where workers are."""

from __future__ import annotations

import os
import signal
from pathlib import Path

from golden.errors import InputError


def squares(values: list[int]) -> list[int]:
    return [value * value for value in values]


def halves(values: list[int]) -> list[float]:
    return [value / 3 for value in values]


def die_once(folder: str, values: list[int]) -> list[int]:
    """The process that comes first is lost in the middle of its work."""
    mark = Path(folder) / "mark"
    if not mark.exists():
        mark.write_text(str(os.getpid()))
        os.kill(os.getpid(), signal.SIGKILL)
    return squares(values)


def die(values: list[int]) -> list[int]:
    """Every process that tries is lost."""
    os.kill(os.getpid(), signal.SIGKILL)
    return values


def refuse(values: list[int]) -> list[int]:
    raise InputError(f"values {values}: wants others")
