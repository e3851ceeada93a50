"""Random scenes, cameras and settings, extremes included, as hypothesis strategies."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
from hypothesis import strategies as st

from golden import keys
from golden.cameras.camera import Camera, matrices
from golden.scene.gaussians import Gaussians, checked
from golden.settings import Settings

HUGE = [0.0, -0.0, 5e-324, 1e-310, 1e-30, 1e-9, 1e9, 1e30, -1e30, 1e150, 1e300, np.inf, -np.inf, np.nan]
NEAR = st.floats(-3, 3, width=32)
POSITION = st.tuples(NEAR, NEAR, st.floats(-0.5, 9, width=32)) | st.tuples(*[st.sampled_from(HUGE) | NEAR] * 3)
EXTENT = st.floats(-6, 1).map(np.exp)
SCALE = st.tuples(*[EXTENT] * 3) | st.tuples(*[st.sampled_from(HUGE) | EXTENT] * 3)
QUATERNION = st.tuples(*[st.floats(-1, 1)] * 4) | st.tuples(*[st.sampled_from([0.0, 1.0, 1e-140, 1e-200, 1e140])] * 4)
OPACITY = st.floats(0, 1) | st.sampled_from(
    [0.0, 5e-324, 1 / 256, 1 / 255.5, 1 / 255, 0.0040, 0.99, 0.9999, 1.0, np.nan]
)
COLOUR = st.floats(-4, 4, width=32) | st.sampled_from([0.0, 40.0, -1e38, 3e38, 1e-45, np.inf])
GAUSSIAN = st.tuples(POSITION, SCALE, QUATERNION, OPACITY, st.tuples(*[COLOUR] * 3), st.integers(0, 1 << 16))


def crowd(rng: np.random.Generator, n: int) -> tuple[np.ndarray, ...]:
    """Rows of n ordinary Gaussians before a camera at the origin; a quarter of the depths twice."""
    means = rng.uniform((-3, -3, 0.1), (3, 3, 8), (n, 3))
    means[n // 2 : n // 2 + n // 4, 2] = means[: n // 4, 2]
    scales = np.exp(rng.uniform(-5, 0, (n, 3)))
    return means, scales, rng.normal(size=(n, 4)), rng.uniform(0, 1, n), rng.uniform(-1, 3, (n, 1, 3))


@st.composite
def scenes(draw, most: int = 600) -> Gaussians:
    """Up to 8 Gaussians of any values among up to `most` ordinary ones, in random order, as a reader hands them on."""
    rng = np.random.default_rng(draw(st.integers(0, 1 << 32)))
    rows = draw(st.lists(GAUSSIAN, max_size=8))
    n = draw(st.sampled_from([0, 1, 30, 255, 256, 257, most]) | st.integers(0, most))
    parts = [list(part) for part in crowd(rng, min(n, most))]
    for place, extent, turn, opacity, colour, _ in rows:
        for part, value in zip(parts, (place, extent, turn, opacity, [colour]), strict=True):
            part.append(np.array(value))
    order = rng.permutation(len(parts[0]))
    columns = [np.array(part, np.float64).reshape(len(order), *shape)[order] for part, shape in
               zip(parts, ((3,), (3,), (4,), (), (1, 3)), strict=True)]  # fmt: skip
    degree = draw(st.integers(0, 3))
    rest = rng.normal(0, 0.2, (len(order), (degree + 1) ** 2 - 1, 3))
    columns[4] = np.concatenate([columns[4], rest], axis=1)
    return checked("fuzz", *columns, antialias=draw(st.booleans()))


@st.composite
def cameras(draw, most: int = 200) -> Camera:
    """Any pose, lens and principal point; pictures of 1 to `most` pixels a side."""
    side = st.sampled_from([1, 2, 7, 8, 9, 63, 64, 65, 128, most]) | st.integers(1, most)
    width, height = min(draw(side), most), min(draw(side), most)
    focal = st.floats(0.2, 3).map(lambda f: f * width) | st.sampled_from([1e-3, 0.5, 1e3, 1e5, 1e7])
    fx = draw(focal)
    fy = fx if draw(st.booleans()) else draw(focal)
    cx, cy = (draw(st.just(size / 2) | st.floats(-2.0 * size, 3.0 * size)) for size in (width, height))
    rng = np.random.default_rng(draw(st.integers(0, 1 << 32)))
    turn = draw(st.sampled_from([0.0, 0.01, 0.3, 3.0]))
    quaternion = rng.normal(size=4) * turn + (1, 0, 0, 0)
    position = rng.normal(size=3) * draw(st.sampled_from([0.0, 0.1, 1.0, 1e5, 1e12]))
    rotation = matrices(quaternion / np.linalg.norm(quaternion))
    return Camera(width, height, fx, fy, cx, cy, rotation, position, draw(st.sampled_from([0.2, 0.01, 1e-6])))


@st.composite
def paths(draw, most: int = 200) -> list[tuple[Camera, bool]]:
    """Up to 5 frames, (camera, declared cut): small steps, pauses, jumps, other sizes."""
    frames = [(draw(cameras(most)), False)]
    for _ in range(draw(st.integers(0, 4))):
        kind = draw(st.sampled_from(["step", "step", "rest", "jump", "cut"]))
        camera, _ = frames[-1]
        if kind == "step":
            q = np.array([1, *np.random.default_rng(draw(st.integers(0, 99))).normal(0, 0.02, 3)])
            turned = matrices(q / np.linalg.norm(q)) @ camera.rotation
            moved = camera.position + 0.02 * turned[0]
            camera = Camera(*(getattr(camera, name) for name in ("width", "height", "fx", "fy", "cx", "cy")), turned,
                            moved, camera.near)  # fmt: skip
        elif kind in ("jump", "cut"):
            camera = draw(cameras(most))
        frames.append((camera, kind == "cut"))
    return frames


def values(owner, name: str) -> list[str]:
    """Legal values of a key as texts, from what it says of itself: its words, its range's ends, a few more."""
    spec = keys.known(owner)[name]
    valid = spec.metadata["valid"]
    numbers = [float(x) for x in re.findall(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?", valid.replace("..", " "))]
    texts = [str(getattr(owner, name)), *re.split(r"[|, ]", valid), *("0.25,1,0.75", "1,1,1")]
    for low, high in pairwise(numbers):
        texts += [f"{x:g}" for x in (low, high, (low + high) / 2)] + [
            str(int(x)) for x in (low, high, (low + high) / 2)
        ]
    texts += ["0", "1", "2", "3", "16", "300", "every:3"]
    return sorted({text for text in texts if legal(owner, f"{name}={text}")})


def legal(owner, pair: str) -> bool:
    from golden.errors import InputError

    try:
        keys.change(owner, [pair])
    except InputError:
        return False
    return True


CHOICES = {name: values(Settings(), name) for name in keys.known(Settings())}


@st.composite
def settings(draw) -> list[str]:
    """--set pairs, each legal by itself."""
    names = draw(st.lists(st.sampled_from(sorted(CHOICES)), unique=True, max_size=5))
    return [f"{name}={draw(st.sampled_from(CHOICES[name]))}" for name in names]
