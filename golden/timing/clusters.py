"""The order of the Gaussians in memory, and clusters of neighbours that are culled whole (docs/traffic.md).

The order decides addresses only: the picture, the tables and their indices do not know it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numba
import numpy as np

from golden.preprocess.colour import plain
from golden.preprocess.projection import ALPHA_CUT, EWA_LIMIT, LOW_PASS
from golden.timing.address_map import BLOCK

if TYPE_CHECKING:
    from golden.cameras.camera import Camera
    from golden.scene.gaussians import Gaussians

_BITS = 21  # of each coordinate on the curve
_FRINGE = 2.0  # pixels: above sqrt(2 ln 255) sigmas of the low-pass, 1.82


@dataclass(frozen=True)
class Store:
    """A scene of N Gaussians as it lies in memory, in blocks of BLOCK places."""

    order: np.ndarray  # [N] int64 Gaussian at each place
    place: np.ndarray  # [N] int64 place of each Gaussian
    means: np.ndarray  # [N, 3] float64, by Gaussian
    reach: np.ndarray  # [N] float64 world units: longest axis, in sigmas at the alpha cut; negative: below it
    centre: np.ndarray  # [B, 3] float64 of the box around a block's means
    spread: np.ndarray  # [B] float64 distance from there to the farthest mean; negative: nothing in it can be seen
    block_reach: np.ndarray  # [B] float64 largest reach of the block

    @property
    def blocks(self) -> int:
        return len(self.spread)


def store(gaussians: Gaussians, morton: bool) -> Store:
    """The scene in the order of its file, or along a Morton curve."""
    n = len(gaussians)
    order = morton_permutation(gaussians.means) if morton else np.arange(n, dtype=np.int64)
    place = np.empty(n, np.int64)
    place[order] = np.arange(n)
    with np.errstate(divide="ignore", invalid="ignore"):
        sigmas = np.sqrt(2 * np.log(gaussians.opacities / ALPHA_CUT))
    reach = np.where(gaussians.opacities >= ALPHA_CUT, sigmas * gaussians.scales.max(axis=1, initial=0), -1.0)
    blocks = -(-n // BLOCK)
    centre, spread, block_reach = np.zeros((blocks, 3)), np.empty(blocks), np.empty(blocks)
    means = plain(gaussians.means)
    _spheres(means, reach, order, centre, spread, block_reach)
    return Store(order, place, means, reach, centre, spread, block_reach)


def morton_permutation(means: np.ndarray) -> np.ndarray:
    """[N] int64: the Gaussians in the order of their means along a Morton curve over the means' box; x lowest."""
    if not len(means):
        return np.zeros(0, np.int64)
    low = means.min(axis=0)
    size = np.maximum(means.max(axis=0) - low, np.finfo(np.float64).tiny)
    cells = np.minimum((means - low) / size * 2**_BITS, 2**_BITS - 1).astype(np.int64)
    code = np.zeros(len(means), np.int64)
    _interleave(cells, code)
    return np.argsort(code, kind="stable")


def seen(camera: Camera, centre: np.ndarray, spread: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """[K] bool: spheres of means in which a Gaussian can be visible; never False where one is (projection.project).

    A Gaussian is visible when x / z * fx + cx + half_x >= 0 (and so for the other sides) with
    half_x^2 <= r^2 (s^2 (1 + l^2) fx^2 / z^2 + 0.3), r s its reach, l <= 1.3 tan(fov / 2) as in the Jacobian. Times
    z / fx this is linear in the mean but for the low-pass, which is less than _FRINGE pixels.
    """
    out = np.empty(len(spread), np.bool_)
    lens = (float(camera.fx), float(camera.fy), float(camera.cx), float(camera.cy), float(camera.near))
    _seen(
        plain(camera.rotation), plain(camera.position), lens, (float(camera.width), float(camera.height)),
        plain(centre), plain(spread), plain(reach), out,
    )  # fmt: skip
    return out


assert math.sqrt(-2 * math.log(ALPHA_CUT) * LOW_PASS) < _FRINGE


@numba.njit(parallel=True, cache=True)
def _interleave(cells, code):
    for i in numba.prange(len(code)):
        word = 0
        for bit in range(_BITS):
            for axis in range(3):
                word |= ((cells[i, axis] >> bit) & 1) << (3 * bit + axis)
        code[i] = word


@numba.njit(parallel=True, cache=True)
def _spheres(means, reach, order, centre, spread, block_reach):
    for b in numba.prange(len(spread)):
        low = np.full(3, np.inf)
        high = np.full(3, -np.inf)
        members = order[b * BLOCK : (b + 1) * BLOCK]
        block_reach[b] = -1.0
        for g in members:
            if reach[g] >= 0:
                block_reach[b] = max(block_reach[b], reach[g])
                for axis in range(3):
                    low[axis] = min(low[axis], means[g, axis])
                    high[axis] = max(high[axis], means[g, axis])
        spread[b] = -1.0
        if block_reach[b] < 0:
            continue
        for axis in range(3):
            centre[b, axis] = 0.5 * low[axis] + 0.5 * high[axis]
        for g in members:
            if reach[g] >= 0:
                d = means[g] - centre[b]
                spread[b] = max(spread[b], math.sqrt((d * d).sum()))


@numba.njit(parallel=True, cache=True, error_model="numpy")
def _seen(rotation, position, lens, size, centre, spread, reach, out):
    fx, fy, cx, cy, near = lens
    width, height = size
    stretch_x = math.sqrt(1 + (EWA_LIMIT * 0.5 * width / fx) ** 2)
    stretch_y = math.sqrt(1 + (EWA_LIMIT * 0.5 * height / fy) ** 2)
    left, right = (cx + _FRINGE) / fx, (width - cx + _FRINGE) / fx
    top, bottom = (cy + _FRINGE) / fy, (height - cy + _FRINGE) / fy
    for k in numba.prange(len(out)):
        if spread[k] < 0 or reach[k] < 0:
            out[k] = False
            continue
        d = centre[k] - position
        x = rotation[0, 0] * d[0] + rotation[0, 1] * d[1] + rotation[0, 2] * d[2]
        y = rotation[1, 0] * d[0] + rotation[1, 1] * d[1] + rotation[1, 2] * d[2]
        z = rotation[2, 0] * d[0] + rotation[2, 1] * d[1] + rotation[2, 2] * d[2]
        grown_x, grown_y = reach[k] * stretch_x, reach[k] * stretch_y
        out[k] = (
            z + spread[k] > near
            and x + left * z + spread[k] * math.sqrt(1 + left * left) + grown_x >= 0
            and -x + right * z + spread[k] * math.sqrt(1 + right * right) + grown_x >= 0
            and y + top * z + spread[k] * math.sqrt(1 + top * top) + grown_y >= 0
            and -y + bottom * z + spread[k] * math.sqrt(1 + bottom * bottom) + grown_y >= 0
        )
