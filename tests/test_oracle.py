"""The oracle against a brute-force renderer, and the golden picture against the oracle.

Two budgets: <= 0.25 LSB with the golden decisions injected, and with own decisions <= 1 LSB on 99.9 % of pixels.
"""

from __future__ import annotations

import numpy as np
import pytest

from golden import metrics, oracle, params, records
from golden.cameras.camera import Camera
from golden.formats import REFERENCE
from golden.hard_cases.setting import camera_a, gaussians, merge
from golden.preprocess import Features, Projection, duplicate, encode, project
from golden.raster_core import exp2_unit, pixel_blender
from golden.raster_core import subtile_compute_unit as scu
from golden.raster_core.ellipse_setup import setup
from golden.raster_core.raster_core import rasterise
from golden.scene.gaussians import Gaussians

DIAGONAL = (0.9238795, 0, 0, 0.3826834)  # 45 degrees about z
LSB = 1 / 255


def brute(p: Projection, camera: Camera, background=(0, 0, 0), stop=0.0, drop_last=False, order=None) -> np.ndarray:
    """Whole-picture arrays, one Gaussian after the other, the conic as a matrix inverse."""
    y, x = np.mgrid[0 : camera.height, 0 : camera.width] + 0.5
    t, live = np.ones(x.shape), np.ones(x.shape, bool)
    out = np.zeros((*x.shape, 3))
    if order is None:
        order = sorted(np.flatnonzero(p.visible), key=lambda i: (p.depth[i], i))
    for i in order:
        xx, xy, yy = p.cov2d[i]
        conic = np.linalg.inv([[xx, xy], [xy, yy]])
        dx, dy = x - p.mean2d[i, 0], y - p.mean2d[i, 1]
        q = conic[0, 0] * dx * dx + 2 * conic[0, 1] * dx * dy + conic[1, 1] * dy * dy
        alpha = np.minimum(0.99, p.opacity[i] * np.exp(-q / 2))
        blend = live & (alpha >= (1 - 2.0**-22) / 255)
        below = blend & (t * (1 - alpha) < stop)
        blend &= ~(below & drop_last)
        live &= ~below
        out += np.where(blend, t * alpha, 0)[..., None] * p.colour[i]
        t = np.where(blend, t * (1 - alpha), t)
    return out + t[..., None] * np.asarray(background)


