"""Our own: inputs at the ends of their ranges, X01 to X11."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from golden import oracle, params
from golden.cameras import SIDE_MAX
from golden.cameras.camera import Camera
from golden.formats import COLOUR_LIMIT
from golden.hard_cases.case import case
from golden.hard_cases.run import Run, cycles, lsb
from golden.hard_cases.setting import camera_a, crowd, gaussians, layers, merge
from golden.records import indices_of


def view(width: int, height: int, fx=128.0, fy=128.0, cx=None, cy=None, rotation=None) -> Camera:
    """From the origin; principal point in the middle where not given."""
    rotation = np.eye(3) if rotation is None else np.asarray(rotation, np.float64)
    cx, cy = width / 2 if cx is None else cx, height / 2 if cy is None else cy
    return Camera(width, height, fx, fy, cx, cy, rotation, np.zeros(3))


@case("X01", "Negative zeros and denormals")
def x01(run: Run) -> None:
    plain = run.frame(gaussians((0.0, 0.0, 2), 0.0), camera_a())
    minus = gaussians((-0.0, -0.0, 2), (-0.0, 0.0, -0.0), quats=(-1, -0.0, -0.0, -0.0))
    run.same("negative zeros against zeros", run.frame(minus, camera_a()), plain)
    tiny = gaussians((5e-324, -5e-324, 2), 5e-324, quats=(5e-310, 0, 0, 0))
    run.same("denormals against zeros", run.frame(tiny, camera_a()), plain)
    run.at_least("pixels drawn", plain.counters["blends"], 4)


@case("X02", "Pictures of one pixel, one row, one column")
def x02(run: Run) -> None:
    for size in ((1, 1), (200, 1), (1, 200)):
        frame = run.frame(crowd(1, 400), view(*size), background="1,1,1")
        run.equal("picture", frame.raster.value.shape[1::-1], size)
        run.against_oracle(frame, (1.0, 1.0, 1.0))


@case("X03", "The widest picture")
def x03(run: Run) -> None:
    edges = gaussians([(side * 2 * SIDE_MAX / 8000, 0, 2) for side in (-1, 1)], 0.01)
    frame = run.frame(merge(crowd(2, 300), edges), view(SIDE_MAX, 64, 4000.0, 4000.0))
    run.equal("tiles", len(frame.order.lengths), 128)
    run.equal("entries of the splats on the left and right edge", [e.size for e in _edges(frame)], [1, 1])
    run.against_oracle(frame)


def _edges(frame) -> list[np.ndarray]:
    """Entries of Gaussian 300 in the first tile and of Gaussian 301 in the last one."""
    words = frame.order.tile(0), frame.order.tile(len(frame.order.lengths) - 1)
    return [w[indices_of(w) == index] for w, index in zip(words, (300, 301))]


@case("X04", "Thousands of identical Gaussians")
def x04(run: Run) -> None:
    frame = run.frame(gaussians([(0.1, 0.1, 2)] * 5000, 0.05, 0.01), camera_a())
    run.equal("longest table", int(frame.order.lengths.max()), 5000)
    run.against_oracle(frame)
    run.at_most("cycles an entry", cycles(frame) / frame.order.words.size, params.BEATS * params.GROUPS)


@case("X05", "Principal point outside the picture, fx and fy apart, mirrored view")
def x05(run: Run) -> None:
    scene = crowd(1, 400)
    for camera in (view(128, 128, 100.0, 60.0, 10.3, 120.7), view(128, 128, 90.0, 200.0, -30.0, 140.0),
                   view(128, 128, rotation=np.diag([-1, 1, 1]))):  # fmt: skip
        frame = run.frame(scene, camera)
        run.at_least("entries", frame.order.words.size, 50)
        run.against_oracle(frame)


@case("X06", "Roll by 90, 180 and 270 degrees")
def x06(run: Run) -> None:
    scene = crowd(1, 400)
    upright = run.frame(scene, view(128, 128)).image
    for turns, (c, s) in enumerate(((0, 1), (-1, 0), (0, -1)), 1):
        image = run.frame(scene, view(128, 128, rotation=[[c, s, 0], [-s, c, 0], [0, 0, 1]])).image
        apart = np.abs(np.rot90(upright, turns) - image).max(axis=2) * 255
        run.at_most(f"{90 * turns} degrees: share of pixels above 1 LSB apart", (apart > 1).mean(), 0.001)


@case("X07", "Depths from the near plane to 1e300")
def x07(run: Run) -> None:
    depth = np.array([np.nextafter(0.2, 1), 2.0**28, 2.0**30, 1e30, 1e300])
    means = np.column_stack([0 * depth, 0 * depth, depth])
    colours = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1)])
    frame = run.frame(gaussians(means, np.minimum(depth / 4, 1e299)[:, None] * [1, 1, 1], 0.5, colours), camera_a())
    run.equal("clamped_depth", frame.counters["clamped_depth"], 3)
    run.equal("visible", frame.counters["visible"], 5)
    run.against_oracle(frame)
    rows = np.linspace(0.19, 0.21, 300)
    near = run.frame(gaussians(np.column_stack([0 * rows, 0 * rows, rows]), 0.01, 0.3), camera_a())
    run.equal("300 around the near plane: culled_near", near.counters["culled_near"], int((rows <= 0.2).sum()))


@case("X08", "Camera inside Gaussians")
def x08(run: Run) -> None:
    around = gaussians([(0, 0, 0.1), (0, 0, 0.21), (0.1, 0, 0.25)], 5.0)
    frame = run.frame(merge(around, crowd(1, 400)), camera_a())
    run.equal("culled_near", frame.counters["culled_near"], 1)
    run.against_oracle(frame)


@case("X09", "Sizes from 0 to 1e200")
def x09(run: Run) -> None:
    scene = crowd(1, 400)
    run.against_oracle(run.frame(replace(scene, scales=scene.scales * 0), camera_a()))
    run.against_oracle(run.frame(replace(scene, scales=scene.scales * np.array([1e30, 1, 1])), camera_a()))
    gone = run.frame(replace(scene, scales=scene.scales * 1e200), camera_a())
    run.equal("1e200: culled_nonfinite", gone.counters["culled_nonfinite"], 400)
    rng = np.random.default_rng(0)
    quats = rng.normal(size=(300, 4))
    needles = gaussians(rng.uniform(-1, 1, (300, 3)) + (0, 0, 2), (10, 1e-5, 1e-9), 0.5, rng.random((300, 3)), quats)
    run.against_oracle(run.frame(needles, camera_a()))


@case("X10", "Colours of any size")
def x10(run: Run) -> None:
    top = COLOUR_LIMIT
    for size in (1e6, 1e18, 1e37):
        frame = run.frame(layers(3, 0.9, np.full(3, size)), camera_a())
        run.equal(f"{size:g}: clamped_colour", frame.counters["clamped_colour"], 3)
        run.at_most(f"{size:g}: value from {top:g}, relative", abs(frame.image[64, 64, 0] / (0.999 * top) - 1), 1e-3)
        below = run.frame(layers(3, 0.9, np.full(3, -size)), camera_a())
        run.equal(f"{-size:g}: values drawn", int(np.count_nonzero(below.raster.value)), 0)


@case("X11", "Mean beyond the reach of its format")
def x11(run: Run) -> None:
    inside = run.frame(gaussians((120, 0, 2), (120, 1, 1)), camera_a())
    run.at_least("7744 px away, sigma 9154 px: darkest pixel, LSB", inside.image.min() * 255, 1)
    truth = oracle.render(inside.projection, inside.camera)
    run.at_most("its LSB from the oracle", lsb(inside.image, truth), 1)
    beyond = run.frame(gaussians((150, 0, 2), (120, 1, 1)), camera_a())
    run.equal("9664 px away: culled_range, never silent", beyond.counters["culled_range"], 1)
    run.equal("pixels drawn", beyond.counters["blends"], 0)
