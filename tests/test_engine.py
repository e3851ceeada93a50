"""The frame simulator on a memory of fixed latency: one slice gives the cycles of golden/slice.py, so of the RTL."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from golden import cameras, scene, slice
from golden.cameras.camera import look_at
from golden.frame import Renderer, tiles_of
from golden.raster_core import raster_lane, timing
from golden.settings import Settings
from golden.timing import accelerator as accelerator_module
from golden.timing import memory, raster_state
from golden.timing.accelerator import Accelerator, no_blocks
from golden.timing.hardware import HARDWARE

SIZE = 320, 192
SLICE = replace(HARDWARE["neo"], slices=1, record_stride=24)


def frames(spec: str, count: int):
    """Frames of an orbit around a scene, and the scene."""
    gaussians = scene.load(spec)
    eye, at, up, fovy = cameras.default_view(gaussians)
    start = look_at(eye, at, up, fovy, *SIZE)
    track = cameras.path("orbit", start, range(count), 30.0, 1.0, at, cameras.scene_scale(gaussians), 0, up)
    renderer = Renderer(gaussians, Settings(), "reuse")
    return gaussians, [renderer.frame(camera) for camera in track]


def on_engine(accelerator: Accelerator, frame):
    """The engine's times of a frame behind reset, as the slice has them."""
    accelerator.memory = memory.fixed()
    accelerator.order = np.arange(len(frame.order.offsets) - 1)
    accelerator.lanes = raster_state.new_state(accelerator.core, 1, 0)
    accelerator.cycle = 0
    return accelerator.run(no_blocks(), accelerator.prepare(frame))[1]


def on_slice(frame):
    """golden/slice.py's times of the same frame."""
    lists = (frame.table.offsets, frame.table.words), (frame.incoming.offsets, frame.incoming.words)
    jobs, _ = slice.sort_jobs(frame.formats, *lists, frame.firsts)
    order = frame.order.offsets, frame.order.words
    return slice.frame_times(frame.formats, jobs, order, frame.raster, tiles_of(*SIZE), *SIZE)


@pytest.mark.parametrize("spec", ["builtin:room?n=30000", "builtin:translucent?n=20000", "builtin:sparse?n=2000"])
def test_one_slice_on_fixed_memory_takes_the_cycles_of_the_rtl(spec):
    gaussians, sequence = frames(spec, 3)
    accelerator = Accelerator(SLICE, gaussians, *SIZE)
    for frame in sequence:
        trace, want = on_engine(accelerator, frame), on_slice(frame)
        for name in ("accepted", "ready", "started", "done"):
            expected = want.sorted if name == "ready" else getattr(want, name)
            np.testing.assert_array_equal(getattr(trace, name), expected, err_msg=name)


@pytest.mark.parametrize(
    ("owner", "name", "event"),
    [(Accelerator, "_sort_cycles", "ready"), (accelerator_module, "pixel_beats", "done")],
    ids=["sort", "pixels"],
)
def test_a_broken_formula_is_seen(monkeypatch, owner, name, event):
    """One cycle more in one formula of the engine's, and its times are no longer the slice's."""
    gaussians, (frame, *_) = frames("builtin:room?n=5000", 1)
    right = getattr(owner, name)

    def wrong(*args):
        result = right(*args)
        return (result[0] + 1, *result[1:]) if isinstance(result, tuple) else result + 1

    monkeypatch.setattr(owner, name, wrong)
    trace = on_engine(Accelerator(SLICE, gaussians, *SIZE), frame)
    want = on_slice(frame)
    assert not np.array_equal(getattr(trace, event), want.sorted if event == "ready" else getattr(want, event))


def test_a_short_first_batch_leaves_its_tile_open():
    """With late sort every other frame begins with half a batch; the lane takes no other tile before the list's end."""
    for over in (False, True):
        state = raster_lane.new_state()
        raster_lane.begin_tile(state, 0)
        before = state[timing.TILE]
        arrivals = np.arange(10, 10 + 128 + over)
        raster_lane.request_batch(state, arrivals, np.full(128, 3), 3, np.zeros(128, np.int64))
        assert (state[timing.TILE] > before) == over
