"""Preprocessing's lines, block by block, against sets of bytes; clusters against the projection; the address map."""

from __future__ import annotations

from collections import Counter, OrderedDict
from dataclasses import fields
from itertools import pairwise

import numpy as np
import pytest

from golden.formats import REFERENCE
from golden.frame import Renderer
from golden.hard_cases.setting import camera_a, gaussians, merge, yaw
from golden.records import indices_of
from golden.settings import Settings
from golden.timing import clusters
from golden.timing.address_map import BLOCK, LINE, PAGE, Formats, image_lines, list_lines, list_starts, regions
from golden.timing.combine import append, flush, new_buffer
from golden.timing.preprocess_engine import preprocess, tiles_in_box
from golden.timing.preprocess_lines import CULL_CYCLES, KINDS
from tests.test_preprocess import random_scene, tilted

SIZE = 200, 136
FORMATS = {
    "neo": Formats(),
    "splatcore": Formats(clusters=True, record_stride=24, colour_every=2, reach=True, degree=2, combine_lines=3),
    "artifact": Formats(
        position_bytes=6, rest_stride=128, record_stride=64, membership=False, incoming_lines="artifact"
    ),
    "gscore": Formats(degree=0, membership=False, incoming_bytes=8, combine_lines=512),
}


def crowd(seed: int):
    """Ten bunches around the camera, mixed in the file; some Gaussians of one bunch cover the picture."""
    rng = np.random.default_rng(seed)
    n = 2600
    bunch = np.arange(n) % 10
    angle = bunch * 0.2 * np.pi
    means = rng.normal(0, 0.5, (n, 3)) + 5 * np.stack([np.sin(angle), 0 * angle, np.cos(angle)], 1)
    scales = rng.uniform(0.01, 0.1, (n, 3))
    scales[bunch == 0] *= rng.choice([1, 40], (n // 10, 1), p=[0.95, 0.05])
    return gaussians(means, scales=scales, opacities=rng.uniform(0.003, 1, n), colours=rng.random((n, 3)))


def touched(*ranges: tuple[int, int]) -> set[int]:
    """Lines of byte ranges (begin, size)."""
    return {line for begin, size in ranges if size for line in range(begin // LINE, (begin + size - 1) // LINE + 1)}


@pytest.mark.parametrize("name", FORMATS)
def test_lines_of_blocks_equal_sets_of_bytes(name):
    """Three frames of a turning camera; what a block needs and no block before it has brought is read, once."""
    f = FORMATS[name]
    scene = crowd(3)
    n = len(scene)
    stored = clusters.store(scene, f.clusters)  # along the curve where clusters are culled
    renderer = Renderer(scene, Settings(colour_every=f.colour_every))
    last = seen_before = kept_sizes = None
    frames_with = Counter()
    for number, angle in enumerate((0, 3, 120)):
        frame = renderer.frame(camera_a(*SIZE, rotation=yaw(angle)))
        at = regions(f, n, *SIZE, 4 * frame.order.words.size)
        starts = list_starts(at.incoming[number & 1], np.diff(frame.incoming.offsets), f.incoming_bytes)
        listed = indices_of(frame.incoming.words)
        got = preprocess(stored, f, at, frame, last, number, (starts, frame.incoming.offsets, listed), 4)
        visible = frame.features.visible
        before = np.zeros(n, bool) if seen_before is None or not f.membership else seen_before
        tiles = tiles_in_box(frame, f.tile)
        alive = clusters.seen(frame.camera, stored.centre, stored.spread, stored.block_reach)
        near = clusters.seen(frame.camera, stored.means, np.zeros(n), stored.reach)
        brought, written_members = set(), set()
        kept, sizes = 0, Counter()
        for b in range(stored.blocks):
            places = range(b * BLOCK, min((b + 1) * BLOCK, n))
            who = [(p, stored.order[p]) for p in places]
            lives = alive[b] or not f.clusters
            now = [(p, g) for p, g in who if visible[g]]
            want = touched((at.clusters + 32 * b, 32 * f.clusters))
            want |= touched((at.blocks[1 - number & 1] + 8 * b, 8 * f.membership))
            if lives:
                want |= touched((at.positions + places[0] * f.position_stride, len(places) * f.position_stride))
                rest = [(p, g) for p, g in who if (near[g] if f.reach else visible[g])]
                assert {g for _, g in now} <= {g for _, g in rest}
                want |= touched(*((at.rest + p * f.rest_step, f.rest_bytes) for p, _ in rest))
                if f.split:
                    old = [(p, g) for p, g in now if not frame.coloured[g]]
                    frames_with["old"] += len(old)
                    new = set(now) - set(old)
                    want |= touched(*((at.harmonics + p * f.harmonics_bytes, f.harmonics_bytes) for p, _ in new))
                    want |= touched(*((at.colours + p * 5, 5) for p, _ in old))
            if last is not None and f.membership and any(before[g] for _, g in who):
                size = last.end[b] - last.begin[b] if lives else 32
                assert last.end[b] - last.begin[b] == kept_sizes[b]
                frames_with["culled membership"] += not lives
                want |= touched((at.members[1 - number & 1] + last.begin[b], size))
            read = got.blocks.read[got.blocks.read_at[b] : got.blocks.read_at[b + 1]].tolist()
            assert sorted(read) == sorted(want - brought)
            brought |= want

            records = {g for _, g in now} | {g for _, g in who if before[g]}
            want = touched(*((at.features[number & 1] + p * f.record_stride, 24) for p, g in who if g in records))
            want |= touched(*((at.colours + p * 5, 5 * f.split) for p, g in now if frame.coloured[g]))
            if f.membership and (b % 8 == 7 or b == stored.blocks - 1):
                want |= touched((at.blocks[number & 1] + 8 * b, 8))
            written = got.blocks.write[got.blocks.write_at[b] : got.blocks.write_at[b + 1]].tolist()
            members = [line for line in written if at.members[number & 1] <= line * LINE < at.features[0]]
            appended = [line for line in written if at.incoming[0] <= line * LINE < at.scratch]
            assert sorted(written) == sorted([*want, *members, *appended])
            if f.membership and now:
                sizes[b] = 32 + sum(8 + max(0, -(-(int(tiles[g]) - 40) // 8)) for _, g in now)
                kept += sizes[b]
            written_members |= set(members)
            full = kept if b == stored.blocks - 1 else kept // LINE * LINE
            assert written_members == touched((at.members[number & 1], full))

            tests = [int(tiles[g]) for _, g in now]
            fresh = sum(frame.coloured[g] for _, g in now)
            cycles = max(len(places) / 4, fresh * (f.degree + 1) ** 2 / 4, sum(tests) / 4, *tests, 0)
            assert got.blocks.cycles[b] == (int(np.ceil(cycles)) if lives else CULL_CYCLES)
            frames_with["culled"] += not lives
        assert got.lines[:, 0].sum() == got.blocks.read.size and got.lines[:, 1].sum() == got.blocks.write.size
        incoming = got.lines[KINDS.index("incoming"), 1]
        if f.incoming_lines == "artifact":
            assert incoming == 3 * listed.size
        else:
            assert list_lines(np.diff(frame.incoming.offsets), f.incoming_bytes) <= incoming <= listed.size * 2
        last, seen_before, kept_sizes = got.members, visible, sizes
    if name == "splatcore":
        assert frames_with["old"] and frames_with["culled"] and frames_with["culled membership"]


def test_a_giant_keeps_one_duplication_unit_busy():
    """100 tiles, so 60 bits of membership data beside the first 40."""
    f = Formats()
    scene = gaussians([(0, 0, 2), (0.5, 0.5, 3)], scales=[(9, 9, 9), (1e-3, 1e-3, 1e-3)])
    frame = Renderer(scene, Settings()).frame(camera_a(640, 640))
    at = regions(f, 2, 640, 640, 1000)
    starts = list_starts(at.incoming[0], np.diff(frame.incoming.offsets), 6)
    lists = starts, frame.incoming.offsets, indices_of(frame.incoming.words)
    got = preprocess(clusters.store(scene, False), f, at, frame, None, 0, lists, 4)
    assert tiles_in_box(frame, 64).tolist() == [100, 1]
    assert got.blocks.cycles.tolist() == [100]
    assert got.members.end.tolist() == [32 + 8 + 8 + 8]


def test_membership_of_the_last_frame_gives_the_incoming_lists():
    """Reading back who touched a tile in the last frame replaces reading the tables."""
    renderer = Renderer(crowd(4), Settings())
    touches = None
    for step in range(4):
        frame = renderer.frame(camera_a(*SIZE, rotation=yaw(2 * step)))
        tiles = np.repeat(np.arange(len(frame.pairs.tile_offsets) - 1), np.diff(frame.pairs.tile_offsets))
        now = set(zip(tiles.tolist(), frame.pairs.index.tolist()))
        if touches is not None:
            tiles = np.repeat(np.arange(len(frame.incoming.offsets) - 1), np.diff(frame.incoming.offsets))
            listed = set(zip(tiles.tolist(), indices_of(frame.incoming.words).tolist()))
            assert listed == now - touches and listed
        touches = now


# ---- clusters and the order in memory


@pytest.mark.parametrize("seed", range(8))
def test_no_sphere_is_culled_that_holds_a_visible_gaussian(seed):
    """Needles and giants beside and behind the camera included, where the ellipse is far larger than the Gaussian."""
    rng = np.random.default_rng(seed)
    wild = gaussians(
        rng.normal(0, 3, (6000, 3)), scales=10 ** rng.uniform(-3, 1, (6000, 3)), opacities=rng.uniform(0, 1, 6000),
        quats=rng.normal(0, 1, (6000, 4)),
    )  # fmt: skip
    scene = merge(wild, random_scene(3000, seed))
    camera = tilted(130 + 40 * seed, 170)
    visible = Renderer(scene, Settings(antialias="on" if seed & 1 else "off")).preprocess(camera)[1].visible
    stored = clusters.store(scene, True)
    one = clusters.seen(camera, stored.means, np.zeros(len(scene)), stored.reach)
    assert not (visible & ~one).any() and visible.sum() > 100
    assert one.mean() < 0.95
    alive = clusters.seen(camera, stored.centre, stored.spread, stored.block_reach)
    assert not (visible[stored.order] & ~np.repeat(alive, BLOCK)[: len(scene)]).any()


def test_clusters_far_from_the_view_are_culled():
    rng = np.random.default_rng(1)
    means = np.concatenate(
        [rng.normal(0, 0.3, (BLOCK, 3)) + at for at in ((0, 0, 5), (9, 0, 5), (0, 0, -5), (0, 9, 5))]
    )
    stored = clusters.store(gaussians(means, scales=0.05), False)
    alive = clusters.seen(camera_a(), stored.centre, stored.spread, stored.block_reach)
    assert alive.tolist() == [True, False, False, False]
    faint = clusters.store(gaussians(means, scales=0.05, opacities=0.001), False)
    assert not clusters.seen(camera_a(), faint.centre, faint.spread, faint.block_reach).any()


def test_morton_order():
    grid = np.array([(x, y, z) for z in range(4) for y in range(4) for x in range(4)], float)
    order = clusters.morton_permutation(grid)
    walk = grid[order]
    assert walk[:8].tolist() == [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    assert all(np.ptp(walk[k : k + 8], axis=0).max() == 1 for k in range(0, 64, 8))
    assert clusters.morton_permutation(np.zeros((5, 3))).tolist() == [0, 1, 2, 3, 4]
    assert clusters.morton_permutation(np.zeros((0, 3))).size == 0
    scene = random_scene(700, 5)
    stored = clusters.store(scene, True)
    assert np.array_equal(np.sort(stored.order), np.arange(700))
    assert np.array_equal(stored.order[stored.place], np.arange(700))


# ---- write combining


def reference_writes(appends: list[int], starts: list[int], size: int, slots: int) -> list[int]:
    """Lines as they are written: an ordered dictionary of open lines."""
    opened: OrderedDict[int, int] = OrderedDict()
    filled = Counter()
    out = []
    for tile in appends:
        if tile not in opened and len(opened) == slots:
            out.append(opened.popitem(last=False)[1])
        for byte in range(starts[tile] + filled[tile], starts[tile] + filled[tile] + size):
            opened[tile] = byte // LINE
            opened.move_to_end(tile)
            if byte % LINE == LINE - 1:
                out.append(opened.pop(tile))
        filled[tile] += size
    return out + sorted(opened.values())


@pytest.mark.parametrize("size", [4, 6, 8])
@pytest.mark.parametrize("slots", [1, 3, 20])
def test_write_combining_equals_a_dictionary(size, slots):
    rng = np.random.default_rng(slots)
    appends = rng.integers(0, 9, 700) // rng.integers(1, 4, 700)
    starts = list_starts(4096, np.bincount(appends, minlength=9), size)
    buffer = new_buffer(9, slots)
    out = np.empty(3 * len(appends), np.int64)
    at = 0
    for tile in appends:
        at = append(buffer, out, at, tile, starts, size, False)
    end = flush(buffer, out, at, starts)
    expected = reference_writes(appends.tolist(), starts.tolist(), size, slots)
    assert out[:at].tolist() + sorted(out[at:end].tolist()) == expected
    if slots == 20:  # a line for each tile: every line once
        assert end == list_lines(np.bincount(appends, minlength=9), size)


# ---- addresses


@pytest.mark.parametrize("name", FORMATS)
def test_regions_do_not_overlap(name):
    f = FORMATS[name]
    at = regions(f, 1000, *SIZE, 5000)
    tiles = -(-SIZE[0] // f.tile) * -(-SIZE[1] // f.tile)
    lists = 5000 * 16 + tiles * LINE
    need = {
        "positions": 1000 * f.position_stride, "rest": 1000 * f.rest_step, "clusters": 4 * 32, "blocks": 4 * 8,
        "harmonics": 1000 * f.harmonics_bytes * f.split, "colours": 5000 * f.split,
        "members": 4 * 32 + 1000 * (8 + -(-tiles // 8)),
        "features": 1000 * f.record_stride, "incoming": lists, "scratch": lists, "tables": lists,
        "image": image_lines(*SIZE) * LINE,
    }  # fmt: skip
    spans = []
    for field in fields(at):
        value = getattr(at, field.name)
        if field.name != "end":
            spans += [(b, b + need[field.name]) for b in (value if isinstance(value, tuple) else (value,))]
    spans.sort()
    assert all(begin % PAGE == 0 for begin, _ in spans)
    assert all(end <= begin for (_, end), (begin, _) in pairwise(spans)) and spans[-1][1] <= at.end


def test_lists_start_with_lines():
    starts = list_starts(640, np.array([0, 1, 10, 11, 0]), REFERENCE.entry_bytes)
    assert starts.tolist() == [640, 640, 704, 768, 896, 896]
    assert list_lines(np.array([0, 1, 10, 11, 0]), REFERENCE.entry_bytes) == 4
    assert image_lines(128, 3) == 24 and image_lines(130, 3) == 27
