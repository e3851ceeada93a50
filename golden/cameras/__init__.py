"""Cameras: what the command line says about them, and a view for scenes that come without one (docs/cameras.md)."""

from __future__ import annotations

import math
import re

import numpy as np

from golden.cameras.camera import Camera, look_at
from golden.cameras.paths import path
from golden.cameras.readers import RELATIVE, kind_of, place, read
from golden.errors import InputError
from golden.scene import builtin
from golden.scene.files import one_line
from golden.scene.gaussians import Gaussians

__all__ = [
    "RELATIVE",
    "Camera",
    "default_view",
    "kind_of",
    "look_at",
    "parse_camera",
    "parse_frames",
    "parse_size",
    "path",
    "place",
    "read",
    "scene_scale",
]

SIZES = {"hd": (1280, 720), "fhd": (1920, 1080), "qhd": (2560, 1440)}
SIDE_MAX = 8191  # pixels: a size is a register of 13 bits
FRAME_MAX = 1_000_000
View = builtin.View

# Public captures whose coordinates no rule could guess: (name, view, world units a metre), see docs/cameras.md
KNOWN: dict[str, tuple[View, float]] = {
    "ukstreet": (((0, -0.3, -5), (0, -0.2477, -4.0014), (0, -1, 0), 60.0), 1 / 15),
    "flowers_lod0": (((0.05, -0.22, -0.48), (0, -0.09, 0), (0, -1, 0), 50.0), 0.3),
    "fox": (((2.6, -2.6, 2.0), (0, 0, 1.25), (0, 0, 1), 45.0), 1.0),
}
INSIDE = 4.0  # a scene whose far points lie this many times beyond its middle half surrounds the camera


def parse_size(text: str) -> tuple[int, int]:
    """(width, height) of 640x384, hd, fhd or qhd."""
    if text.lower() in SIZES:
        return SIZES[text.lower()]
    match = re.fullmatch(r"([0-9]{1,9})[xX]([0-9]{1,9})", text)
    if not match or not all(1 <= int(side) <= SIDE_MAX for side in match.groups()):
        raise InputError(
            f"--size {one_line(text)}: WIDTHxHEIGHT with sides of 1 to {SIDE_MAX}, or {', '.join(SIZES)} is needed"
        )
    return int(match[1]), int(match[2])


def parse_frames(text: str) -> range:
    """N frames from 0, or A:B from A up to B - 1."""
    match = re.fullmatch(r"(?:([0-9]{1,9}):)?([0-9]{1,9})", text)
    first, last = (int(match[1] or 0), int(match[2])) if match else (0, 0)
    if not 0 <= first < last <= FRAME_MAX:
        raise InputError(f"--frames {one_line(text)}: N, or A:B with A below B, up to {FRAME_MAX} is needed")
    return range(first, last)


def parse_camera(text: str) -> View:
    """(eye, look-at, up, fovy) of EX,EY,EZ/AX,AY,AZ/UX,UY,UZ/FOVY."""
    form = "EX,EY,EZ/AX,AY,AZ/UX,UY,UZ/FOVY is needed"
    groups = [group.split(",") for group in text.split("/")]
    if [len(g) for g in groups] != [3, 3, 3, 1]:
        raise InputError(f"--camera {one_line(text)}: {form}")
    values = []
    for word in (w for g in groups for w in g):
        try:
            values.append(float(word))
        except ValueError:
            values.append(math.nan)
        if not math.isfinite(values[-1]):
            raise InputError(f"--camera {one_line(text)}: '{one_line(word)}' is no finite number, {form}")
    eye, at, up = (tuple(values[k : k + 3]) for k in (0, 3, 6))
    look_at(eye, at, up, values[9], 1, 1)  # names a view that is no view
    return eye, at, up, values[9]


def known(scene: Gaussians) -> tuple[View, float] | None:
    return None if scene.source.startswith("builtin:") else KNOWN.get(scene.name)


def default_view(scene: Gaussians) -> View:
    """(eye, look-at, up, fovy) for a scene without --camera.

    Built-in and a few public scenes have their own. Else y is taken to point down (up for .spz), and percentiles
    decide: a scene with a far background is seen from its middle, level; an object from outside, slightly above.
    """
    if scene.source.startswith("builtin:"):
        return builtin.default_view(scene.name)
    if known(scene):
        return known(scene)[0]
    up = (0.0, 1.0, 0.0) if scene.source.lower().endswith(".spz") else (0.0, -1.0, 0.0)
    seen = scene.means[scene.opacities >= 0.1]
    seen = seen if len(seen) else scene.means
    if not len(seen):
        return (0.0, 0.0, -3.0), (0.0, 0.0, 0.0), up, 60.0
    centre = np.median(seen, axis=0)
    with np.errstate(over="ignore", invalid="ignore"):
        distance = np.linalg.norm(seen - centre, axis=1)
        half, most, far = np.percentile(distance, [50, 90, 99])
    if not np.isfinite(far):
        raise InputError(
            f"{scene.source or scene.name}: positions reach {np.abs(seen).max():.3g}, too far for a view of its own;"
            " --camera is needed"
        )
    ahead = np.array([0.0, 0.0, 1.0])
    if far > INSIDE * half:
        eye, at = centre, centre + ahead * max(half, 1e-6)
    else:
        reach = max(float(most), 10 * float(np.median(scene.scales)), 0.5)  # not nearer than the near plane allows
        eye, at = centre + np.array([0.3, 0.0, -1.0]) * 2.2 * reach + np.array(up) * 0.6 * reach, centre
    return tuple(map(float, eye)), tuple(map(float, at)), up, 60.0


def scene_scale(scene: Gaussians) -> float | None:
    """World units a metre where known, else None (paths then take the look-at point to be 3 m away)."""
    if scene.source.startswith("builtin:"):
        return builtin.scale(scene.name)
    return known(scene)[1] if known(scene) else None
