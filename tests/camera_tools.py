"""What the camera tests share."""

import numpy as np
import pytest

from golden import cameras
from golden.errors import InputError

START = cameras.look_at((1.0, -2.0, -4.0), (0.5, -1.0, 3.0), (0, -1, 0), 60, 640, 384)
TARGET = np.array([0.5, -1.0, 3.0])


def refused(words: tuple, call, *arguments) -> None:
    with pytest.raises(InputError) as caught:
        call(*arguments)
    assert "\n" not in str(caught.value) and all(w in str(caught.value) for w in words), caught.value


def turn_between(a, b) -> float:
    """Degrees between two cameras."""
    return float(np.degrees(np.arccos(np.clip((np.trace(b.rotation @ a.rotation.T) - 1) / 2, -1, 1))))


def random_cameras(n: int, seed: int = 0) -> list[cameras.Camera]:
    rng = np.random.default_rng(seed)
    return [cameras.look_at(rng.normal(size=3), rng.normal(size=3), rng.normal(size=3), 50, 64, 48) for _ in range(n)]
