"""Intersection test and duplication: I01 to I08."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from golden import oracle, params
from golden.hard_cases.case import case
from golden.hard_cases.pixels import bits_set, needed, one_a_tile
from golden.hard_cases.run import Run, cycles, lsb
from golden.hard_cases.setting import camera_a, ellipses, gaussians, layers
from golden.preprocess import encode

RIGHT = (64, 0)  # origin of the tile to the right
EMPTY_TILE = 1100  # cycles of a tile without an entry: 1,024 beats of pixels, and what starts and ends them


@case(
    "I01",
    "Ellipse that ends exactly on a pixel centre",
    "raster_core/test_row_reach: every_root_and_the_codes_beside_it",
)
def i01(run: Run) -> None:
    exact = encode(run.formats, ellipses((61.5, 32.5), (1, 0, 1), 0.3530083580))
    missed = vain = wanted = 0
    for dx in (-1, 0, 1):
        for do in (-1, 0, 1):
            features = replace(exact, mean=exact.mean + np.int32([dx, 0]), opacity=exact.opacity + np.int32(do))
            frame = run.given(ellipses((61.5, 32.5), (1, 0, 1), 0.3530083580), features).frame(camera_a())
            listed, need = frame.order.tile(1).size > 0, bool(needed(run.formats, features, RIGHT)[0])
            missed += need and not listed
            vain += listed and not need
            wanted += need
    run.equal("9 variants: right tile not listed though a pixel passes", missed, 0)
    run.count("9 variants: listed though no pixel passes", vain)
    run.equal("both sides occur: variants with a pixel in the right tile, of 9", 0 < wanted < 9, True)


@case("I02", "Three-sigma radius against the 1/255 radius")
def i02(run: Run) -> None:
    frame = run.given(ellipses((33, 32.5), (100, 0, 100), 1.0)).frame(camera_a())
    run.equal("right tile lists it", frame.order.tile(1).size, 1)
    run.at_most("alpha at (64, 32) from 0.0070", abs(frame.image[32, 64, 0] - 0.0070), 2**-12)
    run.against_oracle(frame)
    faint = run.given(ellipses((33, 32.5), (100, 0, 100), 0.3)).frame(camera_a())
    run.equal("opacity 0.3: right tile lists it", faint.order.tile(1).size, 0)


@case("I03", "Image size that is no multiple of the tile")
def i03(run: Run) -> None:
    rng = np.random.default_rng(3)
    means = np.concatenate(
        # inside 1.3 tan(fov / 2) of the smaller picture too, so that both project alike
        [rng.uniform((-1, -0.6, 2), (1, 0.6, 4), (200, 3)), [(1.023, 0.0859, 2), (1.0375, -0.453, 2), (1, 0, 2)]]
    )
    scene = gaussians(means, scales=0.05, opacities=0.7, colours=rng.random((203, 3)))
    small, large = run.frame(scene, camera_a(130, 70)), run.frame(scene, camera_a(192, 128))
    run.equal("picture", small.raster.value.shape, (70, 130, 3))
    differ = np.count_nonzero(small.raster.value != large.raster.value[:70, :130])
    run.equal("against the corner of 192x128: values that differ", int(differ), 0)
    run.against_oracle(small)
    opaque = run.frame(layers(300, 1.0), camera_a(130, 70))
    run.equal("300 opaque layers: pixels blended", opaque.counters["blends"], 2 * 130 * 70)
    later = [int(opaque.raster.counts[b].sum()) for b in opaque.raster.batch_offsets[:-1] + 1]
    run.at_most("hits blended behind the first batch, worst tile", max(later), 44 * params.UNITS)


@case("I04", "Mean exactly on a tile corner")
def i04(run: Run) -> None:
    frame = run.frame(gaussians((0, 0, 2), scales=1e-9, opacities=0.9), camera_a())
    run.equal("entries of each tile", frame.order.lengths.tolist(), [1, 1, 1, 1])
    patch = frame.image[63:65, 63:65, 0]
    run.equal("different values of the four pixels", len(np.unique(patch)), 1)
    run.at_most("alpha from 0.39114", abs(patch[0, 0] - 0.39114), 2**-12)


@case(
    "I05",
    "Diagonal needle over the subtile grid",
    "raster_core/test_group_test_unit: it_is_the_golden_predicate",
)
def i05(run: Run) -> None:
    shift = np.arange(16) / 16
    x, y = (v.ravel() for v in np.meshgrid(28 + shift, 28 + shift))
    missed = hits = need = 0
    for step in range(16):
        c, s = np.cos(step * np.pi / 16), np.sin(step * np.pi / 16)
        big, thin = 640.0**2, 0.0064**2
        cov = big * c * c + thin * s * s + 0.3, (big - thin) * c * s, big * s * s + thin * c * c + 0.3
        camera, origins, pairs = one_a_tile(x.size)
        needles = ellipses(origins + np.stack([x, y], 1), cov, 0.8)
        drawn = run if step % 4 == 1 else Run(run.settings)  # a quarter of them by the RTL
        frame = drawn.given(needles, pairs=pairs).frame(camera)
        want = needed(run.formats, frame.features, origins)
        missed += bits_set(want & ~frame.raster.bitmaps)
        hits += bits_set(frame.raster.bitmaps)
        need += bits_set(want)
    run.equal("4096 needles: subtiles missed", missed, 0)
    run.at_most("4096 needles: bits set for one needed", hits / need, 1.0004)


@case("I06", "Splat between pixel centres")
def i06(run: Run) -> None:
    scene = gaussians((0, 0, 2), scales=1e-9, opacities=0.0090)
    sequence = run.sequence(scene)
    frame = sequence.frame(camera_a())
    origins = [(0, 0), (64, 0), (0, 64), (64, 64)]
    run.equal("subtiles that need it", sum(bits_set(needed(run.formats, frame.features, at)) for at in origins), 0)
    run.equal("pixels drawn", int(np.count_nonzero(frame.raster.value)), 0)
    run.at_most("nearest pixels below the cut, relative", 1 - 0.0090 * 0.43460 * 255, 0.003)
    run.count("tiles that list it in vain, of 4", frame.order.words.size)
    fainter = run.frame(gaussians((0, 0, 2), scales=1e-9, opacities=0.0088), camera_a())
    run.equal("opacity 0.0088, 2.5 % below: tiles that list it", fainter.order.words.size, 0)


@case("I07", "One splat over the whole screen, thousands of times")
def i07(run: Run) -> None:
    def copies(n: int):
        return gaussians(np.tile([(0, 0, 0.25)], (n, 1)), scales=5.0, opacities=0.004)

    camera = camera_a()
    frame = run.frame(copies(4096), camera)
    run.equal("pairs", frame.counters["entries"], 4096 * 4)
    run.equal("pairs with subtiles", frame.counters["pairs"], 4096 * 4 * params.SUBTILES)
    truth = oracle.render(copies(4096), camera)
    run.at_most("LSB from the oracle", lsb(frame.image, truth), 1)
    half = Run(run.settings).frame(copies(2048), camera)
    run.at_most("cycles of 4096 over those of 2048", cycles(frame) / cycles(half), 2)
    # a hit takes an SCU BEATS cycles, a group is blended at once; a tenth more for the borders of groups and batches
    run.at_most("cycles an entry", cycles(frame) / 4096 / 4, params.BEATS * params.GROUPS * 1.1)


@case(
    "I08",
    "Empty scene, empty tile, empty subtile",
    "raster_core/test_raster_lane: many_empty_tiles_wait_for_their_responses",
)
def i08(run: Run) -> None:
    background = [2 ** (run.formats.acc_f - k) for k in (2, 1, 0)]
    for name, scene in (("no Gaussian", np.zeros((0, 3))), ("all behind", [(0, 0, -1), (1, 0, -2)])):
        frame = run.frame(gaussians(scene), camera_a(), background="0.25,0.5,1")
        values = np.unique(frame.raster.value.reshape(-1, 3), axis=0).tolist()
        run.equal(f"{name}: colours of the picture", values, [background])
        run.equal(f"{name}: blends", frame.counters["blends"], 0)
    wide = Run(run.settings).frame(gaussians(np.zeros((0, 3))), camera_a(128, 1024))
    run.at_most("cycles of an empty tile", (cycles(wide) - cycles(frame)) / 28, EMPTY_TILE)
    corner = run.frame(gaussians((0.5, 0.5, 2), scales=1e-3), camera_a(), background="0.25,0.5,1")
    run.equal("one splat: entries of each tile", corner.order.lengths.tolist(), [0, 0, 0, 1])
    need = bits_set(needed(run.formats, corner.features, (64, 64)))
    run.equal("one splat: subtiles hit", bits_set(corner.raster.bitmaps), need)
    others = np.ones((128, 128), bool)
    others[64:, 64:] = False
    run.equal("one splat: other tiles' values", np.unique(corner.raster.value[others], axis=0).tolist(), [background])
    stale = run.sequence(gaussians((0.5, 0.5, 2)), background="0.25,0.5,1")
    stale.frame(camera_a())
    gone = stale.frame(camera_a(position=(0, 0, 9.0)))
    run.equal("behind it in the next frame", np.unique(gone.raster.value.reshape(-1, 3), axis=0).tolist(), [background])
    run.equal("entries a frame later", stale.frame(camera_a(position=(0, 0, 9.0))).order.words.size, 0)
