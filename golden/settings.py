"""Every setting that changes the picture or the time: one table, the `--set KEY=VALUE` keys of the command line."""

from __future__ import annotations

from dataclasses import dataclass

from golden import formats, keys, params
from golden.formats import Formats
from golden.keys import between, key, one_of
from golden.preprocess.colour import DEGREE_MAX

CHUNKS = (64, 128, 256, 512, 1024)


def _every(text: str) -> int:
    """K of "every:K"; 0 where it is none."""
    number = text.removeprefix("every:")
    return int(number) if number != text and number.isascii() and number.isdigit() else 0


def _colour(text: str) -> bool:
    parts = text.split(",")
    return len(parts) == 3 and all(0 <= float(part) <= 1 for part in parts)


@dataclass(frozen=True)
class Settings:
    """Values in the units that `splatcore info --keys` prints."""

    background: str = key("0,0,0", "R,G,B", "0..1 each", "colour behind everything", _colour)
    antialias: str = key(
        "auto", "", "auto|on|off", "opacity compensation; auto does what the scene file asks for",
        one_of("auto", "on", "off"),
    )  # fmt: skip
    capacity: int = key(
        1 << 20, "entries", "256..1048576", "longest table of a tile; a longer one keeps the nearest",
        between(params.CHUNK, 1 << 20),
    )  # fmt: skip
    cut_share: float = key(
        0.5, "", "0..1", "share of incoming entries above which a frame is sorted from scratch", between(0, 1)
    )
    cut_angle: float = key(
        15.0, "degrees", "0..180", "turn of the camera in one frame above which it counts as a cut", between(0, 180)
    )
    rebuild_share: str = key(
        "auto", "", "auto|0..1",
        "share of incoming entries above which a tile is rebuilt; auto: 0.5 with late sort, else 1",
        lambda text: text == "auto" or 0 <= float(text) <= 1,
    )  # fmt: skip
    depth: str = key(
        "auto", "", "auto|deferred|consistent|fresh|predicted",
        "keys of a reused table: the last frame's, incoming ones this frame's (deferred) or the last one's too "
        "(consistent); this frame's, by a pass of its own (fresh); as predicted in the last frame (predicted). "
        "auto: consistent with late sort, else deferred",
        one_of("auto", "deferred", "consistent", "fresh", "predicted"),
    )  # fmt: skip
    passes: int = key(1, "passes", "1..4", "over a reused table in a frame, chunk by chunk", between(1, 4))
    chunk: int = key(params.CHUNK, "entries", "64|128|256|512|1024", "sorted on chip at once", one_of(*CHUNKS))
    refresh: str = key(
        "all", "", "all|none|every:K",
        "entries behind the point where every pixel of a tile is done: fetched and updated in all frames, in none, in "
        "every K-th",
        lambda text: text in ("all", "none") or _every(text) > 0,
    )  # fmt: skip
    sh_degree: int = key(
        DEGREE_MAX, "", "0..3", "harmonics above it are neither read nor evaluated", between(0, DEGREE_MAX)
    )
    colour_every: int = key(
        1, "frames", "1..1024", "approximate: the colour of a Gaussian in sight is kept that long", between(1, 1024)
    )
    motion_scale: float = key(
        0.0, "scene units a metre", ">= 0", "of a recorded path; 0: the scene's own, else 1",
        lambda value: 0 <= value < float("inf"),
    )  # fmt: skip
    read_latency: int = key(
        40, "cycles", "1..4096", "memory of the co-simulation: address to first beat", between(1, 4096)
    )
    write_latency: int = key(
        20, "cycles", "1..4096", "memory of the co-simulation: last beat to response", between(1, 4096)
    )
    answer_jitter: int = key(
        0, "cycles", "0..4096", "of that memory: each answer up to this much later, from --seed", between(0, 4096)
    )

    def antialias_mode(self) -> bool | None:
        """What projection.project takes: None leaves it to the scene."""
        return {"auto": None, "on": True, "off": False}[self.antialias]

    def formats(self) -> Formats:
        """The number formats."""
        return formats.REFERENCE

    def background_codes(self) -> tuple[int, int, int]:
        """UQ3.COLOUR_F codes of the background."""
        red, green, blue = (round(float(part) * 2 ** self.formats().colour_f) for part in self.background.split(","))
        return red, green, blue

    def background_colour(self) -> tuple[float, float, float]:
        """The background as the hardware sees it: its codes as real numbers."""
        red, green, blue = self.background_codes()
        unit = 2.0 ** -self.formats().colour_f
        return red * unit, green * unit, blue * unit

    def rebuild_limit(self, late: bool) -> float:
        """rebuild_share as a number."""
        if self.rebuild_share == "auto":
            return 0.5 if late else 1.0
        return float(self.rebuild_share)

    def depth_rule(self, late: bool) -> str:
        """depth: deferred, consistent, fresh or predicted."""
        if self.depth == "auto":
            return "consistent" if late else "deferred"
        return self.depth

    def refreshes(self, number: int) -> bool:
        """Are all entries updated in frame `number`, counted from 0?"""
        return self.refresh == "all" or (self.refresh != "none" and number % _every(self.refresh) == 0)


def parse(pairs: list[str]) -> Settings:
    """Settings from "KEY=VALUE" texts; InputError names the key, the value and what is valid."""
    return keys.change(Settings(), pairs)
