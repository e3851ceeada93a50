"""The lists of the tiles against the bitmaps of every Gaussian in every tile."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from golden.formats import REFERENCE
from golden.hard_cases.setting import camera_a, gaussians
from golden.preprocess import Features, duplicate, encode, project
from golden.raster_core.group_test_unit import tile_bitmap
from tests.test_preprocess import random_scene, tilted


@numba.njit
def every_tile(mean, chol, opacity, visible, width, height):
    """[T, N] bool: the bitmap of every Gaussian in every tile is not empty."""
    columns, rows = -(-width // 64), -(-height // 64)
    out = np.zeros((columns * rows, len(visible)), np.bool_)
    for t in range(columns * rows):
        for i in np.flatnonzero(visible):
            a, b, c = np.int64(chol[i, 0]), np.int64(chol[i, 1]), np.int64(chol[i, 2])
            x, y, o = np.int64(mean[i, 0]), np.int64(mean[i, 1]), np.int64(opacity[i])
            out[t, i] = (
                tile_bitmap(REFERENCE, a, b, c, x, y, o, t % columns * 64, t // columns * 64, width, height) != 0
            )
    return out


def check_pairs(f: Features, width: int, height: int) -> int:
    pairs = duplicate(REFERENCE, f, width, height)
    lists = [np.flatnonzero(row) for row in every_tile(f.mean, f.chol, f.opacity, f.visible, width, height)]
    assert np.array_equal(np.diff(pairs.tile_offsets), [len(x) for x in lists])
    assert np.array_equal(pairs.index, np.concatenate(lists))
    assert pairs.index.dtype == np.int32 and pairs.tile_offsets.dtype == np.int64
    return len(pairs.index)


@pytest.mark.parametrize(("width", "height"), [(130, 70), (64, 64), (8, 200), (333, 129)])
def test_duplication_equals_the_bitmaps_of_all_tiles(width, height):
    scene = random_scene(1500, width)
    assert check_pairs(encode(REFERENCE, project(scene, tilted(width, height))), width, height) > 200


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
    f = encode(REFERENCE, project(gaussians(means, scales=1e-6), camera_a(130, 70)))
    assert f.mean.tolist() == [[132608, 71168], [133530, 35840], [131072, 65536]]
    pairs = duplicate(REFERENCE, f, 130, 70)
    assert np.diff(pairs.tile_offsets).tolist() == [0, 1, 2, 0, 1, 2]
    check_pairs(f, 130, 70)


def test_i04_mean_on_a_tile_corner_is_listed_once_in_four_tiles():
    pairs = duplicate(REFERENCE, encode(REFERENCE, project(gaussians((0, 0, 2), scales=1e-6), camera_a())), 128, 128)
    assert pairs.tile_offsets.tolist() == [0, 1, 2, 3, 4] and pairs.index.tolist() == [0, 0, 0, 0]


def test_i06_between_pixel_centres_the_list_may_be_empty():
    f = encode(REFERENCE, project(gaussians((0, 0, 2), scales=1e-9, opacities=0.0085), camera_a()))
    assert f.visible[0] and check_pairs(f, 128, 128) == 0


def test_no_gaussians_at_all():
    nothing = random_scene(0, 0)
    f = encode(REFERENCE, project(nothing, camera_a()))
    pairs = duplicate(REFERENCE, f, 128, 128)
    assert pairs.tile_offsets.tolist() == [0] * 5 and len(pairs.index) == 0
