"""Late sort: short entries, the merge by the keys of groups, each batch in this frame's order, and how good it is."""

from __future__ import annotations

import numpy as np
import pytest

from golden import metrics, params, scene
from golden.cameras import default_view, path
from golden.cameras.camera import look_at
from golden.errors import InputError
from golden.formats import REFERENCE
from golden.frame import Frame, Renderer, tiles_of
from golden.hard_cases.setting import camera_a, gaussians, merge, yaw
from golden.raster_core.late_core import rasterise_late
from golden.records import (
    INVALID,
    entries,
    indices_of,
    keys_of,
    short_bytes,
    with_group_keys,
    words_from_short,
)
from golden.settings import Settings
from golden.sorting_core import merge_sort_unit, sorting_core
from tests.hard_cases.test_tables import check_invariants, crowd

KEY_MASK = (1 << REFERENCE.key_w) - 1


def random_words(rng, n: int) -> np.ndarray:
    words = entries(rng.integers(0, KEY_MASK + 1, n), rng.integers(0, 1 << params.INDEX_W, n))
    return words | np.where(rng.random(n) < 0.3, INVALID, 0)


def test_short_entries_byte_for_byte():
    key = 0b10_1000001_0100011_1110001
    words = entries(np.array([1, 2, key, KEY_MASK]), np.array([0xABCDEF, 5, 6, 7]))
    words[[1, 3]] |= INVALID
    short = short_bytes(words).view("<u4")
    spare = [0b1110001, 0b0100011, 0b1000001, 0b10]
    invalid = [0, 1, 0, 1]
    assert [int(word) for word in short] == [
        s << 25 | v << 24 | i for s, v, i in zip(spare, invalid, (0xABCDEF, 5, 6, 7))
    ]
    assert np.array_equal(keys_of(words_from_short(short_bytes(words), 4)), [key] * 4)


