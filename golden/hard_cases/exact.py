"""The projection from its formulas with 60 digits, sharing no code with golden/preprocess."""

from __future__ import annotations

from types import SimpleNamespace

import mpmath
import numpy as np
from mpmath import mp, mpf

from golden.cameras.camera import Camera
from golden.scene.gaussians import Gaussians

DIGITS = 60


def _matrix(rows) -> mpmath.matrix:
    return mpmath.matrix([[mpf(float(x)) for x in row] for row in rows])


@mp.workdps(DIGITS)
def project(scene: Gaussians, i: int, camera: Camera) -> SimpleNamespace:
    """Gaussian i on the screen: x, y, z, cov (2x2, low-pass included), det; raw: det without the low-pass."""
    w, x, y, z = (mpf(float(v)) for v in scene.quats[i])
    n = mpmath.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / n, x / n, y / n, z / n
    spin = mpmath.matrix(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )
    v = spin * mpmath.diag([mpf(float(s)) ** 2 for s in scene.scales[i]]) * spin.T
    view = _matrix(camera.rotation)
    t = view * (_matrix([[m] for m in scene.means[i]]) - _matrix([[m] for m in camera.position]))
    fx, fy = mpf(float(camera.fx)), mpf(float(camera.fy))
    limit_x = mpf(13) / 10 * camera.width / (2 * fx)
    limit_y = mpf(13) / 10 * camera.height / (2 * fy)
    tx = min(max(t[0] / t[2], -limit_x), limit_x) * t[2]
    ty = min(max(t[1] / t[2], -limit_y), limit_y) * t[2]
    jacobian = mpmath.matrix([[fx / t[2], 0, -fx * tx / t[2] ** 2], [0, fy / t[2], -fy * ty / t[2] ** 2]])
    raw = jacobian * view * v * view.T * jacobian.T
    cov = raw + mpmath.eye(2) * mpf("0.3")
    return SimpleNamespace(
        x=fx * t[0] / t[2] + mpf(float(camera.cx)),
        y=fy * t[1] / t[2] + mpf(float(camera.cy)),
        z=t[2],
        cov=cov,
        det=cov[0, 0] * cov[1, 1] - cov[0, 1] ** 2,
        raw=raw[0, 0] * raw[1, 1] - raw[0, 1] ** 2,
    )


@mp.workdps(DIGITS)
def relative(value: float, truth, scale=None) -> float:
    """|value - truth| over |truth| or over scale."""
    return float(abs(mpf(float(value)) - truth) / (abs(truth) if scale is None else scale))


@mp.workdps(DIGITS)
def worst(p, scene: Gaussians, camera: Camera) -> float:
    """Largest relative error of the means, depths, covariances and determinants of all visible rows of a Projection."""
    errors = [0.0]
    for i in np.flatnonzero(p.visible):
        r = project(scene, int(i), camera)
        across = mpmath.sqrt(r.cov[0, 0] * r.cov[1, 1])
        errors += [
            relative(p.mean2d[i, 0], r.x, 1 + abs(r.x)),
            relative(p.mean2d[i, 1], r.y, 1 + abs(r.y)),
            relative(p.depth[i], r.z),
            relative(p.cov2d[i, 0], r.cov[0, 0]),
            relative(p.cov2d[i, 1], r.cov[0, 1], across),
            relative(p.cov2d[i, 2], r.cov[1, 1]),
            relative(p.det[i], r.det),
        ]
    return max(errors)


@mp.workdps(DIGITS)
def alpha(scene: Gaussians, i: int, camera: Camera) -> np.ndarray:
    """[H, W] float64: min(0.99, o exp(-q / 2)) of Gaussian i at every pixel, before the cut."""
    r = project(scene, i, camera)
    xx, xy, yy = r.cov[1, 1] / r.det, -r.cov[0, 1] / r.det, r.cov[0, 0] / r.det
    out = np.zeros((camera.height, camera.width))
    for row in range(camera.height):
        dy = row + mpf("0.5") - r.y
        for column in range(camera.width):
            dx = column + mpf("0.5") - r.x
            q = xx * dx * dx + 2 * xy * dx * dy + yy * dy * dy
            if q < 60:
                out[row, column] = min(0.99, float(mpf(float(scene.opacities[i])) * mpmath.exp(-q / 2)))
    return out
