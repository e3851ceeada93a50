"""Gaussians for the tests of the raster core, in record codes: ordinary ones and those that are known to hurt."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from golden.formats import BUILD, record_fields

ROOT_LOG2E = np.sqrt(np.log2(np.e) / 2)
CHOL_MAX = (1 << BUILD.chol_w) - 1
COLOUR_MAX = BUILD.colour_max  # the accumulator holds no more


def cholesky(major: np.ndarray, minor: np.ndarray, angle: np.ndarray, low_pass: float = 0.3) -> np.ndarray:
    """[n, 3] codes (a, b, c) of ellipses with these standard deviations (pixels) and angles, low-pass added."""
    cos, sin = np.cos(angle), np.sin(angle)
    big, small = major**2 + low_pass, minor**2 + low_pass
    xx = cos**2 / big + sin**2 / small
    xy = cos * sin * (1 / big - 1 / small)
    a = np.sqrt(xx)
    values = np.stack([a, xy / a, 1 / (a * np.sqrt(big * small))], axis=1) * ROOT_LOG2E
    codes = np.rint(np.ldexp(values, BUILD.chol_f)).astype(np.int64)
    return np.clip(codes, [0, -CHOL_MAX - 1, 0], CHOL_MAX)


def opacity_code(alpha: np.ndarray) -> np.ndarray:
    """-log2(alpha), UQ3.OPACITY_F, saturated."""
    return np.clip(np.rint(np.ldexp(-np.log2(alpha), BUILD.opacity_f)), 0, (1 << BUILD.opacity_w) - 1).astype(np.int64)


def mean_code(pixels: np.ndarray) -> np.ndarray:
    """Positions in pixels, SQ13.MEAN_F, saturated."""
    top = 1 << (BUILD.mean_w - 1)
    return np.clip(np.rint(np.ldexp(pixels, BUILD.mean_f)), -top, top - 1).astype(np.int64)


def gaussians(n: int, seed: int, x0: int = 0, y0: int = 0, kind: str = "mixed") -> np.ndarray:
    """[n, 9] int64 in the order of RECORD_FIELDS, around the subtile at pixel (x0, y0).

    kind: "mixed" (sizes of trained scenes), "needle", "huge", "far" (means far outside), "small", "codes" (any code).
    """
    r = np.random.default_rng(seed)
    if kind == "codes":
        widths = np.array([width for _, width in record_fields(BUILD)[:9]])
        codes = r.integers(0, 1 << widths, (n, 9))
        signed = np.array([name in ("mean_x", "mean_y", "chol_b") for name, _ in record_fields(BUILD)[:9]])
        codes[:, 6:] = np.minimum(codes[:, 6:], COLOUR_MAX)
        return np.where(signed & (codes >= 1 << (widths - 1)), codes - (1 << widths), codes)
    spread, major, minor = {
        "mixed": (12, np.exp(r.normal(1.0, 1.0, n)), np.exp(r.normal(0.0, 1.0, n))),
        "needle": (60, np.exp(r.uniform(2, 7, n)), np.full(n, 1e-4)),
        "huge": (2000, np.exp(r.uniform(4, 9, n)), np.exp(r.uniform(3, 9, n))),
        "far": (9000, np.exp(r.uniform(0, 9, n)), np.exp(r.uniform(-2, 7, n))),
        "small": (8, np.exp(r.uniform(-6, 0, n)), np.exp(r.uniform(-6, 0, n))),
    }[kind]
    mean = np.stack([x0 + 4 + r.normal(0, spread, n), y0 + 4 + r.normal(0, spread, n)], axis=1)
    alpha = np.where(r.random(n) < 0.5, r.uniform(1 / 256, 1, n), np.exp(r.uniform(np.log(1 / 256), 0, n)))
    colour = r.integers(0, COLOUR_MAX + 1, (n, 3))
    return np.column_stack(
        [mean_code(mean), cholesky(major, minor, r.uniform(0, np.pi, n)), opacity_code(alpha), colour]
    )


def edges(rows: np.ndarray, answer) -> np.ndarray:
    """Pairs of neighbours [2n, k]: a field of a row moved towards the row before it, to where answer(row) changes.

    A bit that goes wrong in any field changes the answer of some of them.
    """
    found = []
    for before, row in pairwise(rows):
        for field in range(len(row)):
            low, high = row.copy(), row.copy()
            high[field] = before[field]
            kept = answer(low)
            if answer(high) == kept:
                continue
            while abs(high[field] - low[field]) > 1:
                middle = low.copy()
                middle[field] = (low[field] + high[field]) // 2
                low, high = (middle, high) if answer(middle) == kept else (low, middle)
            found += [low, high]
    return np.array(found)
