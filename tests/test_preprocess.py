"""Projection, colour, records and duplication against references written from the formulas (mpmath, plain loops).

References use none of the code under test. Bounds are those of the hard cases D-P01..P14, or tighter.
"""

from __future__ import annotations

import math
from types import SimpleNamespace

import mpmath
import numba
import numpy as np
import pytest
from mpmath import mp, mpf

from golden import params, records
from golden.cameras.camera import Camera, look_at
from golden.preprocess import Features, duplicate, encode, project
from golden.preprocess.colour import colours
from golden.preprocess.projection import depths
from golden.raster_core.intersection_test_unit import bound, tile_bitmap
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
        chol = encode(p).chol
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
    code = 2.0 ** (2.0**-params.OPACITY_F)
    logit = 1 / (1 + math.exp(-float(np.float32(-math.log(254)))))  # 1/255 as a float32 logit in a file
    opacities = np.array([0, 1 / 255 / code, 1 / 255, 1 / 255 * code, 1, logit])
    p = project(gaussians([(0, 0, 2)] * 6, scales=0.05, opacities=opacities), camera_a())
    assert list(p.visible) == [False, False, True, True, True, True] and p.counters["culled_alpha"] == 2
    f = encode(p)
    assert f.opacity[2] == f.opacity[5] == params.CUT >> 1
    assert f.opacity[4] == 0 and (bound(int(f.opacity[2])) >= 0) and (bound(int(f.opacity[0])) < 0)


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


# ---- records


def test_codes_are_within_half_a_step_of_the_conic():
    scene, camera = random_scene(80, 21), tilted()
    p = project(scene, camera)
    f = encode(p)
    scale = mpmath.log(mpmath.e, 2) / 2
    checks = 0
    for i in np.flatnonzero(f.visible):
        r = reference(scene, i, camera)
        conic = r.cov**-1
        a = mpmath.sqrt(scale * conic[0, 0])
        b = scale * conic[0, 1] / a
        c = mpmath.sqrt(scale * conic[1, 1] - b * b)
        for code, truth in zip(f.chol[i], (a, b, c)):
            assert abs(int(code) - truth * 2**params.CHOL_F) <= 0.5 + 1e-6
        assert abs(int(f.mean[i, 0]) - r.x * 1024) <= 0.5 + 1e-6
        assert abs(int(f.mean[i, 1]) - r.y * 1024) <= 0.5 + 1e-6
        assert abs(int(f.opacity[i]) + mpmath.log(mpf(float(p.opacity[i])), 2) * 8192) <= 0.5 + 1e-6
        checks += 1
    assert checks > 20
    assert np.array_equal(f.key[f.visible], records.depth_key(p.depth[f.visible]))


def test_records_hold_what_was_encoded():
    f = encode(project(random_scene(500, 22), tilted()))
    raw = records.record_bytes(f.fields())
    for i in np.flatnonzero(f.visible)[:50]:
        word = int.from_bytes(raw[i].tobytes(), "little")
        for name, (low, width) in params.record_offsets().items():
            code = int(f.fields()[name][i])
            assert (word >> low) & ((1 << width) - 1) == code & ((1 << width) - 1), name
            signed = name in ("mean_x", "mean_y", "chol_b")
            assert (-(1 << width - 1) <= code < 1 << width - 1) if signed else (0 <= code < 1 << width)


def test_invisible_records_never_hit():
    f = encode(project(random_scene(2000, 23), tilted()))
    assert (~f.visible).sum() > 100
    assert all(bound(int(o)) < 0 for o in f.opacity[~f.visible])


def test_what_does_not_fit_is_counted():
    scene = gaussians(
        [(130, 0, 2), (0, 0, 2), (0, 0, 2.0**30), (0, 0, 3)],
        scales=[(200, 200, 200), (0.1, 0.1, 0.1), (2.0**29, 2.0**29, 2.0**29), (0.1, 0.1, 0.1)],
        colours=[(1, 1, 1), (8, 0, 0), (1, 1, 1), (3.9, 3.9, 3.9)],
    )
    p = project(scene, camera_a())
    f = encode(p)
    assert p.visible.all() and list(f.visible) == [False, True, True, True]
    assert f.counters == {"culled_range": 1, "clamped_colour": 1, "clamped_depth": 1}
    assert f.colour[1, 0] == 7680 and f.key[2] == records.KEY_MASK


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
    a, b, c = encode(p).chol[0] / 2.0**params.CHOL_F
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


