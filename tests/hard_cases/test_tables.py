"""Hard cases that concern the tables from frame to frame, and the invariants of every table."""

from __future__ import annotations

import numpy as np
import pytest

from golden import params
from golden.frame import Frame, Renderer, tiles_of
from golden.records import INVALID, indices_of
from golden.settings import Settings
from tests.hard_cases.setting import camera_a, gaussians, merge, yaw


def check_invariants(frame: Frame) -> None:
    """Complete, unique, conserving (design, section 3.3)."""
    for t in range(len(tiles_of(frame.camera.width, frame.camera.height))):
        listed = indices_of(frame.order.tile(t))
        assert np.unique(listed).size == listed.size
        now = frame.pairs.index[frame.pairs.tile_offsets[t] : frame.pairs.tile_offsets[t + 1]]
        assert np.isin(now, listed).all()
        gone = np.count_nonzero(frame.table.tile(t) & INVALID)
        assert listed.size == frame.table.tile(t).size + frame.incoming.tile(t).size - gone
    assert frame.counters["entries"] == (
        frame.table.words.size + frame.counters["incoming"] - frame.counters["outgoing"]
    )


def crowd(seed: int, n: int):
    rng = np.random.default_rng(seed)
    means = rng.uniform(-2, 2, (n, 3)) + (0, 0, 4)
    return gaussians(
        means, scales=rng.uniform(0.01, 0.2, (n, 3)), opacities=rng.uniform(0.02, 1, n), colours=rng.random((n, 3))
    )


def test_invariants_on_a_moving_crowd():
    renderer = Renderer(crowd(1, 3000), Settings())
    for step in range(6):
        check_invariants(renderer.frame(camera_a(rotation=yaw(1.5 * step), position=(0.02 * step, 0, 0))))


def test_order_heals_when_the_camera_stops():
    renderer = Renderer(crowd(2, 3000), Settings(cut_share=1.0))
    for step in range(4):
        renderer.frame(camera_a(rotation=yaw(4.0 * step)))
    longest = 0
    waited, ordered = -1, False
    while not ordered and waited < 200:
        waited += 1
        frame = renderer.frame(camera_a(rotation=yaw(12.0)))
        longest = max(longest, int(np.diff(frame.order.offsets).max()))
        ordered = all((np.diff(frame.order.tile(t)) > 0).all() for t in range(4))
    assert ordered
    assert waited <= -(-2 * longest // params.CHUNK) + 1  # one frame until the keys are those of this camera


def test_t04_splat_lost_between_two_tests_comes_back():
    """Between pixel centres it touches nothing; one frame later it sits on one and must be drawn."""
    tiny = gaussians((0, 0, 2), scales=1e-9, opacities=0.0090)
    renderer = Renderer(tiny, Settings())
    first = renderer.frame(camera_a())
    assert not first.raster.value.any()
    second = renderer.frame(camera_a(position=(-0.0078125, -0.0078125, 0)))
    assert second.raster.value[64, 64, 0] > 0
    check_invariants(second)


def test_t05_reveal_behind_opaque_splats_is_one_frame_stale_at_most():
    """Refresh all: after 40 occluded frames the reveal frame is as good as with nothing in front."""
    rng = np.random.default_rng(5)
    back = crowd(6, 1500)
    front = gaussians(rng.uniform(-0.3, 0.3, (60, 3)) + (0, 0, 0.8), scales=0.5, opacities=0.99, colours=0.5)
    both = Renderer(merge(back, front), Settings())
    alone = Renderer(back, Settings())
    for step in range(40):
        camera = camera_a(rotation=yaw(0.5 * (step - 20)))
        hidden, seen = both.frame(camera), alone.frame(camera)
    for t in range(4):
        kept = hidden.written.tile(t)
        kept = kept[indices_of(kept) < 1500]
        assert np.array_equal(np.sort(kept), np.sort(seen.written.tile(t)))


def test_t06_declared_cut_equals_a_cold_start():
    scene = crowd(7, 2000)
    warm = Renderer(scene, Settings())
    for step in range(3):
        warm.frame(camera_a(rotation=yaw(step)))
    away = camera_a(rotation=yaw(150), position=(0, 0, 8))
    cold = Renderer(scene, Settings()).frame(away)
    after = warm.frame(away, cut=True)
    assert np.array_equal(after.raster.value, cold.raster.value)
    assert np.array_equal(after.order.words, cold.order.words)
    assert after.counters["full_frames"] == 1


def test_t06_undeclared_cut_is_found_and_counted():
    scene = crowd(8, 2000)
    renderer = Renderer(scene, Settings())
    renderer.frame(camera_a())
    away = camera_a(rotation=yaw(150), position=(0, 0, 8))
    frame = renderer.frame(away)
    assert frame.counters["full_frames"] == 1
    assert np.array_equal(frame.raster.value, Renderer(scene, Settings()).frame(away).raster.value)


@pytest.mark.parametrize("times", [1, 4])
def test_t07_overfull_tile_keeps_the_nearest_and_counts(times):
    capacity = params.CHUNK
    n = capacity + 1 if times == 1 else 4 * capacity
    rng = np.random.default_rng(9)
    depth = rng.permutation(n) * 0.001 + 2
    pile = gaussians(np.stack([-0.5 * depth / 2, -0.5 * depth / 2, depth], 1), scales=0.02, opacities=0.05, colours=0.8)
    other = gaussians([(0.5, 0.5, 2), (0.52, 0.5, 2.1)], scales=0.02)
    renderer = Renderer(merge(pile, other), Settings(capacity=capacity))
    for _ in range(2):
        frame = renderer.frame(camera_a())
        assert frame.counters["overflow"] == n - capacity
        assert frame.order.tile(0).size == capacity
        assert np.array_equal(
            np.sort(indices_of(frame.order.tile(0))), np.sort(np.argsort(depth, kind="stable")[:capacity])
        )
    roomy = Renderer(merge(pile, other), Settings()).frame(camera_a())
    assert np.array_equal(frame.raster.value[64:, 64:], roomy.raster.value[64:, 64:])


def test_t08_equal_depths_do_not_depend_on_history_or_input_order():
    rng = np.random.default_rng(10)
    n = 83
    depth = np.where(np.arange(n) < 23, 3.0, rng.uniform(2, 4, n))
    means = np.stack([rng.uniform(-1, 1, n), rng.uniform(-1, 1, n), depth], 1)
    scene = gaussians(
        means, scales=rng.uniform(0.3, 2, n), opacities=rng.uniform(0.2, 0.9, n), colours=rng.random((n, 3))
    )
    renderer = Renderer(scene, Settings())
    cold = renderer.frame(camera_a())
    for _ in range(3):
        warm = renderer.frame(camera_a())
    assert np.array_equal(cold.raster.value, warm.raster.value)
