"""The fast raster core model against the units' one-pixel arithmetic, and its rules about done subtiles."""

from __future__ import annotations

import numpy as np
import pytest

from golden import records
from golden.formats import REFERENCE
from golden.raster_core import exp2_unit, pixel_blender
from golden.raster_core import subtile_compute_unit as scu
from golden.raster_core.ellipse_setup import setup
from golden.raster_core.group_test_unit import tile_bitmap
from golden.raster_core.raster_core import rasterise
from tb.raster_core.scenes import every_entry, scene, tiles, walls

BACKGROUND = (100, 512, 1023)


def one_pixel_at_a_time(features, words, x0, y0, width, height):
    """A tile by the unit's functions alone: (value int[64, 64, 3], T int[64, 64], blends)."""
    value, transmittance, blends = np.zeros((64, 64, 3), np.int64), np.zeros((64, 64), np.int64), 0
    for y in range(min(64, height - y0)):
        for x in range(min(64, width - x0)):
            t, acc = 1 << REFERENCE.t_f, [0, 0, 0]
            for g in records.indices_of(words):
                a, b, c = (int(v) for v in features.chol[g])
                sx, sy = x & ~7, y & ~7
                u, v = setup(REFERENCE, a, b, c, int(features.mean[g, 0]), int(features.mean[g, 1]), x0 + sx, y0 + sy)
                p = scu.power(REFERENCE, u + (x - sx) * a + (y - sy) * b, v + (y - sy) * c, int(features.opacity[g]))
                if p <= REFERENCE.cut and t >= REFERENCE.t_stop:
                    w = pixel_blender.weight(REFERENCE, exp2_unit.alpha(REFERENCE, p), t)
                    t -= w
                    acc = [pixel_blender.accumulate(REFERENCE, acc[i], w, int(features.colour[g, i])) for i in range(3)]
                    blends += 1
            transmittance[y, x] = t
            value[y, x] = [scu.resolve(REFERENCE, acc[i], t, BACKGROUND[i]) for i in range(3)]
    return value, transmittance, blends


@pytest.mark.parametrize("size", [(64, 64), (130, 70)], ids=str)
def test_pixels_are_those_of_the_unit(size):
    width, height = size
    features = scene(40, width, height)
    origins = tiles(width, height)
    offsets, words = every_entry(features, len(origins))
    result = rasterise(REFERENCE, (offsets, words), features, origins, width, height, BACKGROUND)
    for tile, (x0, y0) in enumerate(origins):
        part = slice(offsets[tile], offsets[tile + 1])
        value, transmittance, blends = one_pixel_at_a_time(features, words[part], x0, y0, width, height)
        live = result.value[y0 : y0 + 64, x0 : x0 + 64]
        np.testing.assert_array_equal(live, value[: live.shape[0], : live.shape[1]])
        np.testing.assert_array_equal(
            result.transmittance[y0 : y0 + 64, x0 : x0 + 64], transmittance[: live.shape[0], : live.shape[1]]
        )
        assert result.blends[tile] == blends
    np.testing.assert_array_equal(result.rgb8, np.vectorize(lambda v: scu.to_8_bit(REFERENCE, v))(result.value))


def test_bitmaps_and_words_are_those_of_the_predicate():
    width, height = 130, 70
    features = scene(300, width, height, seed=1)
    origins = tiles(width, height)
    offsets, words = every_entry(features, len(origins))
    result = rasterise(REFERENCE, (offsets, words), features, origins, width, height)
    for tile, (x0, y0) in enumerate(origins):
        for entry in range(offsets[tile], offsets[tile + 1]):
            g = int(words[entry]) & records.INDEX_MASK
            geometry = (*features.chol[g], *features.mean[g], features.opacity[g], x0, y0)
            assert result.bitmaps[entry] == tile_bitmap(REFERENCE, *(int(v) for v in geometry), width, height)
    indices = records.indices_of(words)
    np.testing.assert_array_equal(records.indices_of(result.words_out), indices)
    np.testing.assert_array_equal(records.keys_of(result.words_out), features.key[indices])
    np.testing.assert_array_equal(result.words_out & records.INVALID != 0, result.bitmaps == 0)
    assert result.pairs.sum() == sum(int(b).bit_count() for b in result.bitmaps)


def test_a_done_subtile_skips_from_the_batch_behind_its_swap_out():
    """600 walls: every subtile is done in batch 0, is swapped out done, and does nothing from batch 1 on."""
    features = walls(600)
    result = rasterise(REFERENCE, every_entry(features, 1), features, tiles(64, 64), 64, 64)
    assert result.bitmaps.min() == 2**64 - 1
    # The subtile that is still held at the border of the batches is not yet known to be done.
    np.testing.assert_array_equal(result.counts[0], 256)
    assert (result.counts[1, :-1] == 0).all() and (result.counts[1, -1] == 256).all()
    assert (result.counts[2, :-1] == 0).all() and (result.counts[2, -1] == 88).all()
    assert result.scu_ops[0] == 64 * 256 + 4 * (256 + 88) and result.pairs[0] == 64 * 600
    assert (result.transmittance < REFERENCE.t_stop).all() and (result.transmittance > 0).all()


def test_live_pixels_keep_a_subtile_going():
    """As above, but the picture ends inside the subtiles: only live pixels count for done."""
    features = walls(600)
    result = rasterise(REFERENCE, every_entry(features, 1), features, tiles(61, 3), 61, 3)
    assert (result.counts[1, 0] == 0).all() and (result.counts[1, 1] == 256).all()
    assert (result.counts[:, 2:] == 0).all() and result.value.shape == (3, 61, 3)


def test_an_empty_table_is_background():
    features = scene(1, 64, 64)
    result = rasterise(
        REFERENCE, (np.zeros(7, np.int64), np.zeros(0, np.int64)), features, tiles(130, 70), 130, 70, BACKGROUND
    )
    np.testing.assert_array_equal(result.value, np.broadcast_to(np.array(BACKGROUND) << 10, (70, 130, 3)))
    assert (result.transmittance == 1 << REFERENCE.t_f).all() and result.blends.sum() == 0


def test_tiles_do_not_see_each_other():
    width, height = 192, 128
    features = scene(700, width, height, seed=3)
    origins = tiles(width, height)
    offsets, words = every_entry(features, len(origins))
    together = rasterise(REFERENCE, (offsets, words), features, origins, width, height, BACKGROUND)
    alone = rasterise(REFERENCE, (offsets[:2], words[:700]), features, origins[3:4], width, height, BACKGROUND)
    np.testing.assert_array_equal(alone.value[64:, :64], together.value[64:, :64])
    np.testing.assert_array_equal(alone.counts, together.counts[9:12])
