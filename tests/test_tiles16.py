"""16-pixel tiles against the bitmaps, box counts against cut polygons, and the GPU's bytes against the paper's."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from golden.frame import Renderer
from golden.hard_cases.setting import camera_a
from golden.settings import Settings
from golden.timing import gpu
from golden.timing.tiles16 import boxes, split
from tests.test_preprocess import random_scene, tilted


@pytest.mark.parametrize(("width", "height"), [(64, 64), (200, 136), (90, 17), (16, 70)])
def test_split_equals_the_bits_of_the_bitmaps(width, height):
    frame = Renderer(random_scene(1200, width), Settings(), "full").frame(tilted(width, height))
    got = split(frame.order.offsets, frame.raster.bitmaps, width, height)
    columns, rows = -(-width // 16), -(-height // 16)
    want = [[] for _ in range(columns * rows)]
    across = -(-width // 64)
    for tile in range(len(frame.order.offsets) - 1):
        for e in range(frame.order.offsets[tile], frame.order.offsets[tile + 1]):
            parts: dict[int, int] = {}
            for bit in range(64):
                if int(frame.raster.bitmaps[e]) >> bit & 1:
                    x, y = tile % across * 8 + bit % 8, tile // across * 8 + bit // 8  # in subtiles
                    small = y // 2 * columns + x // 2
                    parts[small] = parts.get(small, 0) | 1 << (2 * (y % 2) + x % 2)
            for small, bits in parts.items():
                want[small].append((e, bits))
    assert np.diff(got.offsets).tolist() == [len(x) for x in want]
    assert list(zip(got.entry.tolist(), got.bits.tolist())) == [pair for part in want for pair in part]
    assert got.pairs.tolist() == [sum(bits.bit_count() for _, bits in part) for part in want]
    assert got.pairs.sum() == frame.raster.pairs.sum() > 100


def screen(*rows: tuple[float, ...]) -> SimpleNamespace:
    """A projection of (x, y, long sigma, short sigma, degrees)."""
    x, y, long, short, turn = np.array(rows, float).T
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    xx, yy = (long * c) ** 2 + (short * s) ** 2, (long * s) ** 2 + (short * c) ** 2
    cov = np.stack([xx, (long**2 - short**2) * c * s, yy], 1)
    return SimpleNamespace(
        mean2d=np.stack([x, y], 1), cov2d=cov, det=(long * short) ** 2, visible=np.ones(len(rows), bool)
    )


def test_boxes_of_gaussians_made_by_hand():
    circle = screen((40.5, 40.5, 2, 2, 0))  # radius ceil(3 sqrt(4 + sqrt(0.1))) = 7: 33..47 is one tile
    assert boxes(circle, 128, 128) == (1, 1)
    assert boxes(screen((48, 48, 2, 2, 0)), 128, 128) == (4, 4)
    # the square takes every tile; the box, 19..109 along the diagonal, 6 on it and 2 at each of 5 corners it passes
    assert boxes(screen((64, 64, 20, 1, 45)), 128, 128) == (64, 16)
    flat = screen((64, 8, 20, 1, 0))  # 4..124 x 5..11, all in the first row
    assert boxes(flat, 128, 128) == (8 * 5, 8)
    assert boxes(screen((-90, 64, 20, 1, 45)), 128, 128) == (0, 0)
    hidden = screen((64, 64, 20, 1, 45))
    hidden.visible[:] = False
    assert boxes(hidden, 128, 128) == (0, 0)


def cut(polygon: list[tuple[float, float]], nx: float, ny: float, limit: float) -> list[tuple[float, float]]:
    """The part of a convex polygon where nx x + ny y <= limit."""
    out = []
    for (ax, ay), (bx, by) in zip(polygon, polygon[1:] + polygon[:1]):
        a, b = nx * ax + ny * ay - limit, nx * bx + ny * by - limit
        if a <= 0:
            out.append((ax, ay))
        if (a < 0 < b) or (b < 0 < a):
            t = a / (a - b)
            out.append((ax + t * (bx - ax), ay + t * (by - ay)))
    return out


def test_oriented_boxes_equal_cut_polygons():
    rng = np.random.default_rng(2)
    rows = [
        (*rng.uniform(-20, 150, 2), long, long / rng.uniform(2.05, 30), rng.uniform(0, 180))
        for long in rng.uniform(1, 30, 60)
    ]
    for row in rows:
        x, y, long, short, turn = row
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        count = 0
        for tile in range(64):
            x0, y0 = tile % 8 * 16, tile // 8 * 16
            shape = [(x0, y0), (x0 + 16, y0), (x0 + 16, y0 + 16), (x0, y0 + 16)]
            for nx, ny, half in ((c, s, 3 * long), (-s, c, 3 * short)):
                shape = cut(shape, nx, ny, nx * x + ny * y + half)
                shape = cut(shape, -nx, -ny, -(nx * x + ny * y) + half)
            count += bool(shape)
        assert boxes(screen(row), 128, 128).oriented == count


def test_box_counts_of_a_scene_bound_the_exact_lists():
    frame = Renderer(random_scene(1500, 9), Settings(), "full").frame(camera_a())
    counts = boxes(frame.projection, 128, 128)
    exact = split(frame.order.offsets, frame.raster.bitmaps, 128, 128).entry.size
    assert 0 < counts.oriented < counts.square and exact < counts.square


def test_gpu_bytes_at_the_point_the_paper_implies():
    """QHD, 30.5 M entries, 0.32 M visible of about 1 M: 6.8, 316 and 28 GB in 60 frames, 9.9 frames a second."""
    frame = gpu.frame(1_000_000, 3, 320_000, 30_500_000, 2560, 1440, 0.7)
    gigabytes = {stage: 60 * sum(moved.values()) / 1e9 for stage, moved in frame.bytes.items()}
    assert gigabytes == pytest.approx({"preprocess": 6.8, "sorting": 316, "raster": 28}, rel=0.02)
    assert gigabytes["sorting"] / sum(gigabytes.values()) == pytest.approx(0.908, abs=0.01)
    assert 1 / sum(frame.seconds.values()) == pytest.approx(9.9, rel=0.1)


def test_gpu_small_frame_by_hand():
    frame = gpu.frame(10, 0, 4, 5, 32, 16, 1.0)
    assert gpu.radix_passes(2) == 5 and gpu.radix_passes(14400) == 6 and gpu.radix_passes(1) == 4
    assert frame.bytes == {
        "preprocess": {"read": 10 * 12 + 4 * (32 + 12), "write": 10 * 8 + 4 * 64},
        "sorting": {"read": 5 * (16 + 5 * 12), "write": 5 * 6 * 12},
        "raster": {"read": 5 * 13, "write": 32 * 16 * 20},
    }
    assert frame.seconds["raster"] == pytest.approx(max(10305 / (204.8e9 * 0.8), 5 * 256 * 30 / (2048 * 1.3e9)))
