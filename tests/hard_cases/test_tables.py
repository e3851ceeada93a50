"""The invariants of every table from frame to frame."""

from __future__ import annotations

import numpy as np

from golden import params
from golden.frame import Frame, Renderer, tiles_of
from golden.hard_cases.setting import camera_a, crowd, yaw
from golden.records import INVALID, indices_of
from golden.settings import Settings


def check_invariants(frame: Frame) -> None:
    """Complete, unique, conserving (design, section 3.3)."""
    for t in range(len(tiles_of(frame.camera.width, frame.camera.height))):
        listed = indices_of(frame.order.tile(t))
        assert np.unique(listed).size == listed.size
        now = frame.pairs.index[frame.pairs.tile_offsets[t] : frame.pairs.tile_offsets[t + 1]]
        assert np.isin(now, listed).all()
        gone = np.count_nonzero(frame.table.tile(t) & INVALID)
        assert listed.size == frame.table.tile(t).size + frame.incoming.tile(t).size - gone
    assert frame.counters["entries"] == (
        frame.table.words.size + frame.counters["incoming"] - frame.counters["outgoing"]
    )


def test_invariants_on_a_moving_crowd():
    renderer = Renderer(crowd(1, 3000), Settings())
    for step in range(6):
        check_invariants(renderer.frame(camera_a(rotation=yaw(1.5 * step), position=(0.02 * step, 0, 0))))


def test_order_heals_when_the_camera_stops():
    renderer = Renderer(crowd(2, 3000), Settings(cut_share=1.0))
    for step in range(4):
        renderer.frame(camera_a(rotation=yaw(4.0 * step)))
    longest = 0
    waited, ordered = -1, False
    while not ordered and waited < 200:
        waited += 1
        frame = renderer.frame(camera_a(rotation=yaw(12.0)))
        longest = max(longest, int(np.diff(frame.order.offsets).max()))
        ordered = all((np.diff(frame.order.tile(t)) > 0).all() for t in range(4))
    assert ordered
    assert waited <= -(-2 * longest // params.CHUNK) + 1  # one frame until the keys are those of this camera
