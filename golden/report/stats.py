"""stats.json, the pictures beside it, and the line a frame prints (design: unknown values are null, never 0)."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

import numpy as np
from PIL import Image

from golden.errors import InputError


def frame_record(image: np.ndarray, counters: dict[str, int], metrics: dict | None, cycles: dict | None = None) -> dict:
    """One element of per_frame. metrics: golden.metrics.compare against the oracle, None when it did not run."""
    counters = dict(counters)
    known = {key: counters.pop(key, None) for key in ("entries", "incoming", "outgoing", "pairs", "blends")}
    metrics = metrics or {}
    cycles = cycles or {}
    return {
        "cycles": cycles.get("cycles"),
        "stage_cycles": cycles.get("stage_cycles", dict.fromkeys(("preprocess", "sorting", "raster"))),
        "stall_cycles": cycles.get("stall_cycles", {}),
        "dram_bytes": {
            stage: cycles.get("bytes", {}).get(stage, {"read": None, "write": None})
            for stage in ("preprocess", "sorting", "raster")
        },
        **known,
        "psnr_db": metrics.get("psnr_db"),
        "max_lsb": metrics.get("max_lsb"),
        "flips": metrics.get("flips"),
        "counters": counters,
        "sha256": hashlib.sha256(np.ascontiguousarray(image, "<f4").tobytes()).hexdigest(),
    }


def _atomically(path: Path, write) -> None:
    """Write beside the final name, then rename: no half file under the final name."""
    part = path.with_name(path.name + ".part")
    with open(part, "wb") as file:
        write(file)
    os.replace(part, path)


def write_json(path: str | Path, value: dict) -> None:
    """Write a result; InputError when the file cannot be made."""
    text = json.dumps(value, indent=1, allow_nan=False).encode()
    try:
        _atomically(Path(path), lambda file: file.write(text))
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); wants a file in a writable folder") from None


def to_8_bit(image: np.ndarray) -> np.ndarray:
    """[H, W, 3] real values to 0..255, half up, saturated."""
    return np.clip(np.floor(image.astype(np.float64) * 255 + 0.5), 0, 255).astype(np.uint8)


class Output:
    """The folder a run writes. Frames are kept as they finish; stats.json is written last, also after Ctrl-C."""

    def __init__(self, folder: str | None, head: dict):
        self.folder = Path(folder) if folder else None
        self.head = head
        self.frames: list[dict] = []
        if self.folder is None:
            return
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except (FileExistsError, NotADirectoryError):
            raise InputError(f"-o {folder}: is a file; wants the name of a folder") from None
        except OSError as error:
            raise InputError(f"-o {folder}: cannot be made ({error.strerror}); wants a writable folder") from None

    def add(self, number: int, image: np.ndarray, record: dict) -> None:
        """Keep frame `number`: [H, W, 3] float32 image and its record."""
        self.frames.append(record)
        if self.folder is None:
            return
        stem = self.folder / f"frame_{number:04d}"
        _atomically(stem.with_suffix(".npy"), lambda file: np.save(file, image.astype("<f4")))
        picture = Image.fromarray(to_8_bit(image))
        _atomically(stem.with_suffix(".png"), lambda file: picture.save(file, "PNG"))

    def finish(self, stats: dict | None = None) -> dict:
        """Write stats.json, with what there is when no stats are given; returns it."""
        stats = stats or {
            **self.head,
            "frames": len(self.frames),
            "fps": None,
            "p50_ms": None,
            "p99_ms": None,
            "first_ms": None,
            "per_frame": self.frames,
        }
        if self.folder is not None:
            write_json(self.folder / "stats.json", stats)
        return stats
