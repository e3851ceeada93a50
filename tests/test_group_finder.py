"""The group finder misses no group that the intersection test hits, and gives few that it does not."""

from __future__ import annotations

from pathlib import Path

import numba
import numpy as np
import pytest

from golden import cameras, params, scene
from golden.formats import REFERENCE
from golden.frame import tiles_of
from golden.preprocess import duplicate, encode, project
from golden.raster_core import group_finder, group_tester
from golden.raster_core.row_reach import limit
from tb.lib.footprints import CHOL_MAX, cholesky, gaussians, mean_code, opacity_code

SCENES = Path(__file__).parents[2] / "shared" / "scenes"


@numba.njit
def _hit_groups(bits):
    """A bitmap of subtiles to a mask of groups."""
    found = 0
    for g in range(params.GROUPS):
        if (bits >> np.uint64(params.UNITS * g)) & np.uint64((1 << params.UNITS) - 1):
            found |= 1 << g
    return found


@numba.njit(parallel=True)
def _compare(rows, tiles, width, height):
    """(masks, groups hit), int64[n] each, of rows [n, >= 6] in the order of RECORD_FIELDS."""
    found, hit = np.empty(len(rows), np.int64), np.empty(len(rows), np.int64)
    for n in numba.prange(len(rows)):
        mean_x, mean_y, a, b, c, opacity = rows[n, :6]
        x0, y0 = tiles[n]
        found[n] = group_finder.mask(REFERENCE, a, b, c, mean_x, mean_y, opacity, x0, y0, width, height)
        hit[n] = _hit_groups(group_tester.tile_bits(REFERENCE, a, b, c, mean_x, mean_y, opacity, x0, y0, width, height))
    return found, hit


def count(masks: np.ndarray) -> int:
    """Bits set."""
    return int((masks[:, None] >> np.arange(params.GROUPS) & 1).sum())


def compare(rows, tiles, width=8191, height=8191) -> float:
    """Groups found for one that is hit; fails when one that is hit was not found."""
    rows = np.ascontiguousarray(rows[:, :6], np.int64)
    found, hit = _compare(rows, np.ascontiguousarray(np.broadcast_to(tiles, (len(rows), 2))), width, height)
    missed = np.flatnonzero(hit & ~found)
    assert not missed.size, f"{missed.size} missed, first {rows[missed[0]].tolist()}"
    return count(found) / max(count(hit), 1)


def near_limit(rows: np.ndarray, x0: int, y0: int, seed: int) -> np.ndarray:
    """The rows with opacities that put the limit at, or one code beside, the form of a random pixel of the tile."""
    r = np.random.default_rng(seed)
    x, y = x0 + r.integers(0, params.TILE, len(rows)), y0 + r.integers(0, params.TILE, len(rows))
    u = (rows[:, 2] * (x + 0.5 - rows[:, 0] / 1024) + rows[:, 3] * (y + 0.5 - rows[:, 1] / 1024)) / (
        1 << REFERENCE.chol_f
    )
    v = rows[:, 4] * (y + 0.5 - rows[:, 1] / 1024) / (1 << REFERENCE.chol_f)
    top = limit(REFERENCE, 0) / (1 << 2 * REFERENCE.itu_f)
    code = np.rint((top - u * u - v * v) * (1 << REFERENCE.opacity_f)) + r.integers(-2, 3, len(rows))
    rows = rows.copy()
    rows[:, 5] = code.clip(0, (1 << REFERENCE.opacity_w) - 1)
    return rows


@pytest.mark.parametrize("kind", ["mixed", "needle", "huge", "far", "small", "codes"])
def test_no_group_is_missed(kind):
    for seed, tile in enumerate([(0, 0), (64, 128), (4032, 8064)]):
        rows = gaussians(30_000, seed, tile[0] + 28, tile[1] + 28, kind)
        if kind == "codes":  # within 128 pixels of the tile
            rows[:, :2] = (rows[:, :2] >> 6) + (np.array(tile) << REFERENCE.mean_f)
        ratio = compare(rows, tile)
        edge = compare(near_limit(rows, *tile, seed), tile)
        print(f"{kind}: {ratio:.3f} groups found for one hit, {edge:.3f} at the limit")


