"""Projection, culling and colour against references written from the formulas with 60 digits.

References use none of the code under test. Bounds are those of the hard cases D-P01..P14, or tighter.
"""

from __future__ import annotations

import math
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
from mpmath import mp, mpf

from golden.cameras.camera import Camera, look_at
from golden.formats import REFERENCE
from golden.preprocess import encode, project
from golden.preprocess.colour import colours
from golden.preprocess.projection import depths
from golden.raster_core.intersection_test_unit import bound
from golden.scene.gaussians import Gaussians, checked
from tests.hard_cases.setting import camera_a, gaussians, merge

DIAGONAL = (0.9238795, 0, 0, 0.3826834)  # 45 degrees about z


@pytest.fixture(autouse=True)
def digits():
    with mp.workdps(60):
        yield


# ---- references


def matrix(rows):
    return mpmath.matrix([[mpf(float(x)) for x in row] for row in rows])


def reference(scene: Gaussians, i: int, camera: Camera) -> SimpleNamespace:
    """Section 3.1 of the conventions with 60 digits: x, y, cov (2x2 mpmath matrix), det, raw det, z."""
    w, x, y, z = (mpf(float(v)) for v in scene.quats[i])
    n = mpmath.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / n, x / n, y / n, z / n
    spin = mpmath.matrix(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )
    v = spin * mpmath.diag([mpf(float(s)) ** 2 for s in scene.scales[i]]) * spin.T
    view = matrix(camera.rotation)
    t = view * (matrix([[m] for m in scene.means[i]]) - matrix([[m] for m in camera.position]))
    fx, fy = mpf(float(camera.fx)), mpf(float(camera.fy))
    limit_x = mpf(13) / 10 * camera.width / (2 * fx)
    limit_y = mpf(13) / 10 * camera.height / (2 * fy)
    tx = min(max(t[0] / t[2], -limit_x), limit_x) * t[2]
    ty = min(max(t[1] / t[2], -limit_y), limit_y) * t[2]
    jacobian = mpmath.matrix([[fx / t[2], 0, -fx * tx / t[2] ** 2], [0, fy / t[2], -fy * ty / t[2] ** 2]])
    raw = jacobian * view * v * view.T * jacobian.T
    cov = raw + mpmath.eye(2) * mpf("0.3")
    return SimpleNamespace(
        x=fx * t[0] / t[2] + mpf(float(camera.cx)),
        y=fy * t[1] / t[2] + mpf(float(camera.cy)),
        z=t[2],
        cov=cov,
        det=cov[0, 0] * cov[1, 1] - cov[0, 1] ** 2,
        raw=raw[0, 0] * raw[1, 1] - raw[0, 1] ** 2,
    )


def relative(value, truth, scale=None) -> float:
    return float(abs(mpf(float(value)) - truth) / (abs(truth) if scale is None else scale))


def check_projection(scene: Gaussians, camera: Camera, bound: float = 1e-12) -> None:
    p = project(scene, camera)
    assert p.visible.any()
    for i in np.flatnonzero(p.visible):
        r = reference(scene, i, camera)
        across = mpmath.sqrt(r.cov[0, 0] * r.cov[1, 1])
        assert relative(p.mean2d[i, 0], r.x, 1 + abs(r.x)) < bound
        assert relative(p.mean2d[i, 1], r.y, 1 + abs(r.y)) < bound
        assert relative(p.depth[i], r.z) < bound
        assert relative(p.cov2d[i, 0], r.cov[0, 0]) < bound
        assert relative(p.cov2d[i, 1], r.cov[0, 1], across) < bound
        assert relative(p.cov2d[i, 2], r.cov[1, 1]) < bound
        assert relative(p.det[i], r.det) < bound


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
    check_projection(random_scene(60, seed), tilted())


def test_depths_are_those_of_the_projection():
    scene = random_scene(1000, 5)
    assert np.array_equal(depths(scene, tilted()), project(scene, tilted()).depth)


def test_compensation_equals_60_digits():
    scene, camera = random_scene(60, 7), tilted()
    plain, compensated = project(scene, camera, False), project(scene, camera, True)
    for i in np.flatnonzero(compensated.visible):
        r = reference(scene, i, camera)
        factor = mpmath.sqrt(r.raw / r.det)
        assert relative(compensated.opacity[i] / plain.opacity[i], factor) < 1e-9


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
        r = reference(scene, i, camera)
        conic = np.linalg.inv(np.array([[float(v) for v in row] for row in r.cov.tolist()]))
        dx, dy = xs - float(r.x), ys - float(r.y)
        q = conic[0, 0] * dx**2 + 2 * conic[0, 1] * dx * dy + conic[1, 1] * dy**2
        reached += (scene.opacities[i] * np.exp(-q / 2)).max() >= 1 / 255
        out += 1
    assert out > 100 and reached == 0
    assert project(scene, inside).visible.sum() > p.visible.sum()


def test_p01_at_the_camera_centre():
    p = project(merge(gaussians((0, 0, 0)), gaussians((0, 0, 2))), camera_a())
    assert p.counters["culled_near"] == 1 and list(p.visible) == [False, True]
    assert all(np.isfinite(a).all() for a in (p.mean2d, p.cov2d, p.det, p.depth, p.opacity, p.colour))


def test_p02_near_is_culled_and_the_next_float_is_not():
    z = [np.nextafter(0.2, 0), 0.2, np.nextafter(0.2, 1)]
    p = project(gaussians([(0, 0, v) for v in z], scales=0.01), camera_a())
    assert list(p.visible) == [False, False, True] and p.counters["culled_near"] == 2