# ---- duplication


@numba.njit
def every_tile(mean, chol, opacity, visible, width, height):
    """[T, N] bool: the bitmap of every Gaussian in every tile is not empty."""
    columns, rows = -(-width // 64), -(-height // 64)
    out = np.zeros((columns * rows, len(visible)), np.bool_)
    for t in range(columns * rows):
        for i in np.flatnonzero(visible):
            a, b, c = np.int64(chol[i, 0]), np.int64(chol[i, 1]), np.int64(chol[i, 2])
            x, y, o = np.int64(mean[i, 0]), np.int64(mean[i, 1]), np.int64(opacity[i])
            out[t, i] = tile_bitmap(a, b, c, x, y, o, t % columns * 64, t // columns * 64, width, height) != 0
    return out


def check_pairs(f: Features, width: int, height: int) -> int:
    pairs = duplicate(f, width, height)
    lists = [np.flatnonzero(row) for row in every_tile(f.mean, f.chol, f.opacity, f.visible, width, height)]
    assert np.array_equal(np.diff(pairs.tile_offsets), [len(x) for x in lists])
    assert np.array_equal(pairs.index, np.concatenate(lists))
    assert pairs.index.dtype == np.int32 and pairs.tile_offsets.dtype == np.int64
    return len(pairs.index)


@pytest.mark.parametrize(("width", "height"), [(130, 70), (64, 64), (8, 200), (333, 129)])
def test_duplication_equals_the_bitmaps_of_all_tiles(width, height):
    scene = random_scene(1500, width)
    assert check_pairs(encode(project(scene, tilted(width, height))), width, height) > 200


@pytest.mark.parametrize("seed", range(4))
def test_duplication_of_any_codes(seed):
    """Every representable record, zero terms and saturating set-ups included; half of the opacities at the cut."""
    r = np.random.default_rng(seed)
    n = 4000
    size = (2 ** r.uniform(0, 20.5, (n, 3))).astype(np.int32) - 1
    size[r.random((n, 3)) < 0.02] = 0
    size[:, 1] *= r.choice([-1, 1], n)
    reach = 1 << (23 if seed & 1 else 19)
    mean = r.integers(-reach >> (seed & 2), reach, (n, 2)).astype(np.int32)
    opacity = np.where(r.random(n) < 0.5, r.integers(65450, 65536, n), r.integers(0, 65536, n)).astype(np.int32)
    zeros = np.zeros((n, 3), np.int32)
    check_pairs(Features(mean, size, opacity, zeros, zeros[:, 0], np.ones(n, bool)), 400, 200)


def test_i03_picture_that_is_no_multiple_of_the_tile():
    means = [((x - 64) / 64, (y - 64) / 64, 2) for x, y in ((129.5, 69.5), (130.4, 35), (128.0, 64.0))]
    f = encode(project(gaussians(means, scales=1e-6), camera_a(130, 70)))
    assert f.mean.tolist() == [[132608, 71168], [133530, 35840], [131072, 65536]]
    pairs = duplicate(f, 130, 70)
    assert np.diff(pairs.tile_offsets).tolist() == [0, 1, 2, 0, 1, 2]
    check_pairs(f, 130, 70)


def test_i04_mean_on_a_tile_corner_is_listed_once_in_four_tiles():
    pairs = duplicate(encode(project(gaussians((0, 0, 2), scales=1e-6), camera_a())), 128, 128)
    assert pairs.tile_offsets.tolist() == [0, 1, 2, 3, 4] and pairs.index.tolist() == [0, 0, 0, 0]


def test_i06_between_pixel_centres_the_list_may_be_empty():
    f = encode(project(gaussians((0, 0, 2), scales=1e-9, opacities=0.0085), camera_a()))
    assert f.visible[0] and check_pairs(f, 128, 128) == 0


def test_no_gaussians_at_all():
    nothing = random_scene(0, 0)
    f = encode(project(nothing, camera_a()))
    pairs = duplicate(f, 128, 128)
    assert pairs.tile_offsets.tolist() == [0] * 5 and len(pairs.index) == 0
