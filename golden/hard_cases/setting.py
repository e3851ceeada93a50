"""What the recipes share: their camera, Gaussians as they write them, and screen ellipses given as such."""

from __future__ import annotations

import numpy as np

from golden.cameras.camera import Camera
from golden.preprocess import Projection
from golden.scene.gaussians import SH_C0, Gaussians

LSB = 1 / 255
DIAGONAL = (0.9238795, 0, 0, 0.3826834)  # 45 degrees about z


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

    sh = ((rows(colours, 3) - 0.5) / SH_C0).astype(np.float32)[:, None, :]
    alpha = np.ascontiguousarray(np.broadcast_to(np.asarray(opacities, np.float64), (n,)))
    return Gaussians("case", means, rows(scales, 3), rows(quats, 4), alpha, sh, antialias, {}, "case")


def merge(*parts: Gaussians) -> Gaussians:
    """All rows of the parts, in order."""
    columns = [
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("means", "scales", "quats", "opacities", "sh")
    ]
    return Gaussians("case", *columns, parts[0].antialias, {}, "case")


def crowd(seed: int, n: int, opaque: float = 1.0) -> Gaussians:
    """n random Gaussians in CAM-A's view and around it, opacities up to `opaque`."""
    rng = np.random.default_rng(seed)
    means = rng.uniform(-2, 2, (n, 3)) + (0, 0, 4)
    return gaussians(
        means,
        scales=rng.uniform(0.01, 0.2, (n, 3)),
        opacities=rng.uniform(0.02, opaque, n),
        colours=rng.random((n, 3)),
    )


def layers(n: int, opacity: float, colours=1.0) -> Gaussians:
    """n Gaussians so wide that each has the same alpha everywhere, front to back."""
    depth = 0.25 + np.arange(n) * 1e-4
    colours = np.asarray(colours, np.float64)
    colours = np.repeat(colours[:, None], 3, 1) if colours.ndim else colours
    return gaussians(np.stack([0 * depth, 0 * depth, depth], 1), scales=500.0, opacities=opacity, colours=colours)


def ellipses(mean2d, cov2d, opacity=1.0, colour=1.0, depth=None) -> Projection:
    """Screen ellipses as the projection would give them: mean2d [N, 2] pixels, cov2d (xx, xy, yy) px^2, all seen.

    depth: 1, 2, ... where not given, so that row 0 is the nearest.
    """
    mean2d = np.atleast_2d(np.asarray(mean2d, np.float64))
    n = len(mean2d)
    cov = np.array(np.broadcast_to(np.asarray(cov2d, np.float64), (n, 3)))
    det = cov[:, 0] * cov[:, 2] - cov[:, 1] ** 2
    depth = 1.0 + np.arange(n) if depth is None else np.array(np.broadcast_to(np.asarray(depth, np.float64), (n,)))
    opacity = np.array(np.broadcast_to(np.asarray(opacity, np.float64), (n,)))
    colour = np.array(np.broadcast_to(np.asarray(colour, np.float64), (n, 3)))
    return Projection(mean2d, cov, det, depth, opacity, colour, np.ones(n, bool))
