"""Bits that flip in the tables between two frames: noticed or harmless, healed within the bounds of docs/frames.md."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from golden import params
from golden.cosim.compare import Cosim
from golden.formats import REFERENCE
from golden.frame import Frame, Renderer
from golden.hard_cases.setting import camera_a, yaw
from golden.records import INDEX_MASK, INVALID, entries_of, indices_of
from golden.settings import Settings
from golden.tables import Lists
from tests.fuzz.rtl import Bound
from tests.hard_cases.test_tables import check_invariants, crowd

N = 3000
KEY_MASK = (1 << REFERENCE.key_w) - 1
AT_REST = camera_a()


def started(late: bool, frames: int = 3, n: int = N, seed: int = 31) -> Renderer:
    """A renderer at rest whose tables are exactly in order."""
    renderer = Renderer(crowd(seed, n), Settings(), late=late)
    for _ in range(frames):
        renderer.frame(AT_REST)
    return renderer


def poke(renderer: Renderer, at: int | np.ndarray, mask: int | np.ndarray) -> None:
    """Flip bits of the tables in memory."""
    words = renderer.written.words.copy()
    np.bitwise_xor.at(words, at, mask)
    renderer.written = Lists(renderer.written.offsets, words)


def in_order(frame: Frame) -> bool:
    """Are the tables exactly what a sort from scratch makes?"""
    return all((np.diff(frame.order.tile(t)) > 0).all() for t in range(len(frame.order.lengths)))


def exact(frame: Frame, truth: Frame) -> bool:
    return np.array_equal(frame.raster.value, truth.raster.value)


late_or_not = pytest.mark.parametrize("late", [False, True], ids=["reuse", "late"])


@late_or_not
@pytest.mark.parametrize("kind", ["twice", "beyond", "last"])
def test_a_table_that_names_a_gaussian_twice_or_none_is_sorted_from_scratch(late, kind):
    """twice: the index of its neighbour; beyond: the largest index; last: the first that is one too large."""
    renderer, truth = started(late), started(late).frame(AT_REST)
    words = renderer.written.tile(2)
    index = indices_of(words)
    poke(
        renderer,
        int(renderer.written.offsets[2]) + 40,
        int(index[40] ^ {"twice": index[41], "beyond": INDEX_MASK, "last": N}[kind]),
    )
    frame = renderer.frame(AT_REST)
    check_invariants(frame)
    assert frame.counters["damaged_tiles"] == 1 and frame.table.lengths[2] == 0 and frame.table.lengths[1] > 0
    assert exact(frame, truth) and in_order(frame)
    assert renderer.frame(AT_REST).counters["damaged_tiles"] == 0


@late_or_not
def test_the_index_of_a_gaussian_that_is_elsewhere_changes_no_pixel(late):
    """The lost one arrives again, the foreign one hits nothing and is dropped one frame later."""
    renderer, truth = started(late), started(late).frame(AT_REST)
    index = indices_of(renderer.written.tile(0))
    foreign = np.setdiff1d(np.arange(N), index)[5]
    poke(renderer, 100, int(index[100] ^ foreign))
    frame = renderer.frame(AT_REST)
    check_invariants(frame)
    assert frame.counters["damaged_tiles"] == 0 and frame.counters["incoming"] == 1
    assert exact(frame, truth)
    assert (frame.written.tile(0)[indices_of(frame.written.tile(0)) == foreign] >= INVALID).all()
    after = renderer.frame(AT_REST)
    assert after.counters["outgoing"] == 1 and foreign not in indices_of(after.order.tile(0))


@late_or_not
def test_an_entry_marked_invalid_arrives_again_in_the_same_frame(late):
    renderer, truth = started(late), started(late).frame(AT_REST)
    poke(renderer, np.array([3, 500, 700]), INVALID)
    frame = renderer.frame(AT_REST)
    check_invariants(frame)
    assert frame.counters["outgoing"] == frame.counters["incoming"] == 3
    assert exact(frame, truth)


@late_or_not
def test_an_entry_marked_valid_is_marked_invalid_again(late):
    renderer = Renderer(crowd(31, N), Settings(), late=late)
    renderer.frame(AT_REST)
    away = camera_a(rotation=yaw(2))
    renderer.frame(away)
    gone = np.flatnonzero(renderer.written.words >= INVALID)
    assert len(gone) > 3
    poke(renderer, gone[:3], INVALID)
    frame = renderer.frame(away)
    check_invariants(frame)
    assert np.count_nonzero(frame.raster.words_out >= INVALID) == 3 and not frame.counters["damaged_tiles"]


@late_or_not
def test_flipped_keys_heal_within_the_bound(late):
    """Any bits of a tenth of all keys. Late sort needs none of them while nothing comes."""
    renderer, truth = started(late), started(late).frame(AT_REST)
    rng = np.random.default_rng(5)
    count = renderer.written.words.size
    at = rng.choice(count, count // 10, replace=False)
    poke(renderer, at, rng.integers(1, KEY_MASK, len(at)) << params.INDEX_W)
    longest = int(renderer.written.lengths.max())
    frames = [renderer.frame(AT_REST) for _ in range(-(-2 * longest // params.CHUNK) + 1)]
    if not late:
        assert not exact(frames[0], truth)
    for frame in frames:
        check_invariants(frame)
    assert exact(frames[0 if late else -1], truth) and in_order(frames[0 if late else -1])


@late_or_not
def test_any_bits_flip_while_the_camera_moves(late):
    """Some in every frame; then the camera rests, and the order is exact within the bound."""
    rng = np.random.default_rng(6)
    renderer = Renderer(crowd(32, N), Settings(cut_share=1), late=late)
    damaged = 0
    for step in range(40):
        frame = renderer.frame(camera_a(rotation=yaw(0.7 * step), position=(0.01 * step, 0, 0)))
        check_invariants(frame)
        damaged += frame.counters["damaged_tiles"]
        at = rng.integers(0, frame.order.words.size, rng.integers(0, 8))
        poke(renderer, at, entries_of(REFERENCE, 1 << rng.integers(0, REFERENCE.entry_w, len(at))))
    assert damaged
    longest = int(renderer.written.lengths.max())
    for _ in range(-(-2 * longest // params.CHUNK) + 2):  # one more until the keys are those of the resting camera
        frame = renderer.frame(camera_a(rotation=yaw(28)))
    assert in_order(frame) and exact(frame, Renderer(renderer.gaussians, Settings()).frame(frame.camera))


@pytest.mark.slow  # builds the RTL model: a minute where it is not there yet
def test_rtl_and_golden_go_the_same_way_from_damaged_tables():
    """The same bits in the memory of both, all kinds in every frame."""
    rng = np.random.default_rng(7)
    cameras = [camera_a(rotation=yaw(0.5 * step)) for step in range(6)]
    job = SimpleNamespace(gaussians=crowd(33, 1200), settings=Settings(), cameras=cameras, frames=range(6))
    pair = Cosim(job, "reuse", Bound())
    for k in range(len(cameras)):
        assert pair.frame(k).difference is None
        assert np.array_equal(pair.tables.words, pair.renderer.written.words)
        at = rng.integers(0, pair.tables.words.size, 30)
        poke(pair.renderer, at, entries_of(REFERENCE, 1 << rng.integers(0, REFERENCE.entry_w, len(at))))
        pair.tables = Lists(pair.tables.offsets, pair.renderer.written.words.copy())