def test_p04_clamped_jacobian_unclamped_mean():
    scene = gaussians((20, 0, 2), scales=1.0)
    wide = Camera(4000, 128, 128, 128, 64.0, 64.0, np.eye(3), np.zeros(3))
    assert project(scene, camera_a()).counters["culled_offscreen"] == 1
    r = reference(scene, 0, camera_a())
    assert float(r.x) == 1344 and abs(float(mpmath.sqrt(r.cov[0, 0])) - 76.3) < 0.1
    check_projection(scene, wide)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("sign", [-1, 1])
def test_p05_no_seam_at_the_clamp(axis, sign):
    means = np.zeros((2, 3))
    means[:, 2] = 2
    means[:, axis] = [sign * 2 * (0.65 - 2**-12), sign * 2 * (0.65 + 2**-12)]
    scene = gaussians(means, scales=0.5, opacities=0.5)
    check_projection(scene, camera_a(), 2**-40)
    cov = project(scene, camera_a()).cov2d
    across = np.sqrt(cov[0, 0] * cov[0, 2])
    assert (np.abs(cov[1] - cov[0]) <= 2**-9 * np.maximum(np.abs(cov[0]), [0, across, 0])).all()


def test_p06_determinant_of_a_needle():
    scene = gaussians((0, 0, 2), scales=(10, 1e-4, 1e-4), quats=DIAGONAL, opacities=0.8)
    check_projection(scene, camera_a())
    longer = gaussians((0, 0, 2), scales=(1e6, 1e-9, 1e-9), quats=DIAGONAL, opacities=0.8)
    check_projection(longer, camera_a())


def test_p07_point_has_exactly_the_low_pass():
    p = project(gaussians((0.0078125, 0.0078125, 2), scales=1e-9, opacities=1.0), camera_a())
    assert p.mean2d[0].tolist() == [64.5, 64.5]
    assert np.abs(p.cov2d[0] - [0.3, 0, 0.3]).max() < 1e-14 and abs(p.det[0] - 0.09) < 1e-14


def test_p08_compensation_of_a_subpixel_splat():
    far = gaussians((3.90625, 3.90625, 1000), scales=1e-3, opacities=1.0)
    r = reference(far, 0, camera_a())
    assert abs(float(mpmath.sqrt(r.raw / r.det)) - 5.5e-8) < 1e-9
    assert project(far, camera_a(), False).counters["visible"] == 1
    assert project(far, camera_a(), True).counters["culled_alpha"] == 1
    assert project(gaussians(far.means, 1e-3, 1.0, antialias=True), camera_a()).counters["culled_alpha"] == 1


def test_p09_quaternion_of_any_length_and_sign():
    factors = np.array([1, -1, 1e3, 1e-3, 1e-18, 1e-140, 1e140])
    quats = factors[:, None] * np.array([[0.5, 0.5, 0.5, 0.5], [0.1, -0.7, 0.2, 0.4]])[:, None]
    for q in quats:
        scene = gaussians([(0.3, -0.2, 2)] * len(q), scales=(0.3, 0.1, 0.03), quats=q)
        p = project(scene, camera_a())
        assert np.array_equal(p.cov2d[0], p.cov2d[1]) and p.visible.all()
        chol = encode(REFERENCE, p).chol
        assert np.abs(chol - chol[0]).max() <= 1
        check_projection(scene, camera_a())


def test_p10_zero_rows_are_dropped_before_projection():
    good = random_scene(1, 3)
    rows = [np.concatenate([a, np.zeros((4095, *a.shape[1:]))]) for a in (good.means, good.scales, good.quats)]
    rows[1][1:] = 1
    opacities = np.concatenate([good.opacities, np.full(4095, 0.5)])
    scene = checked("zeros", *rows, opacities, np.concatenate([good.sh, np.zeros((4095, 1, 3), np.float32)]))
    assert scene.counters["rejected_quat"] == 4095 and len(scene) == 1
    raw = Gaussians("zeros", *rows, opacities, np.zeros((4096, 1, 3), np.float32))
    inside = Camera(64, 64, 64, 64, 32, 32, np.eye(3), np.array([0, 0, -4.0]))
    assert project(raw, inside).counters["culled_nonfinite"] == 4095  # and should one slip through, it is counted


def test_p11_opacity_zero_is_culled_by_alpha():
    p = project(gaussians([(0, 0, 2)] * 3, opacities=[1, 0, 0.5]), camera_a())
    assert list(p.visible) == [True, False, True] and p.counters["culled_alpha"] == 1


def test_p12_opacity_around_the_cut():
    code = 2.0 ** (2.0**-REFERENCE.opacity_f)
    logit = 1 / (1 + math.exp(-float(np.float32(-math.log(254)))))  # 1/255 as a float32 logit in a file
    opacities = np.array([0, 1 / 255 / code, 1 / 255, 1 / 255 * code, 1, logit])
    p = project(gaussians([(0, 0, 2)] * 6, scales=0.05, opacities=opacities), camera_a())
    assert list(p.visible) == [False, False, True, True, True, True] and p.counters["culled_alpha"] == 2
    f = encode(REFERENCE, p)
    assert f.opacity[2] == f.opacity[5] == REFERENCE.cut >> 1
    assert (
        f.opacity[4] == 0 and (bound(REFERENCE, int(f.opacity[2])) >= 0) and (bound(REFERENCE, int(f.opacity[0])) < 0)
    )


def test_p13_colour_is_clamped_below_only():
    p = project(gaussians((0, 0, 2), colours=(-0.3, 0.5, 2.47)), camera_a())
    assert np.allclose(p.colour[0], (0, 0.5, 2.47), atol=1e-6) and p.colour[0, 0] == 0


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
