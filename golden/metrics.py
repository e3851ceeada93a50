"""How far a picture is from the truth (docs/oracle.md). One LSB is 1/255 of full scale."""

from __future__ import annotations

import math

import numpy as np

_WINDOW = 7  # pixels along the window of SSIM


def compare(image: np.ndarray, truth: np.ndarray, clip: bool = False) -> dict[str, float | int | None]:
    """Differences of two [H, W, 3] pictures, in real values.

    Values are compared as they are, also above 1, so that a display's clipping hides nothing; clip=True compares what a
    display shows, 0..1. Returns psnr_db (peak 1; None when no value differs at all), max_lsb, mean_lsb,
    share_above_1_lsb (of the pixels, worst channel), flips (their number), worst (x, y of the largest difference).
    """
    if image.shape != truth.shape:
        raise ValueError(f"compare: shapes {image.shape} and {truth.shape} differ")
    a, b = image.astype(np.float64), truth.astype(np.float64)
    if clip:
        a, b = np.clip(a, 0, 1), np.clip(b, 0, 1)
    lsb = np.abs(a - b) * 255
    worst = lsb.max(axis=2)
    flips = int(np.count_nonzero(worst > 1))
    square = float(np.mean(np.square(lsb))) / 255**2
    y, x = np.unravel_index(np.argmax(worst), worst.shape)
    return {
        "psnr_db": -10 * math.log10(square) if square > 0 else None,
        "max_lsb": float(worst.max()),
        "mean_lsb": float(lsb.mean()),
        "share_above_1_lsb": flips / worst.size,
        "flips": flips,
        "worst": (int(x), int(y)),
    }


def pixels_above(image: np.ndarray, truth: np.ndarray, lsb: float = 1.0) -> np.ndarray:
    """[n, 2] (x, y) of the pixels with a channel that differs by more than `lsb`, row-major."""
    far = (np.abs(image.astype(np.float64) - truth) * 255 > lsb).any(axis=2)
    return np.argwhere(far)[:, ::-1]


def ssim(image: np.ndarray, truth: np.ndarray) -> float | None:
    """Structural similarity of what a display shows (0..1); None: the picture is smaller than the 7-pixel window."""
    from skimage.metrics import structural_similarity

    if min(image.shape[:2]) < _WINDOW:
        return None
    a, b = (np.clip(x.astype(np.float64), 0, 1) for x in (image, truth))
    return float(structural_similarity(a, b, win_size=_WINDOW, data_range=1.0, channel_axis=2))
