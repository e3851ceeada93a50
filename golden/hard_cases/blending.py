"""Blending, the subtile compute unit: S01 to S12."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from golden import oracle, params
from golden.fixed import half_up
from golden.formats import COLOUR_LIMIT
from golden.hard_cases.case import case
from golden.hard_cases.pixels import bits_set, one_a_tile
from golden.hard_cases.run import Run, lsb
from golden.hard_cases.setting import LSB, camera_a, crowd, ellipses, gaussians, layers
from golden.preprocess import encode
from golden.raster_core import exp2_unit, pixel_blender
from golden.raster_core import subtile_compute_unit as scu

SCU = "raster_core/test_subtile_compute_unit"


@case("S01", "Two layers of 0.99", f"{SCU}: stop_rule_clamp_and_dead_pixels")
def s01(run: Run) -> None:
    scene = layers(3, 1.0, [0, 1, 1])
    frame = run.frame(scene, camera_a())
    run.equal("different values in the picture", len(np.unique(frame.raster.value)), 1)
    run.equal("pixels blended: two layers, the third is behind the stop", frame.counters["blends"], 2 * 128 * 128)
    run.at_most("value from 0.99 * 0.01, LSB", abs(frame.image[64, 64, 0] - 0.0099) * 255, 0.25)
    run.at_most("transmittance left", frame.raster.transmittance.max() / 2**run.formats.t_f, 1e-4)


@case("S02", "A thousand faint layers", f"{SCU}: a_thousand_faint_layers")
def s02(run: Run) -> None:
    for name, first in (("white first", 1.0), ("black first", 0.0)):
        scene = layers(1000, LSB, np.repeat([first, 1 - first], 500))
        frame = run.frame(scene, camera_a())
        run.at_most(f"{name}: LSB from float64", lsb(frame.image, oracle.render(scene, camera_a())), 0.25)
        share = 1 - (1 - LSB) ** 500
        exact = 255 * share * (1 if first else 1 - share)
        run.at_most(f"{name}: LSB from {exact:.3f}", abs(frame.image[64, 64, 0] * 255 - exact), 0.25)
    left = frame.raster.transmittance[64, 64] / 2**run.formats.t_f
    run.at_most("transmittance from 0.0196579", abs(left - 0.0196579), 2e-4)


@case("S03", "Running into the stop threshold slowly")
def s03(run: Run) -> None:
    scene = layers(2500, LSB, np.arange(2500) // 100 % 2)
    frame = run.frame(scene, camera_a())
    run.at_most("LSB from float64", lsb(frame.image, oracle.render(scene, camera_a())), 1)
    # round(alpha T) is 0 below T = 0.5 / alpha: there T rests, if the threshold has not been met before
    rest = max(0.5 * 255, run.formats.t_stop)
    run.at_most("transmittance at the end, codes", frame.raster.transmittance.max(), rest)
    run.equal("different values of it", len(np.unique(frame.raster.transmittance)), 1)
    run.count("layer of the stop, of 2500 (2500: never)", frame.counters["blends"] / 128**2)


@case("S04", "White on white")
def s04(run: Run) -> None:
    rng = np.random.default_rng(4)
    means = rng.uniform(-1.2, 1.2, (1000, 3)) + (0, 0, 3)
    scene = gaussians(means, rng.uniform(0.01, 0.6, (1000, 3)), rng.random(1000))
    frame = run.frame(scene, camera_a(), background="1,1,1")
    run.equal("8 bit values of the picture", np.unique(frame.raster.rgb8).tolist(), [255])
    run.at_most("values from 1, codes of the accumulator", np.abs(frame.raster.value - 2**run.formats.acc_f).max(), 0)
    run.at_least("pixels blended", frame.counters["blends"], 128 * 128)


@case("S05", "Alpha exactly at the cut, at the clamp")
def s05(run: Run) -> None:
    cut = run.formats.cut >> (run.formats.power_f - run.formats.opacity_f)
    clamp = int(-np.log2(0.99) * 2**run.formats.opacity_f)  # the last code at or above 0.99
    codes = [cut - 1, cut, cut + 1, clamp + 2, clamp + 1, clamp, clamp - 1, 0]
    camera, origins, pairs = one_a_tile(len(codes), 8)
    given = ellipses(origins + 36.5, (0.3, 0, 0.3))
    frame = run.given(given, replace(encode(run.formats, given), opacity=np.int32(codes)), pairs).frame(camera)
    alpha = 1 - frame.raster.transmittance[36, 36::64] / 2**run.formats.t_f
    run.equal("kept: cut + 1 code, cut, cut - 1 code", (alpha[:3] > 0).tolist(), [True, True, False])
    run.at_most(
        "real value of the cut from 1/255, relative", abs(255 * 2 ** (-cut / 2**run.formats.opacity_f) - 1), 2**-13
    )
    run.equal("different alphas of 0.99 and above", len(np.unique(alpha[5:])), 1)
    run.at_most("their value from 0.99", abs(alpha[-1] - 0.99), 2**-14)
    run.at_least("0.99 over the alpha two codes below", alpha[-1] / alpha[3], 1)


@case("S06", "Clamp means T never reaches zero")
def s06(run: Run) -> None:
    t = 1 << run.formats.t_f
    left = []
    for _ in range(4):
        t, *_ = pixel_blender.blend_pixel(run.formats, 0, t, 0, 0, 0, 0, 0, 0)
        left.append(int(t))
    run.at_most("no threshold: T behind three layers from 1e-6, codes", abs(left[2] - 1e-6 * (1 << run.formats.t_f)), 1)
    run.at_least("T behind four layers, codes", left[3], 1)
    frame = run.frame(layers(3, 1.0, 0.0), camera_a(), background="1,1,1")
    run.at_least("picture: T with the threshold, codes", frame.raster.transmittance.min(), 1)


@case("S07", "Large negative exponents", "raster_core/test_power_unit: both_sides_of_the_saturation")
def s07(run: Run) -> None:
    frame = run.given(ellipses((8.5, 64.5), (0.3, 0, 0.3))).frame(camera_a())
    row = 2.0**run.formats.t_f - frame.raster.transmittance[64, 8:]
    run.equal("along a row: alphas that grow with the distance", int((np.diff(row) > 0).sum()), 0)
    power = -0.5 * np.arange(120) ** 2 / 0.3
    run.equal("alphas above 0 where the power is below -5.55", int(np.count_nonzero(row[power < -5.55])), 0)
    kept = int(np.count_nonzero(frame.raster.value[..., 0]))
    skipped = bits_set(frame.raster.bitmaps) * params.SUBTILE**2 - kept
    run.equal("exp_skipped", frame.counters["exp_skipped"], skipped)
    top = 1 << run.formats.chol_w
    edge = 1 << (run.formats.mean_w - 1)
    means = [(-edge, -edge), (edge - 1, edge - 1), (-edge, edge - 1), (edge - 1, -edge)]
    chol = [(top - 1, -top, top - 1), (top - 1, top - 1, 1), (1, -top, 0), (0, 0, top - 1)]
    rows = [(m, c) for m in means for c in chol]
    camera, _, pairs = one_a_tile(len(rows))
    given = ellipses(np.zeros((len(rows), 2)), (1, 0, 1))
    mean, footprint = (np.int32([row[k] for row in rows]) for k in (0, 1))
    far = run.given(given, replace(encode(run.formats, given), mean=mean, chol=footprint), pairs).frame(camera)
    run.equal("largest footprints 8191 px away (power -2^26): subtiles hit", bits_set(far.raster.bitmaps), 0)


@case("S08", "Rounded conic that is no longer positive", "raster_core/test_power_unit: all_pixels_back_to_back")
def s08(run: Run) -> None:
    rng = np.random.default_rng(8)
    n = 256
    camera, origins, pairs = one_a_tile(n)
    centres = rng.uniform(0, 64, (n, 2))
    centres[0] = 32.5
    given = ellipses(origins + centres, (1, 0, 1), 0.9)
    scale = 2**run.formats.chol_f
    chol = np.stack(
        [rng.integers(0, 2 * scale, n), rng.integers(-2 * scale, 2 * scale, n), rng.integers(0, 2 * scale, n)], 1
    )
    chol[: n // 2] >>= rng.integers(0, run.formats.chol_f, (n // 2, 1))  # half of them wide
    a = np.sqrt(1.6666 * np.log2(np.e) / 2)
    chol[0] = np.rint(np.array([a, -a, 0]) * scale)  # A = C = 1.6666, B = -1.6667: c^2 rounds below 0, so c = 0
    frame = run.given(given, replace(encode(run.formats, given), chol=chol.astype(np.int32)), pairs).frame(camera)
    alpha = 1 - frame.raster.transmittance / 2**run.formats.t_f
    run.at_most("any footprint: largest alpha from opacity 0.9", alpha.max() / 0.9 - 1, 2**-11, "2^-11 of it")
    diagonal = np.diagonal(alpha[:64, :64])
    run.at_least("needle with c = 0: alpha along it", diagonal[diagonal > 0].max(initial=0), 0.7)
    run.at_least("all footprints: pixels blended", frame.counters["blends"], 1000)


@case("S09", "Exponential unit, exhaustive", "raster_core/test_exp2_unit: every_code")
def s09(run: Run) -> None:
    codes = np.arange(1 << (run.formats.power_f + 3))
    y = np.array([exp2_unit.exp2(run.formats, p) for p in codes.tolist()])
    relative = y / 2.0 ** (run.formats.exp_f - codes / 2**run.formats.power_f) - 1
    kept = codes <= run.formats.cut
    run.equal("codes at which it grows", int((np.diff(y) > 0).sum()), 0)
    run.at_most("value at 0 from 1", abs(y[0] / 2**run.formats.exp_f - 1), 2**-12)
    run.at_most("largest value", y.max() / 2**run.formats.exp_f, 1)
    run.at_most("relative error down to the cut", np.abs(relative[kept]).max(), 2**-10)
    run.at_most("mean relative error", abs(relative[kept].mean()), 2**-12)
    seams = np.arange(1, 8 * run.formats.exp_segments) << run.formats.offset_w
    alpha = half_up(y, run.formats.exp_f - run.formats.alpha_f)
    slope = np.ceil(2**run.formats.alpha_f * np.log(2) / 2**run.formats.power_f)
    run.at_most(
        "jump at a seam beyond the curve's own, codes of alpha", (alpha[seams - 1] - alpha[seams]).max() - slope, 2
    )


def _open_pixel(count: int) -> list[tuple]:
    """count lines (mean, cov) that saturate the subtile at (16, 16) but for its pixel (20, 20)."""
    sharp, wide, away = 0.181, 1e6, 0.42  # of 1.42 px away alpha is below the cut
    lines = []
    for at in (16, 17, 18, 19, 21, 22, 23):
        place = at + 0.5 + (away if at > 20 else -away)
        lines += [((20.5, place), (wide, 0, sharp)), ((place, 20.5), (sharp, 0, wide))]
    return [lines[k % len(lines)] for k in range(count)]


@case("S10", "One pixel that stays open", f"{SCU}: one_open_pixel_is_not_saturated")
def s10(run: Run) -> None:
    places = (196, 254, 255, 256, 257, 511)
    error, closed, changed, fetched = 0.0, [], 0, []
    for last in places:
        rows = [*_open_pixel(last), *[((20.5, 20.5), (0.3, 0, 0.3))] * 2]
        behind = [*rows, *[((20.5, 20.5), (100, 0, 100))] * 20]
        frames = []
        for part in (rows, behind):
            mean, cov = (np.array([row[k] for row in part], float) for k in (0, 1))
            at = np.arange(len(part))
            colour = np.where(at < last, 0.2, np.where(at < last + 2, 0.7, 0.1))
            frames.append(run.given(ellipses(mean, cov, 0.99, colour[:, None])).frame(camera_a()))
        short, longer = (frame.raster.value[16:24, 16:24] for frame in frames)
        error = max(error, abs(short[4, 4, 0] / 2**run.formats.acc_f - 0.7 * 0.9999) * 255)
        closed.append(int((frames[0].raster.transmittance[16:24, 16:24] < run.formats.t_stop).sum()))
        changed += int((short != longer).sum())
        fetched.append(frames[1].written.tile(0).size - frames[0].written.tile(0).size)
    run.count("its last layers are in list position", str(places))
    run.at_most("LSB from its colour", error, 0.25)
    run.equal("pixels of the subtile that are done", closed, [64] * len(places))
    run.equal("values that 20 more entries behind change", changed, 0)
    run.equal("of these, fetched and written back (refresh all)", fetched, [20] * len(places))
    run.against_oracle(frames[0])


@case("S11", "Accumulator head-room")
def s11(run: Run) -> None:
    top = COLOUR_LIMIT
    for opacity, count in ((0.05, 1000), (0.99, 3)):
        frame = run.frame(layers(count, opacity, np.full(count, top)), camera_a(), background="1,1,1")
        name = f"{count} layers of {opacity}"
        run.equal(f"{name}: 8 bit values", np.unique(frame.raster.rgb8).tolist(), [255])
        run.at_most(f"{name}: value from {top}", abs(frame.image[64, 64, 0] / top - 1), 1e-3)
        run.at_most(
            f"{name}: largest value, of the accumulator's range", frame.raster.value.max() / 2**run.formats.acc_w, 1
        )
    over = run.frame(layers(3, 0.99, np.full(3, 100.0)), camera_a())
    run.equal("colour 100: clamped_colour", over.counters["clamped_colour"], 3)
    run.equal("colour 100: 8 bit values", np.unique(over.raster.rgb8).tolist(), [255])


@case("S12", "Final rounding", "raster_core/test_pixel_resolver: tiles_at_the_corners_of_a_picture")
def s12(run: Run) -> None:
    wrong = 0
    for k in (0, 1, 127, 254):
        at = int(np.ceil((2 * k + 1) * 2**run.formats.acc_f / (2 * 255)))
        wrong += sum(scu.to_8_bit(run.formats, at + step) != k + (step >= 0) for step in (-1, 0, 1))
    run.equal("one code below, at and above (k + 0.5)/255: not half up", wrong, 0)
    run.equal(
        "0 and the largest value",
        [scu.to_8_bit(run.formats, 0), scu.to_8_bit(run.formats, (1 << run.formats.acc_w) - 1)],
        [0, 255],
    )
    frame = run.frame(crowd(12, 300), camera_a())
    rounded = np.minimum(np.floor(frame.raster.value / 2.0**run.formats.acc_f * 255 + 0.5), 255)
    run.equal("a picture: 8 bit values that are not half up", int((rounded != frame.raster.rgb8).sum()), 0)
