"""Colour of a Gaussian seen from the camera: spherical harmonics of degree 0..3 (docs/preprocess.md).

Basis, order and signs are those of the original 3D Gaussian Splatting files. The sum is in float64: its error against
the exact sum of the float32 coefficients is below 1e-14 of the largest of them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numba
import numpy as np

if TYPE_CHECKING:
    from golden.cameras.camera import Camera
    from golden.scene.gaussians import Gaussians

DEGREE_MAX = 3  # of the harmonics in a scene file

_Y00 = math.sqrt(1 / (4 * math.pi))
_Y1 = math.sqrt(3 / (4 * math.pi))
_Y2 = math.sqrt(15 / (4 * math.pi))
_Y20 = math.sqrt(5 / (16 * math.pi))
_Y33 = math.sqrt(35 / (32 * math.pi))
_Y32 = math.sqrt(105 / (4 * math.pi))
_Y31 = math.sqrt(21 / (32 * math.pi))
_Y30 = math.sqrt(7 / (16 * math.pi))


def colours(
    gaussians: Gaussians, camera: Camera, visible: np.ndarray | None = None, degree: int = DEGREE_MAX
) -> np.ndarray:
    """[N, 3] float64 max(0, SH(direction) + 0.5), direction = normalise(mean - camera position); no upper clamp.

    Rows that are not `visible` (bool [N]) stay zero. Harmonics above `degree` are left out.
    """
    n = len(gaussians.means)
    seen = np.ones(n, np.bool_) if visible is None else visible
    out = np.zeros((n, 3))
    terms = min(gaussians.sh.shape[1], (degree + 1) ** 2)
    _colours(plain(gaussians.means), plain(gaussians.sh, np.float32), terms, plain(camera.position), seen, out)
    return out


def plain(array: np.ndarray, dtype: type = np.float64) -> np.ndarray:
    """The array in the one memory layout the compiled loops are built for: C order, writeable."""
    return np.require(array, dtype, ["C", "W"])


@numba.njit(parallel=True, cache=True, error_model="numpy")
def _colours(means, sh, terms, position, seen, out):
    for i in numba.prange(means.shape[0]):
        if not seen[i]:
            continue
        red, green, blue = _Y00 * sh[i, 0, 0], _Y00 * sh[i, 0, 1], _Y00 * sh[i, 0, 2]
        if terms > 1:
            x, y, z = means[i, 0] - position[0], means[i, 1] - position[1], means[i, 2] - position[2]
            length = math.sqrt(x * x + y * y + z * z)
            if length > 0:
                x, y, z = x / length, y / length, z / length
            for k in range(1, terms):
                basis = _basis(k, x, y, z)
                red += basis * sh[i, k, 0]
                green += basis * sh[i, k, 1]
                blue += basis * sh[i, k, 2]
        out[i, 0], out[i, 1], out[i, 2] = max(red + 0.5, 0.0), max(green + 0.5, 0.0), max(blue + 0.5, 0.0)


@numba.njit(cache=True)
def _basis(k, x, y, z):
    """Real spherical harmonic k = 1..15 at the unit vector (x, y, z)."""
    if k < 4:
        return -_Y1 * y if k == 1 else (_Y1 * z if k == 2 else -_Y1 * x)
    xx, yy, zz = x * x, y * y, z * z
    if k == 4:
        return _Y2 * x * y
    if k == 5:
        return -_Y2 * y * z
    if k == 6:
        return _Y20 * (2 * zz - xx - yy)
    if k == 7:
        return -_Y2 * x * z
    if k == 8:
        return 0.5 * _Y2 * (xx - yy)
    if k == 9:
        return -_Y33 * y * (3 * xx - yy)
    if k == 10:
        return _Y32 * x * y * z
    if k == 11:
        return -_Y31 * y * (4 * zz - xx - yy)
    if k == 12:
        return _Y30 * z * (2 * zz - 3 * xx - 3 * yy)
    if k == 13:
        return -_Y31 * x * (4 * zz - xx - yy)
    if k == 14:
        return 0.5 * _Y32 * z * (xx - yy)
    return -_Y33 * x * (xx - 3 * yy)
