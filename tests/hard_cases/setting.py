"""What every case shares: the camera of the recipes, and Gaussians written as in the recipes."""

from __future__ import annotations

import numpy as np

from golden.cameras.camera import Camera
from golden.frame import Frame, Renderer
from golden.scene.gaussians import Gaussians
from golden.settings import Settings

SH0 = 0.28209479177387814


def camera_a(
    width: int = 128, height: int = 128, focal: float = 128.0, rotation=None, position=(0.0, 0.0, 0.0)
) -> Camera:
    """CAM-A: at the origin, looking down +z, principal point (64, 64)."""
    rotation = np.eye(3) if rotation is None else rotation
    return Camera(width, height, focal, focal, 64.0, 64.0, rotation, np.array(position, np.float64))


def yaw(degrees: float) -> np.ndarray:
    """World-to-camera rotation about y."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])


def gaussians(means, scales=0.1, opacities=0.9, colours=1.0, quats=(1.0, 0, 0, 0), antialias=False) -> Gaussians:
    """One row per mean; every other field is broadcast. Colours as they come out (DC of the harmonics)."""
    means = np.atleast_2d(np.asarray(means, np.float64))
    n = means.shape[0]

    def rows(value, width):
        value = np.asarray(value, np.float64)
        if value.ndim == 1 and value.size == n and width != n:
            value = value[:, None]
        return np.ascontiguousarray(np.broadcast_to(value, (n, width)))

    sh = ((rows(colours, 3) - 0.5) / SH0).astype(np.float32)[:, None, :]
    alpha = np.ascontiguousarray(np.broadcast_to(np.asarray(opacities, np.float64), (n,)))
    return Gaussians("case", means, rows(scales, 3), rows(quats, 4), alpha, sh, antialias, {}, "case")


def merge(*parts: Gaussians) -> Gaussians:
    """All rows of the parts, in order."""
    columns = [
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("means", "scales", "quats", "opacities", "sh")
    ]
    return Gaussians("case", *columns, parts[0].antialias, {}, "case")


def render(scene: Gaussians, camera: Camera, background: str = "0,0,0", **keys) -> Frame:
    """The first frame of a scene."""
    return Renderer(scene, Settings(background=background, **keys)).frame(camera)
