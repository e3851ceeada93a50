"""Projection and culling: P01 to P14."""

from __future__ import annotations

import mpmath
import numpy as np

from golden import oracle
from golden.cameras.camera import Camera
from golden.errors import InputError
from golden.hard_cases import exact
from golden.hard_cases.case import case
from golden.hard_cases.run import Run, lsb
from golden.hard_cases.setting import DIAGONAL, LSB, camera_a, gaussians, merge
from golden.preprocess import encode, project
from golden.scene.gaussians import check_float32_positions, checked, exp_scales, sigmoid

ALL_SUBTILES = np.uint64(0xFFFFFFFFFFFFFFFF)


@case("P01", "Gaussian exactly at the camera centre")
def p01(run: Run) -> None:
    normal = gaussians((0, 0, 2))
    frame = run.frame(merge(gaussians((0, 0, 0)), normal), camera_a())
    p = frame.projection
    fields = (p.mean2d, p.cov2d, p.det, p.opacity, p.colour, frame.image)
    run.equal("fields that are not finite", sum(int((~np.isfinite(f)).sum()) for f in fields), 0)
    run.equal("culled_near", frame.counters["culled_near"], 1)
    run.same("picture against that of the normal Gaussian alone", frame, run.frame(normal, camera_a()))


@case("P02", "Near plane, one code either side")
def p02(run: Run) -> None:
    near = camera_a().near
    depths = [np.nextafter(near, 0), near, np.nextafter(near, 1)]
    frame = run.frame(gaussians([(0, 0, z) for z in depths], scales=0.01), camera_a())
    run.equal("culled_near", frame.counters["culled_near"], 2)
    run.equal("rows that the projection keeps", np.flatnonzero(frame.projection.visible).tolist(), [2])
    run.equal("rows that the duplication lists", np.unique(frame.pairs.index).tolist(), [2])
    run.equal("clamped_depth of the key encoder", frame.counters["clamped_depth"], 0)


@case("P03", "Huge splat just behind the near plane")
def p03(run: Run) -> None:
    scene, camera = gaussians((0, 0, 0.25), scales=5.0, opacities=0.5), camera_a()
    frame = run.frame(scene, camera)
    run.equal("tiles that list it", frame.order.words.size, 4)
    run.equal("subtile bits not set", int((frame.raster.bitmaps != ALL_SUBTILES).sum()), 0)
    truth = oracle.render(scene, camera)
    run.at_most("alpha at pixel (0, 0) from 0.49969", abs(frame.image[0, 0, 0] - 0.49969), 2**-10)
    run.at_most("alpha from the oracle, all pixels", np.abs(frame.image - truth).max(), 2**-10)


@case("P04", "Mean far outside the frustum")
def p04(run: Run) -> None:
    far, near, camera = gaussians((20, 0, 2), scales=1.0), gaussians((0, 0, 2)), camera_a()
    frame = run.frame(merge(far, near), camera)
    run.equal("culled_offscreen", frame.counters["culled_offscreen"], 1)
    run.same("picture against that without it", frame, run.frame(near, camera))
    wide = Camera(4000, 128, 128, 128, 64.0, 64.0, np.eye(3), np.zeros(3))
    r = exact.project(far, 0, camera)
    run.equal("x of the mean with 60 digits", float(r.x), 1344.0)
    run.at_most("sigma_x with 60 digits from 76.3 px", abs(float(mpmath.sqrt(r.cov[0, 0])) - 76.3), 0.1)
    run.at_most("projection from 60 digits where it is seen", exact.worst(project(far, wide), far, wide), 1e-12)


@case("P05", "No seam at the clamp")
def p05(run: Run) -> None:
    camera, step, error = camera_a(), 0.0, 0.0
    for axis in (0, 1):
        for sign in (-1, 1):
            means = np.zeros((2, 3))
            means[:, 2] = 2
            means[:, axis] = [sign * 2 * (0.65 - 2**-12), sign * 2 * (0.65 + 2**-12)]
            scene = gaussians(means, scales=0.5, opacities=0.5)
            p = project(scene, camera)
            cov = p.cov2d
            size = np.maximum(np.abs(cov[0]), [0, np.sqrt(cov[0, 0] * cov[0, 2]), 0])
            step = max(step, (np.abs(cov[1] - cov[0]) / size).max())
            error = max(error, exact.worst(p, scene, camera))
            run.against_oracle(run.frame(scene, camera)) if (axis, sign) == (0, 1) else run.frame(scene, camera)
    run.at_most("covariance across the seam, relative", step, 2**-9)
    run.at_most("covariance from 60 digits, relative", error, 2**-12)


