"""Every setting that changes the picture or the time: one table, the `--set KEY=VALUE` keys of the command line."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace

from golden import params
from golden.errors import InputError


def _key(default, unit: str, valid: str, text: str):
    return field(default=default, metadata={"unit": unit, "valid": valid, "text": text})


@dataclass(frozen=True)
class Settings:
    """Values in the units that `splatcore info --keys` prints."""

    background: str = _key("0,0,0", "R,G,B", "0..1 each", "colour behind everything")
    antialias: str = _key("auto", "", "auto|on|off", "opacity compensation; auto does what the scene file asks for")
    capacity: int = _key(1 << 20, "entries", "256..1048576", "longest table of a tile; a longer one keeps the nearest")
    cut_share: float = _key(0.5, "", "0..1", "share of incoming entries above which a frame is sorted from scratch")
    cut_angle: float = _key(15.0, "degrees", "0..180", "turn of the camera in one frame above which it counts as a cut")
    rebuild_share: str = _key(
        "auto",
        "",
        "auto|0..1",
        "share of incoming entries above which a tile is rebuilt; auto: 0.5 with late sort, else 1",
    )
    depth: str = _key(
        "auto",
        "",
        "auto|deferred|consistent",
        "camera of incoming keys: this frame's, the last; auto: consistent with late",
    )
    colour_every: int = _key(1, "frames", "1..1024", "approximate: the colour of a Gaussian in sight is kept that long")
    motion_scale: float = _key(0.0, "scene units a metre", ">= 0", "of a recorded path; 0: the scene's own, else 1")
    read_latency: int = _key(40, "cycles", "1..4096", "memory of the co-simulation: address to first beat")
    write_latency: int = _key(20, "cycles", "1..4096", "memory of the co-simulation: last beat to response")
    answer_jitter: int = _key(0, "cycles", "0..4096", "of that memory: each answer up to this much later, from --seed")

    def background_codes(self) -> tuple[int, int, int]:
        """UQ3.COLOUR_F codes of the background."""
        red, green, blue = (round(float(part) * 2**params.COLOUR_F) for part in self.background.split(","))
        return red, green, blue

    def background_colour(self) -> tuple[float, float, float]:
        """The background as the hardware sees it: its codes as real numbers."""
        red, green, blue = self.background_codes()
        unit = 2.0**-params.COLOUR_F
        return red * unit, green * unit, blue * unit

    def rebuild_limit(self, late: bool) -> float:
        """rebuild_share as a number."""
        if self.rebuild_share == "auto":
            return 0.5 if late else 1.0
        return float(self.rebuild_share)

    def consistent(self, late: bool) -> bool:
        """Do incoming entries have the keys of the last camera, as those of the table?"""
        return late if self.depth == "auto" else self.depth == "consistent"


def _check(key: str, value) -> None:
    rules = {
        "background": lambda v: len(v.split(",")) == 3 and all(0 <= float(part) <= 1 for part in v.split(",")),
        "antialias": lambda v: v in ("auto", "on", "off"),
        "capacity": lambda v: params.CHUNK <= v <= 1 << 20,
        "cut_share": lambda v: 0 <= v <= 1,
        "cut_angle": lambda v: 0 <= v <= 180,
        "rebuild_share": lambda v: v == "auto" or 0 <= float(v) <= 1,
        "depth": lambda v: v in ("auto", "deferred", "consistent"),
        "colour_every": lambda v: 1 <= v <= 1024,
        "motion_scale": lambda v: 0 <= v < float("inf"),
        "read_latency": lambda v: 1 <= v <= 4096,
        "write_latency": lambda v: 1 <= v <= 4096,
        "answer_jitter": lambda v: 0 <= v <= 4096,
    }
    if not rules[key](value):
        raise ValueError


def parse(pairs: list[str]) -> Settings:
    """Settings from "KEY=VALUE" texts; InputError names the key, the value and what is valid."""
    known = {f.name: f for f in fields(Settings)}
    settings = Settings()
    for pair in pairs:
        key, equals, text = pair.partition("=")
        if key not in known or not equals:
            raise InputError(f"--set {pair}: no such key; `splatcore info --keys` lists {', '.join(known)}")
        try:
            value = type(known[key].default)(text)
            _check(key, value)
        except ValueError:
            meta = known[key].metadata
            raise InputError(f"--set {key}={text}: wants {meta['valid']} {meta['unit']}".rstrip()) from None
        settings = replace(settings, **{key: value})
    return settings


def table() -> list[tuple[str, str, str, str, str]]:
    """(key, default, unit, valid, text) of every key."""
    return [
        (f.name, str(f.default), f.metadata["unit"], f.metadata["valid"], f.metadata["text"]) for f in fields(Settings)
    ]
