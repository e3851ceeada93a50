"""What each sorting strategy does to the tables, frame by frame, and which colours are kept."""

from __future__ import annotations

import numpy as np
import pytest

from golden import metrics, scene
from golden.errors import InputError
from golden.formats import REFERENCE
from golden.frame import Frame, Renderer, parse_sorting, tiles_of
from golden.hard_cases.setting import camera_a, yaw
from golden.raster_core.raster_core import rasterise
from golden.records import INVALID, entries, indices_of
from golden.settings import Settings, parse
from tests.hard_cases.test_tables import check_invariants, crowd

STRATEGIES = ["reuse", "full", "hierarchical", "periodic:3", "background:2"]


def track(count: int, degrees: float = 1.0) -> list:
    return [camera_a(rotation=yaw(degrees * step), position=(0.02 * step, 0, 0)) for step in range(count)]


def frames(sorting: str, cameras: list, n: int = 2000, **keys) -> list[Frame]:
    renderer = Renderer(crowd(21, n), Settings(**keys), sorting)
    return [renderer.frame(camera) for camera in cameras]


def same(a: Frame, b: Frame) -> bool:
    return np.array_equal(a.order.words, b.order.words) and np.array_equal(a.raster.value, b.raster.value)


@pytest.mark.parametrize(
    "text", ["reuse", "full", "hierarchical", "periodic:1", "periodic:12", "background:3", "shuffled:7"]
)
def test_strategies_are_read(text):
    kind, _, number = text.partition(":")
    assert parse_sorting(text) == (kind, int(number or 1))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "neo",
        "full:2",
        "reuse:",
        "periodic",
        "periodic:",
        "periodic:0",
        "background:-1",
        "background:1.5",
        "shuffled",
    ],
)
def test_other_strategies_are_refused_with_what_is_valid(text):
    with pytest.raises(InputError, match=r"reuse, full, hierarchical, periodic:K, background:D"):
        parse_sorting(text)


def test_hierarchical_sorts_the_whole_table_by_the_keys_it_has():
    for frame in frames("hierarchical", track(5)):
        check_invariants(frame)
        for t in range(4):
            assert (np.diff(frame.order.tile(t)) > 0).all()
    assert frame.sorting == "hierarchical"
    assert frame.counters["full_frames"] == 0


def test_shuffled_tables_hold_the_same_in_an_order_that_the_seed_gives():
    cameras = track(3)
    full, one, again, other = (frames(name, cameras) for name in ("full", "shuffled:1", "shuffled:1", "shuffled:2"))
    for k in range(3):
        assert same(one[k], again[k]) and not same(one[k], other[k]) and not same(one[k], full[k])
        for t in range(4):
            assert (np.sort(one[k].order.tile(t)) == full[k].order.tile(t)).all()
    assert one[2].sorting == "full"


def test_the_stale_keys_cost_the_accuracy_and_not_the_chunks():
    cameras = track(6, 2.0)
    last = {name: frames(name, cameras, 6000)[-1] for name in ("reuse", "hierarchical", "full")}
    truth = last["full"].image
    chunked, whole = (metrics.compare(last[name].image, truth)["psnr_db"] for name in ("reuse", "hierarchical"))
    assert abs(chunked - whole) < 1 and whole < 60