@case("P06", "Needle at 45 degrees, sigma 640 px")
def p06(run: Run) -> None:
    scene, camera = gaussians((0, 0, 2), (10, 1e-4, 1e-4), 0.8, quats=DIAGONAL), camera_a()
    frame = run.frame(scene, camera)
    run.at_least("determinant over 0.09", frame.projection.det[0] / 0.09, 1)
    run.at_most("projection from 60 digits, relative", exact.worst(frame.projection, scene, camera), 2**-21)
    truth = exact.alpha(scene, 0, camera)
    error = np.abs(frame.image[..., 0] - np.where(truth >= LSB, truth, 0))
    kept = frame.image[..., 0] > 0
    flipped = kept != (truth >= LSB)
    run.at_most("|alpha error| against 60 digits, same decisions", error[~flipped].max(), 2**-10)
    run.at_most("distance from the cut of the pixels that decide otherwise", _reach(truth, flipped), 2**-10)
    longer = gaussians((0, 0, 2), (1e6, 1e-9, 1e-9), 0.8, quats=DIAGONAL)
    run.at_most("the same with sigma 6.4e7 px", exact.worst(project(longer, camera), longer, camera), 2**-21)


def _reach(truth: np.ndarray, flipped: np.ndarray) -> float:
    """Largest |alpha - cut| of the pixels `flipped`."""
    return float(np.abs(truth[flipped] - LSB).max(initial=0))


def _cross(run: Run, frame, what: str = "") -> None:
    """The nine pixels of a point-like splat on a pixel centre."""
    image = frame.image[..., 0]
    neighbours = [image[64, 63], image[64, 65], image[63, 64], image[65, 64]]
    corners = [image[63, 63], image[63, 65], image[65, 63], image[65, 65]]
    run.equal(f"{what}pixels touched", int(np.count_nonzero(image)), 9)
    run.at_most(f"{what}centre from 0.99", abs(image[64, 64] - 0.99), 2**-12)
    run.at_most(f"{what}neighbours from 0.18888", max(abs(v - 0.18888) for v in neighbours), 2**-12)
    run.at_most(f"{what}diagonal from 0.03567", max(abs(v - 0.03567) for v in corners), 2**-12)


@case("P07", "Point-like splat")
def p07(run: Run) -> None:
    scene = gaussians((0.0078125, 0.0078125, 2), scales=1e-9, opacities=1.0)
    frame = run.frame(scene, camera_a())
    p = frame.projection
    run.equal("mean", p.mean2d[0].tolist(), [64.5, 64.5])
    run.at_most("covariance from 0.3 I", np.abs(p.cov2d[0] - [0.3, 0, 0.3]).max(), 1e-14)
    _cross(run, frame)
    run.against_oracle(frame)


@case("P08", "Sub-pixel splat far away, filter on and off")
def p08(run: Run) -> None:
    mean = (3.90625, 3.90625, 1000)
    far = gaussians(mean, scales=1e-3, opacities=1.0)
    off = run.frame(far, camera_a(), antialias="auto")
    _cross(run, off, "off: ")
    point = run.frame(gaussians((0.0078125, 0.0078125, 2), scales=1e-9, opacities=1.0), camera_a(), antialias="auto")
    run.same("off: picture against P07's", off, point)
    on = run.frame(gaussians(mean, 1e-3, 1.0, antialias=True), camera_a(), antialias="auto")
    r = exact.project(far, 0, camera_a())
    run.at_most("on: factor with 60 digits from 5.5e-8", abs(float(mpmath.sqrt(r.raw / r.det)) - 5.5e-8), 1e-9)
    run.equal("on: culled_alpha", on.counters["culled_alpha"], 1)
    run.equal("on: pixels drawn", int(np.count_nonzero(on.raster.value)), 0)


@case("P09", "Unnormalised quaternion and sign")
def p09(run: Run) -> None:
    factors = np.array([1, -1, 1e3, 1e-3, 1e-18, 1e-140, 1e140])
    same, codes, error = 0, 0, 0.0
    for q in ([0.5, 0.5, 0.5, 0.5], [0.1, -0.7, 0.2, 0.4]):
        scene = gaussians([(0.3, -0.2, 2)] * len(factors), (0.3, 0.1, 0.03), quats=factors[:, None] * np.array(q))
        p = run.frame(scene, camera_a()).projection
        same += int((p.cov2d[0] != p.cov2d[1]).sum())
        chol = encode(run.formats, p).chol
        codes = max(codes, int(np.abs(chol - chol[0]).max()))
        error = max(error, exact.worst(p, scene, camera_a()))
    run.equal("factors 1 and -1: covariance entries that differ", same, 0)
    run.at_most("factors 1e-140 to 1e140: codes of the footprint apart", codes, 1)
    run.at_most("covariance from 60 digits, relative", error, 1e-12)


