"""A thousand frames of motion, rests, jumps, cuts and other sizes: invariants hold, no drift, no growth."""

from __future__ import annotations

import resource
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from golden.cameras.camera import Camera
from golden.frame import Renderer
from golden.hard_cases.setting import camera_a, yaw
from golden.settings import Settings
from tests.fuzz.properties import check_frame
from tests.hard_cases.test_tables import crowd

FRAMES = 1000
WARM = 200  # frames until everything that is kept has been made once
GROWTH = 16 << 20  # bytes
SIZES = ((96, 64), (65, 130), (128, 128))


def walk(seed: int) -> Iterator[tuple[Camera, bool]]:
    """(camera, declared cut): 12 of 16 spells of 10 frames turn by up to 1.5 degrees a frame, the others do not."""
    rng = np.random.default_rng(seed)
    angle, size = 0.0, SIZES[0]
    for spell in range(FRAMES // 10):
        kind = ("rest", "jump", "cut", "size")[spell // 4 % 4] if spell % 4 == 3 else "turn"
        speed = 0.0 if kind == "rest" else rng.uniform(-1.5, 1.5)
        if kind in ("jump", "cut"):
            angle = rng.uniform(-30, 30)
        if kind == "size":
            size = SIZES[int(rng.integers(3))]
        for k in range(10):
            angle += speed
            place = 0.3 * np.sin(np.radians((3 * angle, 7 * angle, 5 * angle)))
            yield camera_a(*size, rotation=yaw(angle), position=place), kind == "cut" and k == 0


def resident() -> int:
    """Bytes in memory now. (The peak would be that of an earlier test of the same process.)"""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


@pytest.mark.slow
@pytest.mark.parametrize("late", [False, True], ids=["reuse", "late"])
def test_a_thousand_frames(late):
    scene = crowd(41, 1500)
    renderer, exact = Renderer(scene, Settings(), late=late), Renderer(scene, Settings(), "full")
    errors, anew, held = [], 0, 0
    for number, (camera, cut) in enumerate(walk(1)):
        frame = renderer.frame(camera, cut)
        check_frame(frame, len(scene))
        errors.append(float(np.square(frame.image - exact.frame(camera).image).mean()))
        anew += frame.counters["full_frames"]
        if number == WARM:
            held = resident()
    assert resident() - held < GROWTH
    assert number == FRAMES - 1 and 10 < anew < 40
    first, *others = (np.mean(third) for third in np.array_split(errors, 3))
    assert 0 < max(others) < 2 * first
