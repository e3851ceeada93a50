"""Feature records against the conic with 60 digits, and what rounding its factors does to alpha."""

from __future__ import annotations

import math
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
from mpmath import mp, mpf

from golden import records
from golden.formats import REFERENCE, record_offsets
from golden.hard_cases import exact
from golden.hard_cases.setting import camera_a, gaussians
from golden.preprocess import encode, project
from golden.raster_core.row_reach import limit
from tests.test_preprocess import random_scene, tilted


@pytest.fixture(autouse=True)
def digits():
    with mp.workdps(60):
        yield


def test_codes_are_within_half_a_step_of_the_conic():
    scene, camera = random_scene(80, 21), tilted()
    p = project(scene, camera)
    f = encode(REFERENCE, p)
    scale = mpmath.log(mpmath.e, 2) / 2
    checks = 0
    for i in np.flatnonzero(f.visible):
        r = exact.project(scene, int(i), camera)
        conic = r.cov**-1
        a = mpmath.sqrt(scale * conic[0, 0])
        b = scale * conic[0, 1] / a
        c = mpmath.sqrt(scale * conic[1, 1] - b * b)
        for code, truth in zip(f.chol[i], (a, b, c)):
            assert abs(int(code) - truth * 2**REFERENCE.chol_f) <= 0.5 + 1e-6
        assert abs(int(f.mean[i, 0]) - r.x * 1024) <= 0.5 + 1e-6
        assert abs(int(f.mean[i, 1]) - r.y * 1024) <= 0.5 + 1e-6
        assert abs(int(f.opacity[i]) + mpmath.log(mpf(float(p.opacity[i])), 2) * 8192) <= 0.5 + 1e-6
        checks += 1
    assert checks > 20
    assert np.array_equal(f.key[f.visible], records.depth_key(REFERENCE, p.depth[f.visible]))


def test_records_hold_what_was_encoded():
    f = encode(REFERENCE, project(random_scene(500, 22), tilted()))
    raw = records.record_bytes(REFERENCE, f)
    for i in np.flatnonzero(f.visible)[:50]:
        word = int.from_bytes(raw[i].tobytes(), "little")
        for name, (low, width) in record_offsets(REFERENCE).items():
            code = int(records.columns(REFERENCE, f)[name][i])
            assert (word >> low) & ((1 << width) - 1) == code & ((1 << width) - 1), name
            signed = name in ("mean_x", "mean_y", "chol_b")
            assert (-(1 << width - 1) <= code < 1 << width - 1) if signed else (0 <= code < 1 << width)


def test_invisible_records_never_hit():
    f = encode(REFERENCE, project(random_scene(2000, 23), tilted()))
    assert (~f.visible).sum() > 100
    assert all(limit(REFERENCE, int(o)) < 0 for o in f.opacity[~f.visible])


def test_what_does_not_fit_is_counted():
    scene = gaussians(
        [(130, 0, 2), (0, 0, 2), (0, 0, 2.0**30), (0, 0, 3)],
        scales=[(200, 200, 200), (0.1, 0.1, 0.1), (2.0**29, 2.0**29, 2.0**29), (0.1, 0.1, 0.1)],
        colours=[(1, 1, 1), (8, 0, 0), (1, 1, 1), (3.9, 3.9, 3.9)],
    )
    p = project(scene, camera_a())
    f = encode(REFERENCE, p)
    assert p.visible.all() and list(f.visible) == [False, True, True, True]
    assert f.counters == {"culled_range": 1, "clamped_colour": 1, "clamped_depth": 1}
    assert f.colour[1, 0] == 7680 and f.key[2] == (1 << REFERENCE.key_w) - 1


def alpha_error(sigma: float, aspect: float, angle: float) -> float:
    """Largest |alpha - exact alpha| over a grid of the ellipse, footprint taken from its codes, opacity 1."""
    small = max(sigma / aspect, 0.0)
    cos, sin = math.cos(angle), math.sin(angle)
    xx = (sigma * cos) ** 2 + (small * sin) ** 2 + 0.3
    yy = (sigma * sin) ** 2 + (small * cos) ** 2 + 0.3
    xy = (sigma**2 - small**2) * cos * sin
    det = (sigma * small) ** 2 + 0.3 * (sigma**2 + small**2) + 0.09
    p = SimpleNamespace(
        mean2d=np.zeros((1, 2)), cov2d=np.array([[xx, xy, yy]]), det=np.array([det]), depth=np.ones(1),
        opacity=np.ones(1), colour=np.zeros((1, 3)), visible=np.ones(1, bool),
    )  # fmt: skip
    a, b, c = encode(REFERENCE, p).chol[0] / 2.0**REFERENCE.chol_f
    radius, turn = np.meshgrid(np.linspace(0, 3.4, 60), np.linspace(0, 2 * np.pi, 72))
    long, short = radius * np.cos(turn) * math.sqrt(sigma**2 + 0.3), radius * np.sin(turn) * math.sqrt(small**2 + 0.3)
    dx, dy = long * cos - short * sin, long * sin + short * cos
    exact = np.exp(-0.5 * radius**2)
    return float(np.abs(np.exp2(-((a * dx + b * dy) ** 2) - (c * dy) ** 2) - exact).max())


@pytest.mark.parametrize(("sigma", "bits"), [(10, 17), (50, 15), (200, 13), (1000, 11), (2500, 9)])
def test_footprint_codes_keep_alpha(sigma, bits):
    worst = max(
        alpha_error(sigma, aspect, angle)
        for aspect in (1, 2, 10, 100, 1e3, 1e5)
        for angle in np.linspace(0, np.pi, 37) + 0.01
    )
    assert worst <= 2.0**-bits
