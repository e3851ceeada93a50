"""Projection and culling in float64 (docs/preprocess.md).

A Gaussian with covariance V = (R S)(R S)^T seen by the camera W becomes the ellipse J W V W^T J^T + 0.3 I on the screen
(EWA splatting, Zwicker et al. 2002), with J the Jacobian of the perspective division at the mean. Its determinant is
the sum of the squared 2x2 minors of J W R S, plus 0.3 * trace, plus 0.09: only positive terms, so nothing cancels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numba
import numpy as np

from golden.preprocess.colour import DEGREE_MAX, colours, plain

if TYPE_CHECKING:
    from golden.cameras.camera import Camera
    from golden.scene.gaussians import Gaussians

LOW_PASS = 0.3  # px^2 on both diagonal terms
EWA_LIMIT = 1.3  # x/z and y/z inside the Jacobian stay below this multiple of tan(fov / 2)
# A pixel below is skipped. Scene files hold the logit of the opacity as float32, half a step of which is up to 2^-22 of
# an opacity of 1/255: one that was stored as 1/255 is meant to be kept.
ALPHA_CUT = (1 - 2.0**-22) / 255

_VISIBLE, _NEAR, _NONFINITE, _ALPHA, _OFFSCREEN = range(5)


@dataclass(frozen=True)
class Projection:
    """The Gaussians on the screen. Where `visible` is False only `depth` means something; the rest is zero."""

    mean2d: np.ndarray  # [N, 2] float64, pixels; the centre of pixel (0, 0) is (0.5, 0.5)
    cov2d: np.ndarray  # [N, 3] float64 xx, xy, yy, px^2, low-pass included
    det: np.ndarray  # [N] float64, determinant of cov2d, px^4
    depth: np.ndarray  # [N] float64, camera z
    opacity: np.ndarray  # [N] float64, compensated where asked for
    colour: np.ndarray  # [N, 3] float64 >= 0, see colour.py
    visible: np.ndarray  # [N] bool
    counters: dict[str, int] = field(default_factory=dict)  # culled_near, _nonfinite, _alpha, _offscreen, visible


def project(
    gaussians: Gaussians, camera: Camera, antialias: bool | None = None, degree: int = DEGREE_MAX
) -> Projection:
    """Project, cull and colour every Gaussian.

    antialias: scale the opacity by sqrt(det before / det behind the low-pass); None takes the scene's own mode.
    degree: of the harmonics, where the scene has more.
    Culled, in this order: z <= near; a covariance that is not finite; opacity below 1/255 (equal is kept); a box of
    sqrt(2 ln(255 opacity)) sigmas that misses the picture.
    """
    n = len(gaussians.means)
    mean2d, cov2d = np.zeros((n, 2)), np.zeros((n, 3))
    det, depth, opacity = np.zeros(n), np.zeros(n), np.zeros(n)
    status = np.zeros(n, np.uint8)
    _project(
        plain(gaussians.means),
        plain(gaussians.scales),
        plain(gaussians.quats),
        plain(gaussians.opacities),
        bool(gaussians.antialias if antialias is None else antialias),
        plain(camera.rotation),
        plain(camera.position),
        (float(camera.fx), float(camera.fy), float(camera.cx), float(camera.cy), float(camera.near)),
        (float(camera.width), float(camera.height)),
        mean2d,
        cov2d,
        det,
        depth,
        opacity,
        status,
    )
    count = np.bincount(status, minlength=5)
    counters = {
        "visible": int(count[_VISIBLE]),
        "culled_near": int(count[_NEAR]),
        "culled_nonfinite": int(count[_NONFINITE]),
        "culled_alpha": int(count[_ALPHA]),
        "culled_offscreen": int(count[_OFFSCREEN]),
    }
    visible = status == _VISIBLE
    colour = colours(gaussians, camera, visible, degree)
    return Projection(mean2d, cov2d, det, depth, opacity, colour, visible, counters)


def depths(gaussians: Gaussians, camera: Camera) -> np.ndarray:
    """[N] float64 camera z of every Gaussian, bit for bit as in `project`."""
    out = np.empty(len(gaussians.means))
    _depths(plain(gaussians.means), plain(camera.rotation), plain(camera.position), out)
    return out


@numba.njit(inline="always", cache=True)
def _row(rotation, k, x, y, z):
    """Row k of the rotation times (x, y, z)."""
    return rotation[k, 0] * x + rotation[k, 1] * y + rotation[k, 2] * z


@numba.njit(parallel=True, cache=True, error_model="numpy")
def _depths(means, rotation, position, out):
    for i in numba.prange(means.shape[0]):
        out[i] = _row(rotation, 2, means[i, 0] - position[0], means[i, 1] - position[1], means[i, 2] - position[2])


@numba.njit(cache=True, error_model="numpy")
def _axes(q0, q1, q2, q3):
    """Rotation matrix of a quaternion (w, x, y, z) of any length, row by row. Zero gives NaN."""
    largest = max(max(abs(q0), abs(q1)), max(abs(q2), abs(q3)))
    w, x, y, z = q0 / largest, q1 / largest, q2 / largest, q3 / largest  # so that no square leaves the range
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / norm, x / norm, y / norm, z / norm
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


@numba.njit(cache=True, error_model="numpy")
def _footprint(jw0, jw1, scale0, scale1, scale2, axes):
    """(xx, xy, yy, sum of squared minors) of M = J W R S. jw0, jw1: the rows of J W."""
    r0, r1, r2 = axes
    m00 = (jw0[0] * r0[0] + jw0[1] * r1[0] + jw0[2] * r2[0]) * scale0
    m01 = (jw0[0] * r0[1] + jw0[1] * r1[1] + jw0[2] * r2[1]) * scale1
    m02 = (jw0[0] * r0[2] + jw0[1] * r1[2] + jw0[2] * r2[2]) * scale2
    m10 = (jw1[0] * r0[0] + jw1[1] * r1[0] + jw1[2] * r2[0]) * scale0
    m11 = (jw1[0] * r0[1] + jw1[1] * r1[1] + jw1[2] * r2[1]) * scale1
    m12 = (jw1[0] * r0[2] + jw1[1] * r1[2] + jw1[2] * r2[2]) * scale2
    minor01 = m00 * m11 - m01 * m10
    minor02 = m00 * m12 - m02 * m10
    minor12 = m01 * m12 - m02 * m11
    return (
        m00 * m00 + m01 * m01 + m02 * m02,
        m00 * m10 + m01 * m11 + m02 * m12,
        m10 * m10 + m11 * m11 + m12 * m12,
        minor01 * minor01 + minor02 * minor02 + minor12 * minor12,
    )


@numba.njit(parallel=True, cache=True, error_model="numpy")
def _project(
    means,
    scales,
    quats,
    opacities,
    antialias,
    rotation,
    position,
    lens,
    size,
    mean2d,
    cov2d,
    det,
    depth,
    opacity,
    status,
):
    fx, fy, cx, cy, near = lens
    width, height = size
    limit_x = EWA_LIMIT * 0.5 * width / fx
    limit_y = EWA_LIMIT * 0.5 * height / fy
    for i in numba.prange(means.shape[0]):
        px, py, pz = means[i, 0] - position[0], means[i, 1] - position[1], means[i, 2] - position[2]
        z = _row(rotation, 2, px, py, pz)
        depth[i] = z
        if z <= near:
            status[i] = _NEAR
            continue
        tx = _row(rotation, 0, px, py, pz) / z
        ty = _row(rotation, 1, px, py, pz) / z
        # J W: the clamp is for the Jacobian only, the mean keeps its place
        lx = min(max(tx, -limit_x), limit_x)
        ly = min(max(ty, -limit_y), limit_y)
        sx, sy = fx / z, fy / z
        jw0 = (
            sx * (rotation[0, 0] - lx * rotation[2, 0]),
            sx * (rotation[0, 1] - lx * rotation[2, 1]),
            sx * (rotation[0, 2] - lx * rotation[2, 2]),
        )
        jw1 = (
            sy * (rotation[1, 0] - ly * rotation[2, 0]),
            sy * (rotation[1, 1] - ly * rotation[2, 1]),
            sy * (rotation[1, 2] - ly * rotation[2, 2]),
        )
        axes = _axes(quats[i, 0], quats[i, 1], quats[i, 2], quats[i, 3])
        xx, xy, yy, minors = _footprint(jw0, jw1, scales[i, 0], scales[i, 1], scales[i, 2], axes)
        whole = minors + LOW_PASS * (xx + yy) + LOW_PASS * LOW_PASS
        x, y = fx * tx + cx, fy * ty + cy
        if not math.isfinite(whole + x + y):
            status[i] = _NONFINITE
            continue
        o = opacities[i]
        if antialias:
            o *= math.sqrt(minors / whole)
        if not o >= ALPHA_CUT:
            status[i] = _ALPHA
            continue
        xx += LOW_PASS
        yy += LOW_PASS
        reach = 2 * math.log(o / ALPHA_CUT)
        half_x, half_y = math.sqrt(reach * xx), math.sqrt(reach * yy)
        if x + half_x < 0 or x - half_x > width or y + half_y < 0 or y - half_y > height:
            status[i] = _OFFSCREEN
            continue
        mean2d[i, 0], mean2d[i, 1] = x, y
        cov2d[i, 0], cov2d[i, 1], cov2d[i, 2] = xx, xy, yy
        det[i] = whole
        opacity[i] = o