@pytest.mark.parametrize("n", [0, 1, 2, 3, 4, 5, 8, 131, 1024])
def test_short_entries_keep_everything_but_the_keys_of_their_own(n):
    rng = np.random.default_rng(n)
    for _ in range(10):
        words = random_words(rng, n)
        data = short_bytes(words)
        assert data.size == -(-n // 4) * 16
        back = words_from_short(data, n)
        assert np.array_equal(back, with_group_keys(words))
        assert np.array_equal(indices_of(back), indices_of(words))
        assert np.array_equal(back >= INVALID, words >= INVALID)
        for start in range(0, n, 4):
            valid = [word for word in words[start : start + 4] if word < INVALID]
            key = keys_of(valid[-1]) if valid else 0
            assert (keys_of(back[start : start + 4]) == key).all()


def test_an_entry_that_left_does_not_lift_its_group():
    """Out of sight a Gaussian has the largest key there is; in a group it would pull all incoming entries ahead."""
    words = entries(np.array([5, 6, 7, KEY_MASK]), np.arange(4)) | np.array([0, 0, 0, INVALID])
    assert (keys_of(with_group_keys(words)) == 7).all()


def late_frames(cameras: list, n: int = 3000, **keys) -> list[Frame]:
    renderer = Renderer(crowd(31, n), Settings(**keys), late=True)
    return [renderer.frame(camera) for camera in cameras]


def track(count: int, degrees: float) -> list:
    return [camera_a(rotation=yaw(degrees * step), position=(0.02 * step, 0, 0)) for step in range(count)]


def test_lists_of_a_frame_are_made_as_the_units_make_them():
    before, *rest = late_frames(track(4, 2.0))
    for number, frame in enumerate(rest, 1):
        check_invariants(frame)
        assert frame.firsts[-1] == sorting_core.first_length(number)
        assert frame.counters["full_tiles"] == 0
        for t in range(4):
            table = words_from_short(short_bytes(before.written.tile(t)), before.written.tile(t).size)
            assert np.array_equal(frame.table.tile(t), table)
            merged = merge_sort_unit.merge(table, np.sort(frame.incoming.tile(t)))
            assert np.array_equal(frame.merged.tile(t), merged)
            index = indices_of(merged)
            fresh = entries(frame.features.key[index], index)
            assert np.array_equal(frame.order.tile(t), sorting_core.sort_chunks(fresh, frame.firsts[-1]))
            assert np.array_equal(frame.written.tile(t) & ~INVALID, frame.order.tile(t))
        before = frame


def test_the_late_core_draws_the_frame():
    for frame in late_frames(track(3, 2.0)):
        result = rasterise_late(
            REFERENCE,
            (frame.merged.offsets, frame.merged.words),
            frame.features,
            tiles_of(128, 128),
            128,
            128,
            (0, 0, 0),
            frame.firsts[-1],
        )
        for name in ("words_out", "bitmaps", "value", "counts", "batch_offsets", "scu_ops"):
            assert np.array_equal(getattr(result, name), getattr(frame.raster, name)), name


def test_a_short_table_is_always_in_order():
    cameras = track(5, 3.0)
    full = Renderer(crowd(31, 300), Settings(), "full")
    for camera, frame in zip(cameras, late_frames(cameras, 300)):
        assert frame.order.lengths.max() <= params.CHUNK // 2
        assert np.array_equal(frame.raster.value, full.frame(camera).raster.value)


@pytest.mark.parametrize("declared", [True, False])
def test_a_cut_gives_the_exact_picture(declared):
    renderer = Renderer(crowd(32, 2000), Settings(), late=True)
    for camera in track(3, 1.0):
        renderer.frame(camera)
    away = camera_a(rotation=yaw(150), position=(0, 0, 8))
    frame = renderer.frame(away, cut=declared)
    assert frame.sorting == "full" and frame.counters["full_frames"] == 1
    assert np.array_equal(frame.raster.value, Renderer(crowd(32, 2000), Settings()).frame(away).raster.value)


def test_a_revealed_tile_is_rebuilt_and_exact():
    """A near crowd comes into one tile; the others go on."""
    rng = np.random.default_rng(33)
    depth = rng.uniform(2, 3, 900)
    hidden = gaussians(
        np.stack([-1.3 * depth / 2, -0.5 * depth / 2, depth], 1),
        scales=0.01,
        opacities=0.5,
        colours=rng.random((900, 3)),
    )
    renderer = Renderer(merge(crowd(34, 1500), hidden), Settings(), late=True)
    renderer.frame(camera_a())
    frame = renderer.frame(camera_a(rotation=yaw(-10)))
    assert frame.counters["full_frames"] == 0
    assert frame.counters["rebuilt_tiles"] == 1 and list(frame.table.lengths == 0) == [True, False, False, False]
    assert (np.diff(frame.order.tile(0)) > 0).all()
    never = Renderer(merge(crowd(34, 1500), hidden), Settings(rebuild_share="1"), late=True)
    never.frame(camera_a())
    assert never.frame(camera_a(rotation=yaw(-10))).counters["rebuilt_tiles"] == 0


def test_late_sort_goes_with_reuse_only():
    with pytest.raises(InputError, match="periodic:2"):
        Renderer(crowd(1, 10), Settings(), "periodic:2", late=True)


@pytest.mark.parametrize("kind", ["orbit", "shake"])
def test_late_sort_is_nearly_exact_where_stale_keys_are_not(kind):
    gaussians_ = scene.load("builtin:room?n=40000")
    eye, at, up, fovy = default_view(gaussians_)
    cameras = path(kind, look_at(eye, at, up, fovy, 384, 256), range(6), 30, 1.0, at, 1.0, 0, up)
    truth, late, stale = (
        [renderer.frame(camera).image for camera in cameras]
        for renderer in (
            Renderer(gaussians_, Settings(), "full"),
            Renderer(gaussians_, Settings(), late=True),
            Renderer(gaussians_, Settings()),
        )
    )

    def worst(images: list) -> float:
        quality = [metrics.compare(image, exact)["psnr_db"] for image, exact in zip(images, truth)]
        return min([q for q in quality if q is not None], default=200.0)

    assert worst(late) >= 65
    assert worst(stale) <= worst(late) - 12
