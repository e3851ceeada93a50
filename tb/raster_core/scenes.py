"""Random scenes in record codes for the benches and tests of the raster core."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from golden import params, records
from golden.formats import BUILD
from golden.raster_core.group_tester import tile_bits
from tb.lib.footprints import edges


def scene(n: int, width: int, height: int, seed: int = 0, sigma: float = 3.0, opaque: float = 0.5) -> SimpleNamespace:
    """Random Gaussians over and around a width x height picture, some of them needles; a share is opaque."""
    r = np.random.default_rng(seed)
    mean = r.uniform(-16, [width + 16, height + 16], (n, 2))
    minor = np.exp(r.normal(np.log(sigma), 0.7, n)).clip(0.55, 300)
    major = (minor * np.exp(np.abs(r.normal(0, 1.2, n)))).clip(0.55, 2000)
    angle = r.uniform(0, np.pi, n)
    cos, sin = np.cos(angle), np.sin(angle)
    xx = (cos / major) ** 2 + (sin / minor) ** 2
    xy = cos * sin * (major**-2.0 - minor**-2.0)
    a = np.sqrt(xx)
    chol = np.stack([a, xy / a, 1 / (a * major * minor)], axis=1) * np.sqrt(np.log2(np.e) / 2)
    alpha = np.where(r.random(n) < opaque, r.uniform(0.7, 1, n), r.uniform(0.004, 0.3, n))
    return SimpleNamespace(
        mean=np.rint(np.ldexp(mean, BUILD.mean_f)).astype(np.int64),
        chol=np.rint(np.ldexp(chol, BUILD.chol_f)).astype(np.int64),
        opacity=np.rint(np.ldexp(-np.log2(alpha), BUILD.opacity_f)).astype(np.int64),
        colour=r.integers(0, BUILD.colour_max + 1, (n, 3)),
        key=r.integers(0, 1 << BUILD.key_w, n),
    )


def on_edges(n: int, width: int, height: int, tile: tuple[int, int]) -> SimpleNamespace:
    """n Gaussians whose hits in the tile one code of a field changes."""
    found = scene(64, width, height, seed=5, sigma=6.0)
    rows = np.column_stack([found.chol, found.mean, found.opacity])
    rows = edges(rows, lambda row: tile_bits(BUILD, *row.tolist(), *tile, width, height))
    rows = rows[np.linspace(0, len(rows) - 1, n).astype(int)]
    fill = scene(n, width, height)
    return SimpleNamespace(mean=rows[:, 3:5], chol=rows[:, :3], opacity=rows[:, 5], colour=fill.colour, key=fill.key)


def walls(n: int) -> SimpleNamespace:
    """n opaque Gaussians that cover everything near the origin."""
    step = 1 << (BUILD.chol_f - 6)
    return SimpleNamespace(
        mean=np.full((n, 2), 32 << BUILD.mean_f),
        chol=np.tile([step, 0, step], (n, 1)),
        opacity=np.zeros(n, np.int64),
        colour=np.full((n, 3), 1 << (BUILD.colour_f - 1)),
        key=np.arange(n),
    )


def tiles(width: int, height: int) -> np.ndarray:
    """[T, 2] origins, row-major."""
    return np.array([(x, y) for y in range(0, height, params.TILE) for x in range(0, width, params.TILE)])


def every_entry(features: SimpleNamespace, tile_n: int) -> tuple[np.ndarray, np.ndarray]:
    """(offsets, words): each tile lists every Gaussian in the order of the keys, with a stale key of 0."""
    n = len(features.opacity)
    words = records.entries(np.zeros(n, np.int64), np.lexsort((np.arange(n), features.key)))
    return np.arange(tile_n + 1) * n, np.tile(words, tile_n)


def record_words(features: SimpleNamespace) -> list[int]:
    """Feature records as the memory holds them."""
    return [int.from_bytes(row.tobytes(), "little") for row in records.record_bytes(BUILD, features)]
