"""The differences between two pictures."""

from __future__ import annotations

import json

import numpy as np
import pytest

from golden import metrics

LSB = 1 / 255


def test_identical_pictures_have_no_psnr():
    image = np.random.default_rng(0).random((9, 8, 3))
    result = metrics.compare(image, image)
    assert result["psnr_db"] is None and result["max_lsb"] == 0 and result["flips"] == 0
    json.dumps(result, allow_nan=False)
    assert metrics.ssim(image, image) == 1


def test_one_pixel_two_steps_off():
    truth = np.full((10, 10, 3), 0.5)
    image = truth.copy()
    image[3, 7, 1] += 2 * LSB
    image[4, 4, 0] -= 0.5 * LSB
    result = metrics.compare(image, truth)
    assert abs(result["max_lsb"] - 2) < 1e-9 and result["worst"] == (7, 3)
    assert result["flips"] == 1 and result["share_above_1_lsb"] == 0.01
    assert abs(result["psnr_db"] - 10 * np.log10(300 / ((2 * LSB) ** 2 + (0.5 * LSB) ** 2))) < 1e-9
    assert metrics.pixels_above(image, truth).tolist() == [[7, 3]]
    assert metrics.pixels_above(image, truth, 0.25).tolist() == [[7, 3], [4, 4]]
    assert metrics.ssim(image, truth) < 1


def test_values_above_1_count_unless_clipped():
    bright, brighter = np.full((8, 8, 3), 2.0), np.full((8, 8, 3), 2.1)
    assert metrics.compare(bright, brighter)["max_lsb"] > 25
    assert metrics.compare(bright, brighter, clip=True)["max_lsb"] == 0


def test_pictures_of_different_size_are_refused():
    with pytest.raises(ValueError, match="shapes"):
        metrics.compare(np.zeros((2, 3, 3)), np.zeros((3, 2, 3)))
    assert metrics.ssim(np.zeros((4, 9, 3)), np.zeros((4, 9, 3))) is None
