"""Approximate tests of what a Gaussian touches, and the rule that drops the last layer: golden model only."""

from __future__ import annotations

import math

import numpy as np
import pytest

from golden import formats, oracle, params, records
from golden.formats import REFERENCE, make
from golden.frame import Renderer
from golden.preprocess import duplicate, encode, project
from golden.raster_core import bounds
from golden.raster_core.group_tester import tile_bits
from golden.settings import parse
from tests.test_formats import ROOM, SIZE, room_camera
from tests.test_preprocess import random_scene, tilted


def touched(f, row, slack: float) -> int:
    """Subtiles of the tile at (0, 0) in whose rectangle of centres a fine grid finds a place inside f.bound's shape."""
    a, b, c = (v / 2.0**f.chol_f for v in row[:3])
    conic = np.array([[a * a, a * b], [a * b, b * b + c * c]])
    limit = (f.cut - (row[5] << (f.power_f - f.opacity_f))) / 2**f.power_f
    values, vectors = np.linalg.eigh(conic)
    axes = np.sqrt(9 * math.log2(math.e) / 2 / values) + slack
    half = np.sqrt(max(limit, 0) * np.diag(np.linalg.inv(conic))) + slack
    centre = np.linspace(0, 7, 71) + 8 * np.arange(8)[:, None] + 0.5
    x, y = centre.ravel() - row[3] / 2**f.mean_f, centre.ravel()[:, None] - row[4] / 2**f.mean_f
    if f.bound == bounds.BOX:
        inside = (np.abs(x) <= half[0]) & (np.abs(y) <= half[1])
    elif f.bound == bounds.CIRCLE:
        inside = np.hypot(x, y) <= axes[0]
    else:
        inside = (np.abs(x * vectors[0, 0] + y * vectors[1, 0]) <= axes[0]) & (
            np.abs(x * vectors[0, 1] + y * vectors[1, 1]) <= axes[1]
        )
    found = inside.reshape(8, 71, 8, 71).any(axis=(1, 3)).ravel() & (limit >= 0)
    return sum(1 << int(s) for s in np.flatnonzero(found))


@pytest.mark.parametrize("bound", formats.BOUNDS[1:])
def test_bounds_are_the_shapes_of_their_names(bound):
    f = make(bound=bound)
    features = encode(f, project(random_scene(200, 9, terms=1), tilted(*SIZE)))
    seen = 0
    for i in np.flatnonzero(features.visible):
        row = [int(v) for v in (*features.chol[i], *features.mean[i], features.opacity[i])]
        bits = int(tile_bits(f, *row, 0, 0, 64, 64))
        assert touched(f, row, 0) & ~bits == 0 and bits & ~touched(f, row, 0.2) == 0
        if f.bound == bounds.BOX:
            assert int(tile_bits(REFERENCE, *row, 0, 0, 64, 64)) & ~bits == 0
        seen += bits.bit_count()
    assert seen > 100


@pytest.mark.parametrize("bound", formats.BOUNDS[1:])
def test_tables_list_what_the_bound_touches(bound):
    f = make(bound=bound)
    features = encode(f, project(random_scene(300, 10, terms=1), tilted(*SIZE)))
    pairs = duplicate(f, features, *SIZE)
    for tile, (x, y) in enumerate((x, y) for y in (0, 64) for x in (0, 64, 128)):
        rows = np.column_stack([features.chol, features.mean, features.opacity]).astype(np.int64)
        want = [i for i in np.flatnonzero(features.visible) if bounds.tile_bits(f, *rows[i], x, y, *SIZE)]
        assert pairs.index[pairs.tile_offsets[tile] : pairs.tile_offsets[tile + 1]].tolist() == want


def test_drop_last_loses_the_layer_that_would_stop_the_pixel():
    camera = room_camera()
    both = {
        rule: Renderer(ROOM, parse(["stop_threshold=0.05", f"stop_rule={rule}"])).frame(camera)
        for rule in formats.STOP_RULES
    }
    t_stop = both["drop-last"].formats.t_stop
    left = {rule: frame.raster.transmittance for rule, frame in both.items()}
    assert (left["drop-last"] >= t_stop).all() and (left["blend-last"] < t_stop).mean() > 0.1
    frame = both["drop-last"]
    tables = frame.order.offsets, records.indices_of(frame.order.words), params.TILE
    given = oracle.render_injected(frame.formats, frame.features, frame.projection, tables, *SIZE)
    assert np.abs(frame.image - given).max() * 255 < 0.25
    truth = oracle.render(frame.projection, camera, stop=0.05, rule="drop-last")
    assert np.mean(np.abs(frame.image - truth).max(axis=2) * 255 > 1) < 0.02
