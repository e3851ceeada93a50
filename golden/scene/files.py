"""Opening what the user named: bytes, JSON and single fields, each failure an InputError of one line."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np

from golden.errors import InputError

# A compressed file may claim this many Gaussians beside those its size makes plausible (real ones need 10 bytes each).
CLAIM_FLOOR = 1 << 16
CLAIM_PER_BYTE = 8


def one_line(text: object) -> str:
    """Text of an exception or value: one line, short, no control characters."""
    line = "".join(c if c.isprintable() else "?" for c in " ".join(str(text).split()))
    return line if len(line) <= 200 else line[:197] + "..."


def require_file(path: Path) -> int:
    """Size in bytes of an existing, non-empty, ordinary file."""
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a folder, a file is needed")
        if not path.exists():
            raise InputError(f"{path}: no such file")
        if not path.is_file():
            raise InputError(f"{path}: is not an ordinary file")
        size = path.stat().st_size
    except (OSError, ValueError) as error:
        raise InputError(f"{one_line(path)}: cannot be opened ({one_line(error)})") from error
    if size == 0:
        raise InputError(f"{path}: the file is empty")
    return size


def read_bytes(path: Path) -> bytes:
    require_file(path)
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({one_line(error)})") from error


def parse_json(data: bytes, where: str) -> object:
    """Value of JSON bytes (UTF-8, with or without byte order mark)."""
    try:
        return json.loads(data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InputError(f"{where}: byte {error.start} is not UTF-8, JSON text is needed") from error
    except RecursionError as error:
        raise InputError(f"{where}: JSON nested too deeply") from error
    except json.JSONDecodeError as error:
        raise InputError(f"{where}: line {error.lineno} is not JSON ({one_line(error.msg)})") from error
    except ValueError as error:
        raise InputError(f"{where}: a number cannot be read ({one_line(error)})") from error


def member(value: object, key: str, where: str, kind: type | tuple[type, ...], what: str) -> object:
    """value[key] of a JSON object, of the stated kind."""
    if not isinstance(value, dict):
        raise InputError(f"{where}: {one_line(value)} found, an object with field '{key}' is needed")
    if key not in value:
        raise InputError(f"{where}: field '{key}' is missing, {what} is needed")
    found = value[key]
    if not isinstance(found, kind) or (isinstance(found, bool) and kind is not bool):
        raise InputError(f"{where}: field '{key}' is {one_line(found)}, {what} is needed")
    return found


def numbers(value: object, shape: tuple[int, ...], where: str) -> np.ndarray:
    """float64 array of nested JSON lists of finite numbers, of exactly this shape."""
    what = " x ".join(map(str, shape)) + " finite numbers" if shape else "finite numbers"

    def leaves(part: object, sizes: tuple[int, ...]) -> list[float]:
        if not sizes:
            if isinstance(part, bool) or not isinstance(part, int | float):
                raise InputError(f"{where}: {one_line(part)} found, {what} are needed")
            try:
                number = float(part)
            except OverflowError:
                number = math.inf
            if not math.isfinite(number):
                raise InputError(f"{where}: {one_line(part)} found, {what} are needed")
            return [number]
        if not isinstance(part, list) or len(part) != sizes[0]:
            found = f"{len(part)} values" if isinstance(part, list) else one_line(part)
            raise InputError(f"{where}: {found} found, {what} are needed")
        return [leaf for item in part for leaf in leaves(item, sizes[1:])]

    return np.array(leaves(value, shape), np.float64).reshape(shape)


def check_claim(file: str, count: int, size: int) -> None:
    """A compressed file of `size` bytes that claims `count` Gaussians must be able to hold them."""
    limit = CLAIM_FLOOR + CLAIM_PER_BYTE * size
    if count > limit:
        raise InputError(f"{file}: claims {count} Gaussians in {size} bytes, at most {limit} are plausible")