def random_scene(n: int, seed: int, opaque: float = 0.5, terms: int = 1) -> Gaussians:
    """Filling CAM-A's view: small and large, round and long, a share nearly opaque; a quarter of the depths shared."""
    r = np.random.default_rng(seed)
    z = r.uniform(1, 6, n)
    z[: n // 4] = 2.5
    means = np.column_stack([r.uniform(-0.6, 0.6, n) * z, r.uniform(-0.6, 0.6, n) * z, z])
    opacity = np.where(r.random(n) < opaque, r.uniform(0.7, 1, n), r.uniform(0, 0.3, n))
    sh = r.normal(0.2, 0.6, (n, terms, 3)).astype(np.float32)
    return Gaussians("random", means, np.exp(r.normal(-2.7, 0.8, (n, 3))), r.normal(size=(n, 4)), opacity, sh)


def tables(f: Features, camera: Camera) -> tuple[np.ndarray, np.ndarray, int]:
    """Exactly sorted by (key, index)."""
    pairs = duplicate(REFERENCE, f, camera.width, camera.height)
    tile = np.repeat(np.arange(len(pairs.tile_offsets) - 1), np.diff(pairs.tile_offsets))
    order = np.lexsort((pairs.index, f.key[pairs.index], tile))
    return pairs.tile_offsets, pairs.index[order].astype(np.int64), params.TILE


def golden_picture(f: Features, camera: Camera, background=(0, 0, 0)) -> np.ndarray:
    """[H, W, 3] float64 of the golden raster core on exactly sorted tables. background: real, exact in UQ3.10."""
    offsets, index, _ = tables(f, camera)
    y, x = np.mgrid[0 : camera.height : 64, 0 : camera.width : 64]
    origins = np.column_stack([x.ravel(), y.ravel()])
    words = records.entries(f.key[index].astype(np.int64), index)
    codes = tuple(int(v * 1024) for v in background)
    result = rasterise(REFERENCE, (offsets, words), f, origins, camera.width, camera.height, codes)
    return result.value * 2.0**-REFERENCE.acc_f


def both(scene: Gaussians, camera: Camera, background=(0, 0, 0)) -> tuple[np.ndarray, np.ndarray]:
    """(golden, oracle)."""
    p = project(scene, camera)
    return golden_picture(encode(REFERENCE, p), camera, background), oracle.render(p, camera, background)


# ---- the oracle is the mathematics


@pytest.mark.parametrize("size", [(60, 45), (130, 70), (33, 65)])
def test_oracle_equals_brute_force(size):
    camera = camera_a(*size)
    p = project(random_scene(250, sum(size), terms=9), camera)
    image = oracle.render(p, camera, (0.25, 0.5, 1))
    assert np.abs(image - brute(p, camera, (0.25, 0.5, 1))).max() < 1e-9


def test_scene_and_projection_are_the_same_to_render():
    scene, camera = random_scene(200, 2), camera_a()
    assert np.array_equal(oracle.render(scene, camera), oracle.render(project(scene, camera), camera))


@pytest.mark.parametrize("rule", ["blend-last", "drop-last"])
def test_stop_rules_equal_brute_force(rule):
    camera = camera_a(70, 40)
    p = project(random_scene(400, 3, opaque=1.0), camera)
    image = oracle.render(p, camera, (1, 1, 1), stop=0.03, rule=rule)
    assert np.abs(image - brute(p, camera, (1, 1, 1), 0.03, rule == "drop-last")).max() < 1e-9
    assert np.abs(image - oracle.render(p, camera, (1, 1, 1))).max() > 0.001


def test_unknown_stop_rule_is_refused():
    with pytest.raises(ValueError, match="neither"):
        oracle.render(random_scene(1, 1), camera_a(), rule="neither")


def test_equal_depths_blend_lower_index_first():
    camera = camera_a()
    scene = gaussians([(0.01, 0.01, 2)] * 2, colours=[(1, 0, 0), (0, 1, 0)])
    swapped = gaussians([(0.01, 0.01, 2)] * 2, colours=[(0, 1, 0), (1, 0, 0)])
    first, second = oracle.render(scene, camera), oracle.render(swapped, camera)
    assert first[64, 64, 0] > 5 * first[64, 64, 1] and np.array_equal(first[..., 0], second[..., 1])


def test_given_order_equals_brute_force_in_that_order():
    camera = camera_a(64, 64)
    p = project(random_scene(150, 5), camera)
    order = np.random.default_rng(0).permutation(np.flatnonzero(p.visible))
    image = oracle.render(p, camera, tables=(np.array([0, len(order)]), order, 64))
    assert np.abs(image - brute(p, camera, order=order)).max() < 1e-9
    assert np.abs(image - oracle.render(p, camera)).max() > 0.05


def test_exactly_sorted_tables_change_nothing():
    camera = camera_a(200, 136)
    p = project(random_scene(800, 6), camera)
    listed = tables(encode(REFERENCE, p), camera)
    image = oracle.render(p, camera, tables=listed)
    # a tile lists what the codes reach: a pixel at the very edge of the cut may differ, by at most the cut
    assert metrics.compare(image, oracle.render(p, camera))["max_lsb"] <= 1.001
    assert metrics.compare(image, oracle.render(p, camera))["mean_lsb"] < 0.001


def test_entries_that_are_not_visible_do_not_blend():
    camera = camera_a(64, 64)
    p = project(merge(gaussians((0, 0, 2)), gaussians((0, 0, -2)), gaussians((0, 0, 3), opacities=0.001)), camera)
    image = oracle.render(p, camera, tables=(np.array([0, 3]), np.array([2, 1, 0]), 64))
    assert np.abs(image - brute(p, camera)).max() < 1e-12


@pytest.mark.parametrize(("rule", "green"), [("blend-last", 0.0099), ("drop-last", 0)])
def test_s01_second_layer_at_the_clamp(rule, green):
    camera = camera_a()
    scene = gaussians([(0, 0, 0.3), (0, 0, 0.4)], scales=50.0, opacities=1.0, colours=[(0, 0, 0), (0, 1, 0)])
    image = oracle.render(scene, camera, stop=1.001e-4, rule=rule)
    assert np.abs(image[..., 1] - green).max() < 1e-9


def test_an_ellipse_beyond_any_whole_number_reads_no_other_memory():
    """Its rows begin near 1e22 pixels; found by fuzzing."""
    one = Gaussians(
        "far", np.array([[-1e30, 0.0, 1e9]]), np.array([[0.0, 0.0, 1e30]]), np.array([[0.0, 0, 0, 1]]), np.ones(1),
        np.zeros((1, 1, 3), np.float32),
    )  # fmt: skip
    camera = Camera(63, 1, 63.0, 63.0, 31.5, 0.5, np.eye(3), np.array([-0.05, 0.03, 0.13]), 0.2)
    assert project(one, camera).visible.all() and np.isfinite(oracle.render(one, camera)).all()


def test_no_gaussians_is_background():
    camera = camera_a(30, 20)
    scene = random_scene(0, 0)
    assert (oracle.render(scene, camera, (0.1, 0.2, 0.3)) == np.array([0.1, 0.2, 0.3])).all()
    f, p = encode(REFERENCE, project(scene, camera)), project(scene, camera)
    injected = oracle.render_injected(REFERENCE, f, p, tables(f, camera), 30, 20, (0.1, 0.2, 0.3))
    assert (injected == np.array([0.1, 0.2, 0.3])).all()


# ---- injected decisions


def lockstep(f: Features, p: Projection, x0: int, y0: int, order: list[int]) -> np.ndarray:
    """One subtile in plain Python: the decisions in codes, the values in real numbers."""
    out = np.zeros((8, 8, 3))
    for y in range(8):
        for x in range(8):
            code, real = 1 << REFERENCE.t_f, 1.0
            for i in order:
                a, b, c = (int(v) for v in f.chol[i])
                o = int(f.opacity[i])
                u, v = setup(REFERENCE, a, b, c, int(f.mean[i, 0]), int(f.mean[i, 1]), x0, y0)
                power = scu.power(REFERENCE, u + x * a + y * b, v + y * c, o)
                if power > REFERENCE.cut or code < REFERENCE.t_stop:
                    continue
                code -= pixel_blender.weight(REFERENCE, exp2_unit.alpha(REFERENCE, power), code)
                xx, xy, yy = p.cov2d[i]
                d = np.array([x0 + x + 0.5, y0 + y + 0.5]) - p.mean2d[i]
                alpha = min(0.99, p.opacity[i] * np.exp(-0.5 * d @ np.linalg.inv([[xx, xy], [xy, yy]]) @ d))
                out[y, x] += real * alpha * p.colour[i]
                real *= 1 - alpha
    return out


def test_injected_decisions_are_the_golden_ones():
    camera = camera_a(64, 64)
    layers = gaussians([(0, 0, z) for z in (2, 2.5, 3, 3.5, 4, 4.5)], scales=9.0, opacities=0.9)  # T below T_STOP
    p = project(merge(random_scene(120, 8), layers), camera)
    f = encode(REFERENCE, p)
    listed = tables(f, camera)
    image = oracle.render_injected(REFERENCE, f, p, listed, 64, 64)
    for x0, y0 in ((0, 0), (24, 32), (56, 56)):
        truth = lockstep(f, p, x0, y0, [int(i) for i in listed[1]])
        assert np.abs(image[y0 : y0 + 8, x0 : x0 + 8] - truth).max() < 1e-9


def test_injected_wants_the_golden_tiles():
    f, p = encode(REFERENCE, project(random_scene(3, 0), camera_a())), project(random_scene(3, 0), camera_a())
    with pytest.raises(ValueError, match="32-pixel"):
        oracle.render_injected(REFERENCE, f, p, (np.zeros(17), np.zeros(0), 32), 128, 128)


@pytest.mark.parametrize("opaque", [0.0, 0.5, 1.0])
def test_golden_is_within_both_budgets(opaque):
    camera = camera_a(200, 136)
    p = project(random_scene(4000, 9, opaque, terms=16), camera)
    f = encode(REFERENCE, p)
    assert not any(f.counters.values())
    background = (0.5, 0.25, 1.0)
    picture = golden_picture(f, camera, background)
    injected = oracle.render_injected(REFERENCE, f, p, tables(f, camera), 200, 136, background)
    assert metrics.compare(picture, injected)["max_lsb"] <= 0.25
    # own decisions, exact order: entries whose depths share a key but not the value may swap
    own = oracle.render(p, camera, background, tables=tables(f, camera))
    assert metrics.compare(picture, own)["share_above_1_lsb"] <= 0.001
    assert metrics.compare(picture, oracle.render(p, camera, background))["share_above_1_lsb"] <= 0.001


# ---- pixel values of the hard cases


@pytest.mark.parametrize("shift", [0, 0.01, 0.3])
def test_p06_needle(shift):
    scene = gaussians((shift, 0, 2), scales=(10, 1e-4, 1e-4), quats=DIAGONAL, opacities=0.8)
    image, truth = both(scene, camera_a())
    assert truth.max() > 0.5
    # white on black: the picture is alpha; at the cut the golden alpha is 0 or 1/255
    close = np.abs(truth - LSB) > 1e-4
    close &= (truth > 0) == (image > 0)
    assert np.abs(image - truth)[close].max() <= 2**-10 and close.mean() > 0.99


def test_i03_only_the_live_part_is_written():
    scene = random_scene(200, 33)
    small = camera_a(130, 70)
    large = Camera(192, 128, 128.0, 128.0, 64.0, 64.0, np.eye(3), np.zeros(3))
    # the limit of the Jacobian follows the picture's width: keep to what lies inside both
    inside = (np.abs(scene.means[:, :2]) < 0.3 * scene.means[:, 2:]).all(axis=1)
    part = Gaussians("inside", *(a[inside] for a in (scene.means, scene.scales, scene.quats)), scene.opacities[inside],
                     scene.sh[inside])  # fmt: skip
    for a, b in zip(both(part, small), both(part, large)):
        assert a.shape == (70, 130, 3)
        assert np.abs(a - b[:70, :130]).max() < 1e-12
