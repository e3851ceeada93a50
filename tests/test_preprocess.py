"""Projection, culling and colour against references written from the formulas with 60 digits.

References use none of the code under test; golden/hard_cases/exact.py is the projection. P01 to P14 stand beside it.
"""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from mpmath import mp, mpf

from golden.cameras.camera import Camera, look_at
from golden.formats import REFERENCE
from golden.hard_cases import exact
from golden.hard_cases.setting import camera_a, gaussians
from golden.preprocess import encode, project
from golden.preprocess.colour import colours
from golden.preprocess.projection import depths
from golden.raster_core.row_reach import limit
from golden.scene.gaussians import Gaussians

DIAGONAL = (0.9238795, 0, 0, 0.3826834)  # 45 degrees about z


@pytest.fixture(autouse=True)
def digits():
    with mp.workdps(60):
        yield


def random_scene(n: int, seed: int, terms: int = 1, antialias: bool = False) -> Gaussians:
    """Around a camera at the origin: some behind it, some beside the picture; needles, disks, a few huge ones."""
    r = np.random.default_rng(seed)
    means = r.uniform([-4, -3, -1], [4, 3, 9], (n, 3))
    scales = np.exp(r.normal(-3, 1.7, (n, 3)))
    sh = r.normal(0, 0.4, (n, terms, 3)).astype(np.float32)
    return Gaussians("random", means, scales, r.normal(size=(n, 4)), r.beta(0.7, 0.7, n), sh, antialias)


def tilted(width: int = 200, height: int = 136) -> Camera:
    """Rotated, off-centre principal point, fx != fy."""
    c = look_at((0.3, -0.2, -1), (0.5, 0.3, 5), (0.1, -1, 0.2), 50, width, height)
    return Camera(width, height, 170.0, 150.0, 91.3, 77.7, c.rotation, c.position)


# ---- projection


@pytest.mark.parametrize("seed", range(3))
def test_projection_equals_60_digits(seed):
    p = project(random_scene(60, seed), tilted())
    assert p.visible.any() and exact.worst(p, random_scene(60, seed), tilted()) < 1e-12


def test_depths_are_those_of_the_projection():
    scene = random_scene(1000, 5)
    assert np.array_equal(depths(scene, tilted()), project(scene, tilted()).depth)


def test_compensation_equals_60_digits():
    scene, camera = random_scene(60, 7), tilted()
    plain, compensated = project(scene, camera, False), project(scene, camera, True)
    for i in np.flatnonzero(compensated.visible):
        r = exact.project(scene, int(i), camera)
        factor = mpmath.sqrt(r.raw / r.det)
        assert exact.relative(compensated.opacity[i] / plain.opacity[i], factor) < 1e-9


def test_every_gaussian_is_counted_once():
    scene = random_scene(5000, 11)
    p = project(scene, tilted())
    assert sum(p.counters.values()) == 5000 and p.counters["visible"] == p.visible.sum()
    assert p.counters["culled_near"] == (p.depth <= 0.2).sum()


def test_offscreen_means_no_pixel_reaches_the_cut():
    camera = camera_a()
    scene = random_scene(3000, 13)
    p = project(scene, camera)
    inside = Camera(1500, 1500, 128, 128, 750, 750, camera.rotation, camera.position)  # room around the same view
    out, reached = 0, 0
    ys, xs = np.mgrid[0:128, 0:128] + 0.5
    for i in np.flatnonzero(~p.visible & (p.depth > 0.2) & (scene.opacities > 1 / 255)):
        r = exact.project(scene, int(i), camera)
        conic = np.linalg.inv(np.array([[float(v) for v in row] for row in r.cov.tolist()]))
        dx, dy = xs - float(r.x), ys - float(r.y)
        q = conic[0, 0] * dx**2 + 2 * conic[0, 1] * dx * dy + conic[1, 1] * dy**2
        reached += (scene.opacities[i] * np.exp(-q / 2)).max() >= 1 / 255
        out += 1
    assert out > 100 and reached == 0
    assert project(scene, inside).visible.sum() > p.visible.sum()


def test_p12_opacity_around_the_cut():
    code = 2.0 ** (2.0**-REFERENCE.opacity_f)
    logit = 1 / (1 + math.exp(-float(np.float32(-math.log(254)))))  # 1/255 as a float32 logit in a file
    opacities = np.array([0, 1 / 255 / code, 1 / 255, 1 / 255 * code, 1, logit])
    p = project(gaussians([(0, 0, 2)] * 6, scales=0.05, opacities=opacities), camera_a())
    assert list(p.visible) == [False, False, True, True, True, True] and p.counters["culled_alpha"] == 2
    f = encode(REFERENCE, p)
    assert f.opacity[2] == f.opacity[5] == REFERENCE.cut >> 1
    assert (
        f.opacity[4] == 0 and (limit(REFERENCE, int(f.opacity[2])) >= 0) and (limit(REFERENCE, int(f.opacity[0])) < 0)
    )


def test_p14_geo_referenced_scene_gives_the_same_bits():
    r = np.random.default_rng(14)
    means = np.round(r.uniform([-3, -3, 1], [3, 3, 9], (1000, 3)) * 2**20) / 2**20
    near = random_scene(1000, 14, terms=16)
    shift = np.array([6378137.0, 4200000.0, 512.0])
    here = Gaussians("here", means, near.scales, near.quats, near.opacities, near.sh)
    there = Gaussians("there", means + shift, near.scales, near.quats, near.opacities, near.sh)
    camera = tilted()
    position = np.round(camera.position * 2**20) / 2**20
    a = project(here, Camera(*view(camera), camera.rotation, position))
    b = project(there, Camera(*view(camera), camera.rotation, position + shift))
    assert a.counters["visible"] > 300
    for name in ("mean2d", "cov2d", "det", "depth", "opacity", "colour", "visible"):
        assert np.array_equal(getattr(a, name), getattr(b, name)), name


def view(c: Camera) -> tuple:
    return c.width, c.height, c.fx, c.fy, c.cx, c.cy


# ---- colour


def real_harmonic(k: int, d) -> float:
    """Term k of the files' basis: sqrt(2) Im / Re of the complex harmonic with its Condon-Shortley sign."""
    degree = math.isqrt(k)
    m = k - degree * degree - degree
    theta, phi = mpmath.acos(mpf(float(d[2]))), mpmath.atan2(mpf(float(d[1])), mpf(float(d[0])))
    y = mpmath.spherharm(degree, abs(m), theta, phi)
    return float(y.real if m == 0 else mpmath.sqrt(2) * (y.real if m > 0 else y.imag))


@pytest.mark.parametrize("terms", [1, 4, 9, 16])
def test_colour_equals_spherical_harmonics(terms):
    scene, camera = random_scene(12, terms, terms), tilted()
    seen = colours(scene, camera)
    for i in range(len(scene.means)):
        d = scene.means[i] - camera.position
        d = d / np.linalg.norm(d)
        basis = np.array([real_harmonic(k, d) for k in range(terms)])
        assert np.abs(seen[i] - np.maximum(basis @ scene.sh[i].astype(float) + 0.5, 0)).max() < 1e-13


def test_colour_at_the_camera_is_finite():
    scene = random_scene(2, 1, 16)
    camera = Camera(64, 64, 64, 64, 32, 32, np.eye(3), scene.means[0])
    assert np.isfinite(colours(scene, camera)).all()