def test_periodic_draws_the_frozen_tables_between_full_sorts():
    cameras = track(7)
    result, full = frames("periodic:3", cameras), frames("full", cameras)
    assert [frame.sorting for frame in result] == ["full", "frozen", "frozen"] * 2 + ["full"]
    assert [frame.counters["full_frames"] for frame in result] == [1, 0, 0, 1, 0, 0, 1]
    for number, frame in enumerate(result):
        start = result[number // 3 * 3]
        assert same(start, full[number // 3 * 3])
        assert np.array_equal(frame.order.words, start.order.words)
        assert (frame.incoming.words.size == 0) == (number % 3 > 0)
        drawn = rasterise(
            REFERENCE,
            (start.order.offsets, start.order.words),
            frame.features,
            tiles_of(128, 128),
            128,
            128,
            (0, 0, 0),
        )
        assert np.array_equal(drawn.value, frame.raster.value)
    assert not np.array_equal(result[1].raster.value, full[1].raster.value)


@pytest.mark.parametrize("sorting", ["periodic:1", "full"])
def test_every_frame_from_scratch_equals_cold_starts(sorting):
    cameras = track(3)
    for camera, frame in zip(cameras, frames(sorting, cameras)):
        assert same(frame, frames("reuse", [camera])[0])


def test_what_left_the_picture_is_drawn_to_nothing_while_frozen():
    behind = [camera_a(), camera_a(rotation=yaw(180))]
    frame = frames("periodic:2", behind)[-1]
    assert frame.order.words.size > 0
    assert not frame.features.visible[indices_of(frame.order.words)].any()
    assert not frame.raster.value.any() and (frame.raster.words_out >= INVALID).all()


def test_background_draws_what_was_sorted_before():
    cameras = track(6)
    result, full = frames("background:2", cameras), frames("full", cameras)
    assert [frame.sorting for frame in result] == ["full"] + ["background"] * 5
    for number, frame in enumerate(result):
        assert np.array_equal(frame.order.words, full[max(number - 2, 0)].order.words)
        own = [np.sort(frame.incoming.tile(t)) for t in range(4)]  # sorted in this frame, drawn in a later one
        assert np.array_equal(np.concatenate(own), full[number].order.words)


@pytest.mark.parametrize("sorting", STRATEGIES)
def test_a_declared_cut_equals_a_cold_start(sorting):
    renderer = Renderer(crowd(22, 1500), Settings(), sorting)
    for camera in track(4):
        renderer.frame(camera)
    away = camera_a(rotation=yaw(10), position=(0, 0, 1))
    after = renderer.frame(away, cut=True)
    assert same(after, Renderer(crowd(22, 1500), Settings()).frame(away))
    assert after.sorting == "full" and after.counters["full_frames"] == 1
    assert same(renderer.frame(away), after)


@pytest.mark.parametrize("sorting", STRATEGIES)
def test_a_picture_of_another_size_starts_anew(sorting):
    renderer = Renderer(crowd(23, 800), Settings(), sorting)
    renderer.frame(camera_a())
    frame = renderer.frame(camera_a(192, 128))
    assert same(frame, Renderer(crowd(23, 800), Settings()).frame(camera_a(192, 128)))


@pytest.mark.parametrize("sorting", ["hierarchical", "periodic:2", "background:1"])
def test_an_overfull_tile_keeps_the_nearest(sorting):
    for frame in frames(sorting, track(3, 0.0), capacity=256):
        assert frame.sorting == "frozen" or frame.counters["overflow"] > 0
        assert frame.order.lengths.max() == 256


def test_a_tile_with_much_that_is_new_is_rebuilt_when_asked_for():
    cameras = track(3, 6.0)
    assert frames("reuse", cameras, cut_share=1)[-1].counters["rebuilt_tiles"] == 0
    frame = frames("reuse", cameras, cut_share=1, rebuild_share="0.05")[-1]
    assert frame.counters["rebuilt_tiles"] > 0 and frame.counters["full_frames"] == 0
    now = frame.pairs.tile_offsets
    for t in np.flatnonzero(frame.table.lengths == 0):
        members = frame.pairs.index[now[t] : now[t + 1]]
        assert np.array_equal(frame.order.tile(t), np.sort(entries(frame.features.key[members], members)))


def test_consistent_keys_of_incoming_entries_are_of_the_last_camera():
    cameras = track(3, 3.0)
    before, _, frame = frames("reuse", cameras, depth="consistent", cut_share=1)
    middle = frames("reuse", cameras[1:2])[0]
    index = indices_of(frame.incoming.words)
    seen = middle.features.visible[index]
    assert seen.any() and before.incoming.words.size
    assert np.array_equal(frame.incoming.words[seen], entries(middle.features.key[index], index)[seen])


def test_colours_are_kept_for_some_frames():
    gaussians = scene.load("builtin:room?n=3000&sh=2")
    cameras = [camera_a(position=(0.1 * step, -1.2, -1)) for step in range(4)]
    fresh, kept = Renderer(gaussians, Settings()), Renderer(gaussians, Settings(colour_every=3))
    index = np.arange(len(gaussians))
    visible, colour = np.zeros(len(gaussians), bool), None
    for number, camera in enumerate(cameras):
        truth, frame = fresh.frame(camera), kept.frame(camera)
        due = frame.features.visible & (~visible | (index % 3 == number % 3))
        assert np.array_equal(frame.coloured, due)
        assert np.array_equal(frame.features.colour[due], truth.features.colour[due])
        stale = frame.features.visible & ~due
        assert frame.counters["colours_reused"] == np.count_nonzero(stale) and truth.counters["colours_reused"] == 0
        if number:
            assert stale.any() and np.array_equal(frame.features.colour[stale], colour[stale])
            assert not np.array_equal(frame.features.colour[stale], truth.features.colour[stale])
        visible, colour = frame.features.visible, frame.features.colour
    cut = kept.frame(camera, cut=True)
    assert np.array_equal(cut.raster.value, truth.raster.value) and cut.counters["colours_reused"] == 0


def test_settings_of_the_tables_are_checked():
    assert parse(["rebuild_share=0.25"]).rebuild_limit(True) == 0.25
    assert (Settings().rebuild_limit(True), Settings().rebuild_limit(False)) == (0.5, 1)
    assert (Settings().depth_rule(True), Settings().depth_rule(False)) == ("consistent", "deferred")
    assert [Settings(refresh="every:3").refreshes(k) for k in range(4)] == [True, False, False, True]
    for bad in (
        "rebuild_share=2",
        "rebuild_share=x",
        "depth=new",
        "colour_every=0",
        "passes=0",
        "chunk=100",
        "refresh=every",
        "refresh=every:0",
        "refresh=3",
        "sh_degree=4",
    ):
        with pytest.raises(InputError, match=bad.split("=")[0]):
            parse([bad])
