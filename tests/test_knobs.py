"""The knobs of sorting and refresh: what each does to the tables, exactly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from golden import metrics, params, records, tables
from golden.cameras.camera import extrapolate
from golden.cosim import compare
from golden.errors import InputError
from golden.formats import REFERENCE
from golden.frame import Frame, Renderer, tiles_of
from golden.hard_cases.setting import camera_a, gaussians, merge, yaw
from golden.raster_core.raster_core import rasterise
from golden.records import INVALID, indices_of, keys_of
from golden.settings import CHUNKS, Settings, parse
from golden.slice import sort_jobs
from golden.sorting_core import sorting_core
from golden.tables import Lists
from tests.hard_cases.test_tables import check_invariants, crowd

SIZE = 128, 128


def track(count: int, degrees: float = 1.0) -> list:
    return [camera_a(rotation=yaw(degrees * step), position=(0.02 * step, 0, 0)) for step in range(count)]


def frames(cameras: list, shown=None, sorting: str = "reuse", late: bool = False, **keys) -> list[Frame]:
    shown = crowd(31, 3000) if shown is None else shown
    renderer = Renderer(shown, Settings(**keys), sorting, late)
    return [renderer.frame(camera) for camera in cameras]


def same(a: Frame, b: Frame) -> bool:
    return np.array_equal(a.order.words, b.order.words) and np.array_equal(a.raster.value, b.raster.value)


def check_order(frame: Frame, exact: Frame) -> None:
    """What both list is in the same order and has the same keys; `exact` lists nothing else."""
    for t in range(4):
        words = frame.order.tile(t)
        assert np.array_equal(words[np.isin(words, exact.order.tile(t))], exact.order.tile(t))


def pair(lists: Lists) -> tuple[np.ndarray, np.ndarray]:
    return lists.offsets, lists.words


def walls(n: int = 3):
    """A crowd behind opaque layers: every tile is done within a batch."""
    means = [(0, 0, 0.3 + 0.01 * k) for k in range(n)]
    return merge(crowd(32, 6000), gaussians(means, scales=3.0, opacities=0.99, colours=0.5))


# ---- passes


def test_passes_are_golden_passes_one_behind_the_other():
    for number, frame in enumerate(frames(track(4, 2.0), passes=2)):
        check_invariants(frame)
        assert frame.firsts == tuple(sorting_core.first_length(2 * number + k) for k in range(2))
        for t in range(4):
            table = frame.table.tile(t)
            for first in frame.firsts[:-1]:
                table = sorting_core.sort(table, np.zeros(0, np.int64), first)
            want = sorting_core.sort(table, np.sort(frame.incoming.tile(t)), frame.firsts[-1])
            assert np.array_equal(frame.order.tile(t), want)


# ---- depth


def test_fresh_keys_sorted_whole_are_the_exact_order():
    cameras = track(4, 2.0)
    for fresh, full in zip(
        frames(cameras, sorting="hierarchical", depth="fresh"), frames(cameras, sorting="full"), strict=True
    ):
        check_order(fresh, full)
        assert np.array_equal(fresh.raster.value, full.raster.value)


def test_fresh_keys_are_those_of_the_frame_and_stale_ones_a_frame_late():
    cameras = track(3, 2.0)
    fresh, stale = frames(cameras, depth="fresh"), frames(cameras)
    for frame in fresh:
        check_invariants(frame)
        index = indices_of(frame.order.words)
        fresh_key = keys_of(frame.order.words) == frame.features.key[index]
        assert np.array_equal(fresh_key, frame.features.visible[index])
    before = stale[1].features.key[indices_of(stale[2].table.words)]
    assert np.array_equal(keys_of(stale[2].table.words), before)
    assert not np.array_equal(stale[2].features.key[indices_of(stale[2].table.words)], before)


def test_at_rest_deferred_keys_are_fresh_after_one_frame():
    """Lists shorter than half a chunk, so that only keys and not chunks can make a difference."""
    cameras = [*track(3, 3.0), *[track(3, 3.0)[-1]] * 2]
    few = crowd(33, 110)
    fresh, stale = (frames(cameras, few, depth=depth) for depth in ("fresh", "deferred"))
    assert max(int(frame.order.lengths.max()) for frame in fresh) <= params.CHUNK // 2
    assert not same(fresh[2], stale[2])
    assert same(fresh[3], stale[3]) and same(fresh[4], stale[4])


def test_at_constant_speed_predicted_keys_are_those_of_the_next_frame():
    """Shifts of a power of two, so that the prediction has no rounding: the order is exact from the third frame on."""
    cameras = [camera_a(position=(0, 0, -2 + 0.25 * step)) for step in range(6)]
    predicted = frames(cameras, sorting="hierarchical", depth="predicted")
    full = frames(cameras, sorting="full")
    for frame, exact in zip(predicted[2:], full[2:], strict=True):
        check_invariants(frame)
        check_order(frame, exact)
    stale = frames(cameras, sorting="hierarchical")[3]
    assert not np.array_equal(stale.order.words, predicted[3].order.words)


def test_the_predicted_camera_goes_on():
    cameras = [camera_a(rotation=yaw(3 * step), position=(0.1 * step, 0, 1)) for step in range(3)]
    following = extrapolate(*cameras[:2])
    np.testing.assert_allclose(following.rotation, cameras[2].rotation, atol=1e-12)
    np.testing.assert_allclose(following.position, cameras[2].position, atol=1e-12)


def test_behind_a_cut_nothing_is_predicted():
    renderer = Renderer(crowd(31, 3000), Settings(depth="predicted"))
    for camera in track(3, 2.0):
        renderer.frame(camera)
    frame = renderer.frame(camera_a(rotation=yaw(30)))
    assert frame.counters["full_frames"] == 1
    hit = frame.written.words < INVALID
    assert hit.any()
    assert np.array_equal(frame.written.words[hit], frame.order.words[hit])


# ---- chunk


@pytest.mark.parametrize("chunk", CHUNKS)
def test_tables_are_sorted_in_chunks_of_any_length(chunk):
    result = frames(track(3, 2.0), chunk=chunk)
    assert [frame.firsts for frame in result] == [(chunk // 2,), (chunk,), (chunk // 2,)]
    frame = result[-1]
    check_invariants(frame)
    _, words = sort_jobs(REFERENCE, pair(frame.table), pair(frame.incoming), frame.firsts, chunk=chunk)
    assert all(np.array_equal(words[t], frame.order.tile(t)) for t in range(4))
    for t in range(4):
        valid = frame.table.tile(t)
        for begin, end in sorting_core.ranges(len(valid), frame.firsts[0], chunk):
            part = valid[begin:end]
            kept = np.sort(part[part < INVALID])
            assert np.array_equal(kept, frame.order.tile(t)[np.isin(frame.order.tile(t), kept)])


# ---- refresh


def test_without_a_tile_that_ends_every_refresh_is_the_same():
    faint = replace(crowd(31, 3000), opacities=np.full(3000, 0.02))
    cameras = track(4)
    runs = [frames(cameras, faint, refresh=refresh) for refresh in ("all", "none", "every:2")]
    for a, b, c in zip(*runs, strict=True):
        assert a.counters == b.counters == c.counters and a.counters["stale_entries"] == 0
        assert np.array_equal(a.written.words, b.written.words) and np.array_equal(a.written.words, c.written.words)


@pytest.mark.parametrize("late", [False, True])
def test_what_is_left_out_lies_behind_the_end_of_every_pixel(late):
    banks = 3 if late else 2
    result = frames(track(3, 2.0), walls(), late=late, refresh="none")
    assert sum(frame.counters["stale_entries"] for frame in result) > 0
    for frame in result:
        check_invariants(frame)
        first = frame.firsts[0] if late else params.CHUNK
        cuts = [0, first, *range(first + params.CHUNK, 10**5, params.CHUNK)]
        for t, xy in enumerate(tiles_of(*SIZE)):
            words, fetched = frame.order.tile(t), frame.raster.fetched[t]
            want = len(words)
            for batch in range(len(cuts) - 1):
                part = words[: cuts[batch + 1]]
                seen = rasterise(REFERENCE, (np.array([0, len(part)]), part), frame.features, xy, *SIZE).transmittance
                x, y = xy
                if (seen[y : y + 64, x : x + 64] < REFERENCE.t_stop).all():
                    want = min(want, cuts[batch + banks])
                    break
                if cuts[batch + 1] >= len(words):
                    break
            assert fetched == want
            stay = frame.written.tile(t)[fetched:]
            assert np.array_equal(stay, frame.merged.tile(t)[fetched:]) and (stay < INVALID).all()
        everything = rasterise(
            REFERENCE, pair(frame.order), frame.features, tiles_of(*SIZE), *SIZE, first=first, length=params.CHUNK
        )
        assert np.array_equal(everything.value, frame.raster.value)


def test_every_kth_frame_refreshes_all():
    result = frames(track(5), walls(), refresh="every:2")
    assert [frame.counters["stale_entries"] == 0 for frame in result] == [True, False, True, False, True]
    assert all(map(same, frames(track(3), walls(), refresh="every:1"), frames(track(3), walls())))


def test_t05_a_reveal_by_every_policy():
    """40 frames behind walls, then none: what a policy costs is in the reveal frame and gone in the next one."""
    back = crowd(6, 4000)
    back = replace(back, scales=0.3 * back.scales)
    places = np.random.default_rng(5).uniform(-0.5, 0.5, (60, 3)) * (1, 1, 0.2) + (0, 0, 0.8)
    wall = gaussians(places, scales=0.19, opacities=0.99, colours=0.5)
    closed, opened = merge(wall, back), merge(replace(wall, opacities=np.zeros(60)), back)
    cameras = [camera_a(rotation=yaw(0.5 * (step - 20))) for step in range(42)]
    exact = [frame.image for frame in frames(cameras[40:], opened, sorting="full")]

    def quality(refresh: str, late: bool) -> list[float]:
        """dB of the reveal frame and the one behind it against exact order."""
        renderer = Renderer(closed, Settings(refresh=refresh), "reuse", late)
        stale = [renderer.frame(camera).counters["stale_entries"] for camera in cameras[:40]]
        assert (max(stale) > 1000) == (refresh != "all")
        renderer.gaussians = opened
        pictures = [renderer.frame(camera).image for camera in cameras[40:]]
        return [metrics.compare(a, b)["psnr_db"] or 200.0 for a, b in zip(pictures, exact, strict=True)]

    everything, fourth, nothing = (quality(refresh, False) for refresh in ("all", "every:4", "none"))
    assert everything[0] > 66 and abs(fourth[0] - everything[0]) < 1
    assert 54 < nothing[0] < everything[0] - 10
    assert abs(nothing[1] - everything[1]) < 1 and abs(fourth[1] - everything[1]) < 1
    assert min(quality("none", True)) > 90  # late sort has this frame's keys before it draws


# ---- what cannot be


@pytest.mark.parametrize(
    ("pair_of", "sorting", "late"),
    [
        ("depth=fresh", "reuse", True),
        ("depth=predicted", "reuse", True),
        ("passes=2", "reuse", True),
        ("passes=2", "full", False),
        ("passes=3", "periodic:2", False),
    ],
)
def test_knobs_that_do_not_go_together_are_refused(pair_of, sorting, late):
    with pytest.raises(InputError, match=pair_of):
        Renderer(crowd(31, 10), parse([pair_of]), sorting, late)


@pytest.mark.parametrize("pair_of", ["depth=fresh", "depth=predicted", "passes=2", "chunk=128", "refresh=none"])
def test_the_rtl_is_not_asked_for_what_it_does_not_have(pair_of):
    compare.check(Settings())
    compare.check(parse(["depth=consistent", "sh_degree=1"]))
    with pytest.raises(InputError, match=pair_of):
        compare.check(parse([pair_of]))


def test_fresh_keys_leave_what_went_out_of_sight_where_it_was():
    """Found: with the largest key it held up the merge, and all incoming entries lined up behind its chunk."""
    table = Lists(np.array([0, 3]), records.entries(np.array([5, 6, 7]), np.array([0, 1, 2])))
    key = np.array([9, (1 << 23) - 1, 4])
    got = tables.renewed(table, key, np.array([True, False, True])).words
    np.testing.assert_array_equal(got, records.entries(np.array([9, 6, 4]), np.array([0, 1, 2])))
