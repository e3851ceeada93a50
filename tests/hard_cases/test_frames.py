"""Hard cases that concern whole frames: culling, tiles, blending as seen in the picture."""

from __future__ import annotations

import numpy as np
import pytest

from golden import params
from tests.hard_cases.setting import camera_a, gaussians, merge, render


def same(a, b) -> bool:
    return np.array_equal(a.raster.value, b.raster.value)


def test_p01_gaussian_at_the_camera_centre_changes_nothing():
    normal = gaussians((0, 0, 2))
    both = merge(gaussians((0, 0, 0)), normal)
    frame = render(both, camera_a())
    assert frame.counters["culled_near"] == 1
    assert same(frame, render(normal, camera_a()))


def test_p02_near_plane_one_code_either_side():
    near = camera_a().near
    depths = [np.nextafter(near, 0), near, np.nextafter(near, 1)]
    frame = render(gaussians([(0, 0, z) for z in depths], scales=0.01), camera_a())
    assert frame.counters["culled_near"] == 2
    assert np.array_equal(frame.features.visible, [False, False, True])


def test_p03_huge_splat_is_in_all_tiles_and_subtiles():
    frame = render(gaussians((0, 0, 0.25), scales=5.0, opacities=0.5), camera_a())
    assert (frame.raster.bitmaps == np.uint64(0xFFFFFFFFFFFFFFFF)).all()
    assert frame.order.words.size == 4
    assert np.abs(frame.image - 0.5).max() <= 2**-10 + 0.5 * (1 - np.exp(-0.5 * (90 / 2560) ** 2))
    assert abs(frame.image[0, 0, 0] - 0.49969) <= 2**-10


def test_p04_far_outside_the_frustum_is_culled():
    scene = merge(gaussians((20, 0, 2), scales=1.0), gaussians((0, 0, 2)))
    frame = render(scene, camera_a())
    assert frame.counters["culled_offscreen"] == 1
    assert same(frame, render(gaussians((0, 0, 2)), camera_a()))


@pytest.mark.parametrize("antialias", [False, True])
def test_p08_subpixel_splat_with_and_without_compensation(antialias):
    far = gaussians((3.90625, 3.90625, 1000), scales=1e-3, opacities=1.0, antialias=antialias)
    frame = render(far, camera_a())
    if antialias:
        assert frame.counters["culled_alpha"] == 1
        assert not frame.raster.value.any()
    else:
        near = render(gaussians((0.0078125, 0.0078125, 2), scales=1e-9, opacities=1.0), camera_a())
        assert same(frame, near)
        assert np.count_nonzero(frame.raster.value[..., 0]) == 9
        assert abs(frame.image[64, 64, 0] - 0.99) < 2**-12


def test_p13_colours_below_zero_and_above_one():
    twice = gaussians([(0.0078125, 0.0078125, 2)] * 2, opacities=0.5, colours=(-0.3, 0.5, 2.47))
    frame = render(twice, camera_a(), background="1,1,1")
    assert np.abs(frame.image[64, 64] - [0.25, 0.625, 2.1025]).max() < 0.5 / 255
    assert tuple(frame.raster.rgb8[64, 64]) == (64, 159, 255)


def test_p14_geo_referenced_scene_gives_the_same_bits():
    rng = np.random.default_rng(14)
    means = np.round(rng.uniform(-1, 1, (1000, 3)) * 1024) / 1024 + (0, 0, 3)
    offset = np.array((6378137.0, 4200000.0, 512.0))
    colours = rng.random((1000, 3))
    here = render(gaussians(means, scales=0.05, colours=colours), camera_a())
    there = render(gaussians(means + offset, scales=0.05, colours=colours), camera_a(position=offset))
    assert same(here, there)


def test_i03_picture_that_is_no_multiple_of_the_tile():
    rng = np.random.default_rng(3)
    means = np.concatenate(
        # inside 1.3 tan(fov / 2) of the smaller picture too, so that both project alike
        [rng.uniform((-1, -0.6, 2), (1, 0.6, 4), (200, 3)), [(1.023, 0.0859, 2), (1.0375, -0.453, 2), (1, 0, 2)]]
    )
    scene = gaussians(means, scales=0.05, opacities=0.7, colours=rng.random((203, 3)))
    small = render(scene, camera_a(130, 70))
    large = render(scene, camera_a(192, 128))
    assert small.raster.value.shape == (70, 130, 3)
    assert np.array_equal(small.raster.value, large.raster.value[:70, :130])


def test_i04_mean_on_a_tile_corner():
    frame = render(gaussians((0, 0, 2), scales=1e-9, opacities=0.9), camera_a())
    assert frame.order.words.size == 4
    patch = frame.image[63:65, 63:65, 0]
    assert np.ptp(patch) == 0
    assert abs(patch[0, 0] - 0.39114) < 2**-12


def test_i07_thousands_of_full_screen_splats():
    scene = gaussians(np.tile([(0, 0, 0.25)], (4096, 1)), scales=5.0, opacities=0.004)
    frame = render(scene, camera_a())
    assert frame.counters["entries"] == 4096 * 4
    assert frame.counters["pairs"] == 4096 * 4 * params.SUBTILES