@case("P10", "Zero quaternion, zero-filled rows")
def p10(run: Run) -> None:
    one = gaussians((0, 0, 2), scales=1.0, opacities=0.5)
    rows = [np.concatenate([a, np.zeros((4095, *a.shape[1:]))]) for a in (one.means, one.scales, one.quats, one.sh)]
    rows[1][1:] = exp_scales(np.zeros(1))
    opacities = np.full(4096, float(sigmoid(np.zeros(1))[0]))
    scene = checked("zeros", rows[0], rows[1], rows[2], opacities, rows[3])
    run.equal("rejected_quat", scene.counters["rejected_quat"], 4095)
    run.equal("rows that are left to take time", len(scene), 1)
    run.same("picture against that of the good row", run.frame(scene, camera_a()), run.frame(one, camera_a()))
    raw = gaussians(rows[0], 1.0, 0.5, quats=rows[2])
    inside = camera_a(position=(0, 0, -4.0))
    run.equal("the rows unchecked: culled_nonfinite", project(raw, inside).counters["culled_nonfinite"], 4095)


@case("P11", "Non-finite fields")
def p11(run: Run) -> None:
    n = 6
    means = np.tile([0.0, 0.0, 2.0], (n, 1))
    means[0, 0] = np.nan
    logs = np.full((n, 3), np.log(0.1))
    logs[1, 1] = np.inf
    logits = np.array([0, 0, np.inf, -np.inf, np.nan, 0])
    quats = np.tile([1.0, 0, 0, 0], (n, 1))
    scene = checked("odd", means, exp_scales(logs), quats, sigmoid(logits), np.zeros((n, 1, 3)))
    run.equal("rows rejected", sum(scene.counters.values()), 3)
    run.equal("opacities of the logits +Inf, -Inf, 0", scene.opacities.tolist(), [1.0, 0.0, 0.5])
    frame = run.frame(scene, camera_a())
    run.equal("culled_alpha", frame.counters["culled_alpha"], 1)
    run.equal("visible", frame.counters["visible"], 2)


@case("P12", "Opacity around the cut")
def p12(run: Run) -> None:
    code = 2.0 ** (2.0**-run.formats.opacity_f)
    stored = float(sigmoid(np.array([-np.log(254)], np.float32))[0])  # 1/255 as a float32 logit in a file
    opacities = np.array([0, LSB / code, LSB, LSB * code, 1, stored])
    x = np.array([10.5, 34.5, 58.5, 82.5, 110.5, 10.5])
    y = np.array([64.5, 64.5, 64.5, 64.5, 64.5, 30.5])
    scene = gaussians(np.column_stack([(x - 64) / 64, (y - 64) / 64, np.full(6, 2.0)]), np.sqrt(8.7) / 64, opacities)
    frame = run.frame(scene, camera_a())
    image = frame.image[..., 0]
    run.equal("culled_alpha", frame.counters["culled_alpha"], 2)
    run.equal("pixels of opacity 0 and of one code below", int(np.count_nonzero(image[48:, :47])), 0)
    run.equal("pixels (x, y) of opacity 1/255", np.argwhere(image[48:, 47:70])[:, ::-1].tolist(), [[11, 16]])
    run.at_least("alpha of one code above at its centre, LSB", image[64, 82] * 255, 0.99)
    run.at_most("opacity 1 at its centre from 0.99", abs(image[64, 110] - 0.99), 2**-16)
    run.equal("pixels of 1/255 from a file's float32 logit", int(np.count_nonzero(image[:48])), 1)


@case("P13", "Colour below 0 and above 1 before blending")
def p13(run: Run) -> None:
    twice = gaussians([(0.0078125, 0.0078125, 2)] * 2, opacities=0.5, colours=(-0.3, 0.5, 2.47))
    frame = run.frame(twice, camera_a(), background="1,1,1")
    run.at_most(
        "centre from (0.25, 0.625, 2.1025), LSB", np.abs(frame.image[64, 64] - [0.25, 0.625, 2.1025]).max() * 255, 0.5
    )
    run.equal("8 bit", tuple(frame.raster.rgb8[64, 64].tolist()), (64, 159, 255))
    run.equal("clamped_colour", frame.counters["clamped_colour"], 0)
    run.against_oracle(frame, (1.0, 1.0, 1.0))


@case("P14", "Geo-referenced scene")
def p14(run: Run) -> None:
    rng = np.random.default_rng(14)
    means = np.round(rng.uniform(-1, 1, (1000, 3)) * 1024) / 1024 + (0, 0, 3)
    offset = np.array((6378137.0, 4200000.0, 512.0))
    colours = rng.random((1000, 3))
    here = run.frame(gaussians(means, scales=0.05, colours=colours), camera_a())
    there = run.frame(gaussians(means + offset, scales=0.05, colours=colours), camera_a(position=offset))
    run.same("picture against that at the origin", here, there)
    try:
        check_float32_positions("scene.ply", (means + offset).astype(np.float32), np.full((1000, 3), 0.05))
        refused = "accepted"
    except InputError:
        refused = "refused"
    run.equal("the same positions as float32 in a file", refused, "refused")
    run.at_least("picture: brightest value, LSB", lsb(here.image, np.zeros_like(here.image)), 1)
