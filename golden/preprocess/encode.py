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

from golden import params, records
from golden.preprocess.projection import Projection

_FOOTPRINT = math.sqrt(math.log2(math.e) / 2)
_MEAN_LIMIT = 1 << (params.MEAN_W - 1)
_COLOUR_MAX = int(params.COLOUR_MAX * (1 << params.COLOUR_F))
OPACITY_NONE = (1 << params.OPACITY_W) - 1  # above the cut: such a record never hits a subtile


@dataclass(frozen=True)
class Features:
    """Feature records as codes, int32. A Gaussian that is not visible has OPACITY_NONE, so it is hit nowhere."""

    mean: np.ndarray  # [N, 2] SQ13.10
    chol: np.ndarray  # [N, 3] a UQ1.20, b SQ1.20, c UQ1.20
    opacity: np.ndarray  # [N] UQ3.13, -log2(opacity)
    colour: np.ndarray  # [N, 3] UQ3.10, at most COLOUR_MAX
    key: np.ndarray  # [N] depth key
    visible: np.ndarray  # [N] bool
    counters: dict[str, int] = field(default_factory=dict)  # culled_range, clamped_colour, clamped_depth


def encode(projection: Projection) -> Features:
    """Codes of every visible Gaussian; all roundings half_up.

    Counted: culled_range, the mean does not fit SQ13.10; clamped_colour, Gaussians with a channel above COLOUR_MAX;
    clamped_depth, Gaussians whose depth is outside the key's range.
    """
    n = len(projection.visible)
    mean, chol, rgb = np.zeros((n, 2), np.int32), np.zeros((n, 3), np.int32), np.zeros((n, 3), np.int32)
    opacity = np.full(n, OPACITY_NONE, np.int32)
    visible = projection.visible.copy()
    p = projection
    lost, clamped = _encode(p.mean2d, p.cov2d, p.det, p.opacity, p.colour, visible, mean, chol, opacity, rgb)
    key = np.where(visible, records.depth_key(p.depth), records.KEY_MASK).astype(np.int32)
    below, above = p.depth < 2.0**-params.KEY_BIAS, p.depth >= records.KEY_MAX_DEPTH
    counters = {
        "culled_range": int(lost),
        "clamped_colour": int(clamped),
        "clamped_depth": int(np.count_nonzero(visible & (below | above))),
    }
    return Features(mean, chol, opacity, rgb, key, visible, counters)


@numba.njit(inline="always", cache=True)
def _code(x, fraction):
    """x to a code of 2**-fraction, half_up."""
    return math.floor(x * (1 << fraction) + 0.5)


@numba.njit(parallel=True, cache=True, error_model="numpy")
def _encode(mean2d, cov2d, det, opacity_in, colour_in, visible, mean, chol, opacity, colour):
    lost, clamped = 0, 0
    for i in numba.prange(len(visible)):
        if not visible[i]:
            continue
        x, y = _code(mean2d[i, 0], params.MEAN_F), _code(mean2d[i, 1], params.MEAN_F)
        if not (-_MEAN_LIMIT <= x < _MEAN_LIMIT and -_MEAN_LIMIT <= y < _MEAN_LIMIT):
            visible[i] = False
            lost += 1
            continue
        mean[i, 0], mean[i, 1] = int(x), int(y)
        root_yy, root_det = math.sqrt(cov2d[i, 2]), math.sqrt(det[i])
        chol[i, 0] = int(_code(_FOOTPRINT * (root_yy / root_det), params.CHOL_F))
        chol[i, 1] = int(_code(-_FOOTPRINT * (cov2d[i, 1] / root_yy / root_det), params.CHOL_F))
        chol[i, 2] = int(_code(_FOOTPRINT / root_yy, params.CHOL_F))
        opacity[i] = int(_code(-math.log2(opacity_in[i]), params.OPACITY_F))
        above = 0
        for k in range(3):
            code = _code(colour_in[i, k], params.COLOUR_F)
            if code > _COLOUR_MAX:
                above = 1
            colour[i, k] = int(min(code, float(_COLOUR_MAX)))
        clamped += above
    return lost, clamped