@pytest.mark.parametrize(
    "scene",
    [gaussians(np.zeros((0, 3))), gaussians([(0, 0, -1), (1, 0, -2)])],
    ids=["no Gaussian", "all behind the camera"],
)
def test_i08_empty_scenes_are_background(scene):
    frame = render(scene, camera_a(), background="0.25,0.5,1")
    assert np.array_equal(np.unique(frame.raster.value.reshape(-1, 3), axis=0), [[2**18, 2**19, 2**20]])
    assert frame.counters["blends"] == 0


def test_i08_only_one_tile_and_one_subtile():
    frame = render(gaussians((0.5, 0.5, 2), scales=1e-3), camera_a())
    counts = np.diff(frame.order.offsets)
    assert list(counts) == [0, 0, 0, 1]
    assert bin(int(frame.raster.bitmaps[0])).count("1") <= 4
    assert not frame.raster.value[:64].any()


def test_s01_two_layers_at_the_clamp_stop_behind_the_second():
    scene = gaussians([(0, 0, 0.25), (0, 0, 0.26)], scales=50.0, opacities=1.0, colours=[(0, 0, 0), (1, 1, 1)])
    frame = render(scene, camera_a())
    assert len(np.unique(frame.raster.value)) == 1
    # blend-last: the second layer is blended, then the pixel ends
    assert frame.raster.transmittance.max() < params.T_STOP


@pytest.mark.parametrize("white_first", [True, False])
def test_s02_a_thousand_faint_layers(white_first):
    shade = np.repeat([1.0, 0.0] if white_first else [0.0, 1.0], 500)
    depth = 0.25 + np.arange(1000) * 1e-4
    scene = gaussians(
        np.stack([0 * depth, 0 * depth, depth], 1),
        scales=500.0,
        opacities=1 / 255,
        colours=np.repeat(shade[:, None], 3, 1),
    )
    frame = render(scene, camera_a())
    first, rest = 1 - (254 / 255) ** 500, (254 / 255) ** 500
    expected = 255 * (first if white_first else rest * first)
    assert abs(frame.image[64, 64, 0] * 255 - expected) <= 0.25
    assert abs(frame.raster.transmittance[64, 64] / 2**params.T_F - rest**2) < 1e-4


def test_s03_running_into_the_stop_slowly():
    depth = 0.25 + np.arange(2500) * 1e-4
    shade = (np.arange(2500) // 100) % 2 * 1.0
    scene = gaussians(
        np.stack([0 * depth, 0 * depth, depth], 1),
        scales=500.0,
        opacities=1 / 255,
        colours=np.repeat(shade[:, None], 3, 1),
    )
    frame = render(scene, camera_a())
    weights = (1 / 255) * (254 / 255) ** np.arange(2500)
    assert abs(frame.image[64, 64, 0] * 255 - 255 * (weights * shade).sum()) <= 1
    # w = round(alpha * T) is 0 once T < 0.5 / alpha = 127.5 codes: T rests there (0.12 LSB) and the stop never comes
    assert frame.counters["blends"] == 2500 * 128 * 128
    assert (frame.raster.transmittance == 127).all()


def test_s04_white_on_white_is_white():
    rng = np.random.default_rng(4)
    means = rng.uniform(-1.2, 1.2, (1000, 3)) + (0, 0, 3)
    scene = gaussians(means, scales=rng.uniform(0.01, 0.6, (1000, 3)), opacities=rng.random(1000), colours=1.0)
    frame = render(scene, camera_a(), background="1,1,1")
    assert (frame.raster.rgb8 == 255).all()
    assert (frame.raster.value == 2**params.ACC_F).all()


def test_s10_one_pixel_that_stays_open():
    """63 pixels saturate, one is covered only by the last entry, placed around the border of a batch."""
    for last in (10, 254, 255, 256, 257, 511):
        walls = gaussians([(0.3, 0.3, 1)] * 10, scales=10.0, opacities=1.0, colours=0.2)
        filler = gaussians([(0.3, 0.3, 2)] * (last - 10), scales=10.0, opacities=0.5, colours=0.9)
        tail = gaussians((0.3, 0.3, 3), scales=10.0, opacities=0.8, colours=0.7)
        behind = gaussians([(0.3, 0.3, 4)] * 20, scales=10.0, opacities=0.8, colours=0.1)
        parts = [walls, filler, tail] if last > 10 else [walls, tail]
        frame = render(merge(*parts), camera_a())
        longer = render(merge(*parts, behind), camera_a())
        assert same(frame, longer)
        assert longer.counters["entries"] == frame.counters["entries"] + 80  # refresh all: every entry is fetched


def test_s11_largest_colour_does_not_wrap():
    top = params.COLOUR_MAX
    for opacity, layers in ((0.05, 1000), (0.99, 3)):
        scene = gaussians([(0, 0, 2)] * layers, scales=50.0, opacities=opacity, colours=top)
        frame = render(scene, camera_a(), background="1,1,1")
        assert (frame.raster.rgb8 == 255).all()
        assert frame.raster.value.max() <= round(top * 2**params.ACC_F) + layers
