"""A pinhole camera: x right, y down, z forward; pixel (i, j) has its centre at (i + 0.5, j + 0.5)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from golden.errors import InputError

NEAR = 0.2  # Gaussians with z <= near are culled


@dataclass(frozen=True)
class Camera:
    width: int  # pixels
    height: int
    fx: float  # focal lengths and principal point, pixels
    fy: float
    cx: float
    cy: float
    rotation: np.ndarray  # float64 [3, 3] rows: the camera's right, down and forward in the world
    position: np.ndarray  # float64 [3] world units
    near: float = NEAR

    @property
    def tan_x(self) -> float:
        """Tangent of half the horizontal field of view."""
        return self.width / (2 * self.fx)

    @property
    def tan_y(self) -> float:
        return self.height / (2 * self.fy)


def focal(fovy_deg: float, height: int) -> float:
    """Focal length in pixels of a vertical field of view in degrees."""
    return height / (2 * np.tan(np.radians(fovy_deg) / 2))


def look_at(eye: object, at: object, up: object, fovy_deg: float, width: int, height: int) -> Camera:
    """Camera at `eye` that sees `at` in the centre, with `up` towards the top edge; square pixels."""
    eye, at, up = (np.array(v, np.float64) for v in (eye, at, up))
    forward = unit(at - eye, f"camera: eye and look-at are both {triple(eye)}, they must differ")
    beside = f"camera: up {triple(up)} is parallel to the view {triple(at - eye)}, another direction is needed"
    if not 0 < fovy_deg < 180:
        raise InputError(f"camera: field of view {fovy_deg:g} degrees, more than 0 and less than 180 is needed")
    right = unit(np.cross(forward, unit(up, beside)), beside, 1e-9)
    f = focal(fovy_deg, height)
    rotation = np.stack([right, np.cross(forward, right), forward])
    return Camera(width, height, f, f, width / 2, height / 2, rotation, eye)


def extrapolate(before: Camera, now: Camera) -> Camera:
    """The camera of the next frame if it goes on as from `before` to `now`: the same shift, the same turn again."""
    turn = now.rotation @ before.rotation.T
    return replace(now, rotation=turn @ now.rotation, position=2 * now.position - before.position)


def unit(v: np.ndarray, problem: str, least: float = 0.0) -> np.ndarray:
    """v / |v|; an InputError with this text where it has no direction."""
    largest = np.abs(v).max()
    if not np.isfinite(largest) or largest <= least:
        raise InputError(problem)
    scaled = v / largest
    return scaled / np.linalg.norm(scaled)


def triple(v: np.ndarray) -> str:
    return ",".join(f"{x:g}" for x in v)


# ---- rotations: [..., 4] quaternions w x y z, [..., 3, 3] matrices


def matrices(quats: np.ndarray) -> np.ndarray:
    """Rotation matrices of unit quaternions."""
    w, x, y, z = np.moveaxis(np.asarray(quats, np.float64), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion(m: np.ndarray) -> np.ndarray:
    """[4] unit quaternion of one rotation matrix: the largest of four equal formulas, so nothing cancels."""
    t = np.array([m[0, 0] + m[1, 1] + m[2, 2], *(2 * m[k, k] - np.trace(m) for k in range(3))])
    k = int(np.argmax(t))
    q = np.empty(4)
    q[k] = 1 + t[k]
    if k == 0:
        q[1:] = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    else:
        a, b, c = k - 1, k % 3, (k + 1) % 3  # a the axis of the largest part, then cyclic
        q[0] = m[c, b] - m[b, c]
        q[1 + b] = m[b, a] + m[a, b]
        q[1 + c] = m[c, a] + m[a, c]
    return q / np.linalg.norm(q)


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    """[3, 3] rotation by `angle` radians about a unit axis, right-handed."""
    q = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * np.asarray(axis))])
    return matrices(q)


def slerp(a: np.ndarray, b: np.ndarray, t: float) -> np.ndarray:
    """[4] unit quaternion from a (t = 0) to b (t = 1) at constant speed, the short way."""
    dot = float(a @ b)
    if dot < 0:
        b, dot = -b, -dot
    if dot > 1 - 1e-12:
        q = a + t * (b - a)
    else:
        angle = np.arccos(dot)
        q = (np.sin((1 - t) * angle) * a + np.sin(t * angle) * b) / np.sin(angle)
    return q / np.linalg.norm(q)
