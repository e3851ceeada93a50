"""Feature records: the projected Gaussians as codes (docs/architecture.md section 2, docs/preprocess.md).

With q = d^T conic d, conic = cov2d^-1, the footprint is u = a dx + b dy, v = c dy, u^2 + v^2 = q log2(e) / 2. Comparing
terms, a^2 = k conic_xx, a b = k conic_xy, b^2 + c^2 = k conic_yy with k = log2(e) / 2, hence

    a = sqrt(k cov_yy / det)     b = -sqrt(k) cov_xy / sqrt(cov_yy det)     c = sqrt(k / cov_yy)

where nothing is subtracted. cov_yy >= 0.3 and the conic's terms are <= 1 / 0.3, so a, |b| and c stay below 1.56.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numba
import numpy as np

from golden import records
from golden.formats import Formats
from golden.preprocess.projection import Projection

_FOOTPRINT = math.sqrt(math.log2(math.e) / 2)


@dataclass(frozen=True)
class Features:
    """Feature records as codes, int32. A Gaussian that is not visible has opacity_none, so it is hit nowhere."""

    mean: np.ndarray  # [N, 2] SQ13.MEAN_F
    chol: np.ndarray  # [N, 3] a UQ1.CHOL_F, b SQ1.CHOL_F, c UQ1.CHOL_F
    opacity: np.ndarray  # [N] UQ3.OPACITY_F, -log2(opacity)
    colour: np.ndarray  # [N, 3] UQ3.COLOUR_F, at most COLOUR_MAX
    key: np.ndarray  # [N] depth key
    visible: np.ndarray  # [N] bool
    counters: dict[str, int] = field(default_factory=dict)  # culled_range, clamped_colour, clamped_depth


def opacity_none(f: Formats) -> int:
    """The opacity of a record that hits no subtile: above the cut and the margin of the intersection test."""
    return (1 << f.opacity_w) - 1


def encode(f: Formats, projection: Projection, far: float = 0.0) -> Features:
    """Codes of every visible Gaussian; all roundings half_up. far: of linear keys.

    Counted: culled_range, the mean does not fit SQ13.MEAN_F; clamped_colour, Gaussians with a channel above COLOUR_MAX;
    clamped_depth, Gaussians whose depth is outside the key's range.
    """
    n = len(projection.visible)
    mean, chol, rgb = np.zeros((n, 2), np.int32), np.zeros((n, 3), np.int32), np.zeros((n, 3), np.int32)
    opacity = np.full(n, opacity_none(f), np.int32)
    visible = projection.visible.copy()
    p = projection
    lost, clamped = _encode(f, p.mean2d, p.cov2d, p.det, p.opacity, p.colour, visible, mean, chol, opacity, rgb)
    key = np.where(visible, records.depth_key(f, p.depth, far), (1 << f.key_bits) - 1).astype(np.int32)
    low, high = records.key_range(f, far)
    below, above = p.depth < low, p.depth >= high
    counters = {
        "culled_range": int(lost),
        "clamped_colour": int(clamped),
        "clamped_depth": int(np.count_nonzero(visible & (below | above))),
    }
    return Features(mean, chol, opacity, rgb, key, visible, counters)


@numba.njit(inline="always", cache=True)
def _code(x, fraction):
    """x to a code of 2**-fraction, half_up; still float64, so that no size of x wraps."""
    return np.floor(x * (1 << fraction) + 0.5)


@numba.njit(parallel=True, cache=True, error_model="numpy")
def _encode(f: Formats, mean2d, cov2d, det, opacity_in, colour_in, visible, mean, chol, opacity, colour):
    lost, clamped = 0, 0
    limit = 1 << (f.mean_w - 1)
    for i in numba.prange(len(visible)):
        if not visible[i]:
            continue
        x, y = _code(mean2d[i, 0], f.mean_f), _code(mean2d[i, 1], f.mean_f)
        if not (-limit <= x < limit and -limit <= y < limit):
            visible[i] = False
            lost += 1
            continue
        mean[i, 0], mean[i, 1] = int(x), int(y)
        root_yy, root_det = math.sqrt(cov2d[i, 2]), math.sqrt(det[i])
        chol[i, 0] = int(_code(_FOOTPRINT * (root_yy / root_det), f.chol_f))
        chol[i, 1] = int(_code(-_FOOTPRINT * (cov2d[i, 1] / root_yy / root_det), f.chol_f))
        chol[i, 2] = int(_code(_FOOTPRINT / root_yy, f.chol_f))
        opacity[i] = int(_code(-math.log2(opacity_in[i]), f.opacity_f))
        above = 0
        for k in range(3):
            code = _code(colour_in[i, k], f.colour_f)
            if code > f.colour_max:
                above = 1
            colour[i, k] = int(min(code, float(f.colour_max)))
        clamped += above
    return lost, clamped