def test_no_group_is_missed_by_codes_at_the_ends_of_their_ranges():
    r = np.random.default_rng(1)
    n = 200_000
    size = np.minimum(2 ** r.uniform(0, REFERENCE.chol_w, (n, 3)), CHOL_MAX).astype(np.int64)
    size[r.random((n, 3)) < 0.2] = 0
    size[r.random((n, 3)) < 0.2] = CHOL_MAX
    size[:, 1] = np.where(r.random(n) < 0.5, size[:, 1], -size[:, 1] - 1)
    reach = 2 ** r.uniform(5, REFERENCE.mean_w - 1, (n, 2))
    mean = ((32 << REFERENCE.mean_f) + r.choice([-1, 1], (n, 2)) * reach).astype(np.int64)
    mean = mean.clip(-(1 << (REFERENCE.mean_w - 1)), (1 << (REFERENCE.mean_w - 1)) - 1)
    opacity = np.where(r.random(n) < 0.3, r.choice([0, limit(REFERENCE, 0) >> 7, 65535], n), r.integers(0, 65536, n))
    rows = np.column_stack([mean, size, opacity])
    compare(rows, (0, 0))
    compare(near_limit(rows, 0, 0, 2), (0, 0))


def test_no_group_is_missed_by_saturated_centres():
    """Means so far away that u, v or both saturate, with steps as large as they can be towards the tile."""
    r = np.random.default_rng(3)
    n = 100_000
    ends = np.array([1, CHOL_MAX >> 1, CHOL_MAX - 1, CHOL_MAX])
    size = r.choice(ends, (n, 3))
    size[:, 1] *= r.choice([-1, 1], n)
    mean = mean_code(32 + r.choice([-1, 1], (n, 2)) * r.uniform(0, 400, (n, 2)))
    ratio = compare(np.column_stack([mean, size, np.zeros(n, np.int64)]), (0, 0))
    print(f"{ratio:.3f} groups found for one hit")


@pytest.mark.parametrize("size", [(1, 1), (8, 33), (32, 32), (33, 8), (97, 130), (128, 64)])
def test_groups_outside_the_picture_are_not_found(size):
    everywhere = np.array([[0, 0, 1, 1, 1, 0]])
    for tile in tiles_of(*size):
        assert compare(everywhere, tile, *size) == 1


def test_needles_at_all_angles():
    """Long and thin: a needle passes between most of the corners that a box around it would take."""
    r = np.random.default_rng(5)
    n = 50_000
    chol = cholesky(np.full(n, 640.0), np.full(n, 0.0064), r.uniform(0, np.pi, n))
    rows = np.column_stack([mean_code(r.uniform(0, 64, (n, 2))), chol, opacity_code(np.full(n, 0.8))])
    ratio = compare(rows, (0, 0))
    print(f"{ratio:.3f} groups found for one hit")
    assert ratio < 1.3


@pytest.mark.parametrize("name", ["builtin:room?n=20000", "ukstreet@lod=1"])
def test_few_groups_of_a_scene_are_found_in_vain(name):
    if not name.startswith("builtin") and not SCENES.is_dir():
        pytest.skip("../shared/scenes is not there")
    g = scene.load(name if name.startswith("builtin") else str(SCENES / name))
    eye, at, up, fovy = cameras.default_view(g)
    camera = cameras.look_at(eye, at, up, fovy, 640, 384)
    features = encode(REFERENCE, project(g, camera))
    pairs = duplicate(REFERENCE, features, camera.width, camera.height)
    rows = np.column_stack([features.mean, features.chol, features.opacity])[pairs.index]
    tiles = np.repeat(tiles_of(camera.width, camera.height), np.diff(pairs.tile_offsets), axis=0)
    ratio = compare(rows, tiles, camera.width, camera.height)
    print(f"{name}: {len(rows)} entries, {ratio:.3f} groups found for one hit")
    assert ratio < 1.08
