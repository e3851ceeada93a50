"""Every setting that changes the picture or the time: one table, the `--set KEY=VALUE` keys of the command line."""

from __future__ import annotations

import inspect
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
    setting: str = key(
        "reference", "", "small|reference|wide", "sets the bits below (docs/formats.md); later keys change single ones",
        one_of(*formats.PRESETS),
    )  # fmt: skip
    mean_bits: int = key(10, "fraction bits", "2..14", "screen position, pixels", between(2, 14))
    footprint_bits: int = key(20, "fraction bits", "13..26", "footprint a, b, c", between(13, 26))
    opacity_bits: int = key(13, "fraction bits", "4..18", "-log2 of the opacity", between(4, 18))
    colour_bits: int = key(10, "fraction bits", "4..14", "colour", between(4, 14))
    key_bits: int = key(23, "bits", "8..31", "depth key; an entry has whole bytes", between(8, 31))
    key_kind: str = key(
        "float", "", "float|log|linear|half",
        "depth key: 5 exponent bits, logarithm (both 0.125 to 2^29), linear from 0.2 to the first frame's largest "
        "depth, IEEE half (16 bits)",
        one_of(*formats.KEY_KINDS),
    )  # fmt: skip
    alpha_bits: int = key(16, "fraction bits", "6..20", "alpha", between(6, 20))
    transmittance_bits: int = key(18, "fraction bits", "8..26", "transmittance", between(8, 26))
    accumulator_bits: int = key(20, "fraction bits", "8..28", "colour accumulator", between(8, 28))
    exp_segments: int = key(
        16, "lines", "2|4|8|16|32|64|128|256", "of the table for 2^-p", one_of(*formats.EXP_SEGMENTS)
    )
    exp_bits: int = key(18, "fraction bits", "8..24", "of 2^-p", one_of(*formats.EXP_BITS))
    alpha_cut: float = key(255.0, "1/alpha", "2..16384", "a pixel with a smaller alpha is skipped", between(2, 16384))
    stop_threshold: float = key(1e-4, "", "0..0.5", "a pixel is done when its transmittance is below", between(0, 0.5))
    stop_rule: str = key(
        "blend-last", "", "blend-last|drop-last", "what becomes of the layer that does it", one_of(*formats.STOP_RULES)
    )
    bound: str = key(
        "exact", "", "exact|box|oriented|circle",
        "what a Gaussian is taken to touch: pixels above the cut, their bounding box, a 3-sigma box along its axes, a "
        "3-sigma circle",
        one_of(*formats.BOUNDS),
    )  # fmt: skip
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
        """The number formats; InputError where the bits do not go together."""
        names = inspect.signature(formats.make).parameters
        return formats.make(**{name: getattr(self, name) for name in names})

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
    single = []
    for pair in pairs:
        name, _, value = pair.partition("=")
        bits = formats.PRESETS.get(value, {}) if name == "setting" else {}
        single += [pair, *(f"{bit}={number}" for bit, number in bits.items())]
    settings = keys.change(Settings(), single)
    settings.formats()
    return settings
