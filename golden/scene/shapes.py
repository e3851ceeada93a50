"""Painted patches that the built-in scenes are made of, and how a patch becomes Gaussians like trained ones.

World of every built-in scene: metres, x right, y DOWN, z forward, ground at y = 0; so up is (0, -1, 0).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from golden.scene.gaussians import SH_C0

SURFACE, NEEDLE, FLOATER, PANE, SHELL, LEAF = range(6)
LIGHT = np.array([0.45, -0.8, -0.4])
SH_SPREAD = (0.09, 0.06, 0.04)  # standard deviation of a coefficient of bands 1 to 3
THICKNESS = 0.02  # a disk's thickness is at most this part of its patch's side, however few disks there are
NO_AREA = 1e-12

Rng = np.random.Generator
Paint = Callable[[np.ndarray, np.ndarray], np.ndarray]  # points [n, 3], place on the patch [n, 2] in metres -> [n, 3]
Sample = Callable[[Rng, int], tuple[np.ndarray, np.ndarray, np.ndarray]]  # -> points, normals, rgb, each [n, 3]


@dataclass(frozen=True)
class Patch:
    area: float  # square metres: sets the share of the Gaussians and their size
    sample: Sample
    detail: float = 1.0  # Gaussians a square metre, relative
    kind: int = SURFACE


# ---- paint


def ripple(points: np.ndarray) -> np.ndarray:
    """[n, 1] brightness from 0.85 to 1.15 that varies smoothly over space."""
    x, y, z = points.T
    wave = np.sin(2.1 * x + 1.3 * z) + np.sin(5.3 * y - 3.7 * x + 1) + np.sin(9.1 * z + 7.7 * y) * 0.7
    return 1 + wave[:, None] / 18


def flat(*rgb: float) -> Paint:
    return lambda points, uv: np.array(rgb) * ripple(points)


def planks(first: tuple, second: tuple, width: float, length: float = 1.2) -> Paint:
    def paint(points: np.ndarray, uv: np.ndarray) -> np.ndarray:
        row = np.floor(uv[:, 0] / width)
        column = np.floor(uv[:, 1] / length + 0.37 * row)
        t = np.modf(np.abs(np.sin(row * 12.9898 + column * 78.233)) * 437.58)[0][:, None]
        seam = (np.abs(uv[:, 0] / width - row - 0.5) > 0.47)[:, None]
        return (np.array(first) * (1 - t) + np.array(second) * t) * ripple(points) * np.where(seam, 0.45, 1)

    return paint


def checker(first: tuple, second: tuple, size: float) -> Paint:
    def paint(points: np.ndarray, uv: np.ndarray) -> np.ndarray:
        odd = (np.floor(uv / size).sum(axis=1) % 2 == 1)[:, None]
        return np.where(odd, np.array(first), np.array(second)) * ripple(points)

    return paint


def facade(wall: tuple, glass: tuple, bay: float = 2.2, storey: float = 3.0) -> Paint:
    def paint(points: np.ndarray, uv: np.ndarray) -> np.ndarray:
        u, v = np.modf(np.abs(uv[:, 0]) / bay)[0], np.modf(np.abs(uv[:, 1]) / storey)[0]
        window = ((np.abs(u - 0.5) < 0.24) & (np.abs(v - 0.5) < 0.28))[:, None]
        frame = ((np.abs(u - 0.5) < 0.29) & (np.abs(v - 0.5) < 0.33))[:, None] & ~window
        course = (np.modf(np.abs(uv[:, 1]) / 0.3)[0] < 0.12)[:, None]
        base = np.array(wall) * ripple(points) * np.where(course, 0.85, 1)
        return np.where(window, np.array(glass) * ripple(points * 3), np.where(frame, 0.92, base))

    return paint


def sky(points: np.ndarray, uv: np.ndarray) -> np.ndarray:
    up = np.clip(-points[:, 1] / (np.linalg.norm(points, axis=1) + NO_AREA), 0, 1)[:, None]
    x, y, z = (points / (np.linalg.norm(points, axis=1, keepdims=True) + NO_AREA)).T
    cloud = np.clip(np.sin(7 * x + 3 * z) + np.sin(11 * z - 5 * x + 9 * y) - 0.6, 0, 1)[:, None]
    blue = np.array([0.78, 0.86, 0.93]) * (1 - up) + np.array([0.25, 0.45, 0.80]) * up
    return blue + 0.5 * cloud * (0.95 - blue)


# ---- patches


def rect(origin: tuple, u: tuple, v: tuple, paint: Paint, detail: float = 1.0, kind: int = SURFACE) -> Patch:
    """Parallelogram at `origin` along u and v (metres); its normal is u x v."""
    o, u, v = (np.array(a, np.float64) for a in (origin, u, v))
    normal = np.cross(u, v)
    area = float(np.linalg.norm(normal)) + NO_AREA
    size = np.array([np.linalg.norm(u), np.linalg.norm(v)])

    def sample(rng: Rng, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        st = even(rng, n)
        points = o + st[:, :1] * u + st[:, 1:] * v
        return points, np.broadcast_to(normal / area, (n, 3)), paint(points, st * size)

    return Patch(area, sample, detail, kind)


def box(centre: tuple, size: tuple, paint: Paint, detail: float = 1.0, turn: float = 0.0) -> list[Patch]:
    """Six faces of a box, turned about the vertical axis by `turn` radians."""
    c, s = np.cos(turn), np.sin(turn)
    axes = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) * np.array(size)[:, None]
    middle = np.array(centre, np.float64)
    faces = []
    for k in range(3):
        a, b = axes[(k + 1) % 3], axes[(k + 2) % 3]
        if k != 0:  # so that the second direction of an upright face is the vertical one
            a, b = (b, a) if k == 2 else (a, b)
        for side in (-0.5, 0.5):
            corner = middle + side * axes[k] - 0.5 * a - 0.5 * b
            first, second = (a, b) if k != 0 else (b, a)
            faces.append(rect(tuple(corner), tuple(first), tuple(second), paint, detail))
    return faces


def ball(centre: tuple, radii: tuple, paint: Paint, detail: float = 1.0, kind: int = SURFACE) -> Patch:
    """Ellipsoid surface."""
    o, r = np.array(centre, np.float64), np.array(radii, np.float64)
    area = 4 * np.pi * float(np.mean([r[0] * r[1], r[1] * r[2], r[0] * r[2]])) + NO_AREA

    def sample(rng: Rng, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        phi, height = (even(rng, n) * [2 * np.pi, 2] - [0, 1]).T
        ring = np.sqrt(1 - height**2)
        unit = np.stack([ring * np.sin(phi), height, ring * np.cos(phi)], axis=1)
        normal = unit / r
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        points = o + unit * r
        around = np.stack([np.arctan2(unit[:, 0], unit[:, 2]) * r[0], unit[:, 1] * r[1]], axis=1)
        return points, normal, paint(points, around)

    return Patch(area, sample, detail, kind)


def tube(start: tuple, end: tuple, radius: float, paint: Paint, detail: float = 1.0, kind: int = SURFACE) -> Patch:
    """Cylinder surface from start to end; a NEEDLE tube is filled with needles along it."""
    a, b = np.array(start, np.float64), np.array(end, np.float64)
    length = float(np.linalg.norm(b - a)) + NO_AREA
    axis = (b - a) / length
    side = np.cross(axis, [1.0, 0, 0] if abs(axis[0]) < 0.9 else [0, 1.0, 0])
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)

    def sample(rng: Rng, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        t, phi = np.hsplit(even(rng, n) * [1, 2 * np.pi], 2)
        out = np.cos(phi) * side + np.sin(phi) * other
        points = a + t * (b - a) + radius * out
        uv = np.concatenate([phi * radius, t * length], axis=1)
        return points, np.broadcast_to(axis, (n, 3)) if kind == NEEDLE else out, paint(points, uv)

    return Patch(2 * np.pi * radius * length, sample, detail, kind)


def cloud(centre: tuple, radii: tuple, rgb: tuple, area: float, kind: int, spread: float = 0.12) -> Patch:
    """A filled ellipsoid of leaves, floaters or smoke, denser towards its rim; `area` sets the share of Gaussians."""
    o, r = np.array(centre, np.float64), np.array(radii, np.float64)

    def sample(rng: Rng, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        unit = directions(rng, n)
        depth = rng.random((n, 1)) ** (1 / 5)
        normal = directions(rng, n) + 0.7 * unit
        normal /= np.linalg.norm(normal, axis=1, keepdims=True) + NO_AREA
        colour = np.array(rgb) * (0.55 + 0.45 * depth**4) * np.exp(spread * rng.standard_normal((n, 1)))
        return o + unit * r * depth, normal, colour

    return Patch(area, sample, 1.0, kind)


def dome(radius: float, paint: Paint, share: float) -> Patch:
    """Far background around the origin: a sphere shell from 15 degrees below the horizon up."""

    def sample(rng: Rng, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        height, phi = (even(rng, n) * [1, 2 * np.pi]).T
        height = 0.26 - 1.26 * height**1.3
        flatness = np.sqrt(np.maximum(0, 1 - height**2))
        unit = np.stack([flatness * np.sin(phi), height, flatness * np.cos(phi)], axis=1)
        points = unit * radius * np.exp(0.1 * rng.standard_normal((n, 1)))
        return points, -unit, paint(points, points[:, :2])

    return Patch(7.9 * radius**2, sample, share / (7.9 * radius**2), SHELL)


def even(rng: Rng, n: int) -> np.ndarray:
    """[n, 2] points of the unit square, evenly spread as training spreads them: the R2 sequence, shifted by chance."""
    golden = 1.32471795724474602596  # the real root of x^3 = x + 1
    return np.modf(rng.random(2) + np.arange(n)[:, None] / np.array([golden, golden**2]))[0]


def directions(rng: Rng, n: int) -> np.ndarray:
    """[n, 3] unit vectors, uniform over the sphere."""
    raw = rng.standard_normal((n, 3)) + NO_AREA
    return raw / np.linalg.norm(raw, axis=1, keepdims=True)


# ---- Gaussians


def gaussians_of(rng: Rng, patches: list[Patch], n: int, degree: int) -> tuple[np.ndarray, ...]:
    """means, scales, quats, opacities, sh of exactly n Gaussians over the patches, in random order."""
    weights = np.array([p.area * p.detail for p in patches])
    edges = np.rint(np.concatenate([[0], np.cumsum(weights)]) / weights.sum() * n).astype(np.int64)
    counts = np.diff(edges)
    sampled = [p.sample(rng, int(c)) for p, c in zip(patches, counts)]
    order = rng.permutation(n)
    points, normals, colours = (np.concatenate([s[k] for s in sampled])[order] for k in range(3))
    kind = np.repeat([p.kind for p in patches], counts)[order]
    pitches = [np.sqrt(p.area / max(c, 1)) for p, c in zip(patches, counts)]
    for k, p in enumerate(patches):
        if p.kind == FLOATER:  # few of them must not become a fog
            pitches[k] = min(pitches[k], 0.06 * np.sqrt(p.area))
    pitch, reach = (np.repeat(v, counts)[order] for v in (pitches, [np.sqrt(p.area) for p in patches]))
    quats = aligned(rng, normals)
    scales = axis_scales(rng, kind, pitch)
    scales[:, 2] = np.where(kind == SURFACE, np.minimum(scales[:, 2], THICKNESS * reach), scales[:, 2])
    lift = np.where(kind == SURFACE, 0.15 * scales[:, 2] * rng.standard_normal(n), 0)[:, None]
    lit = np.isin(kind, (SURFACE, LEAF))
    shade = np.where(lit, 0.72 + 0.28 * np.abs(normals @ (LIGHT / np.linalg.norm(LIGHT))), 1.0)[:, None]
    colours = colours * shade * np.exp(0.05 * rng.standard_normal((n, 1)))
    return points + lift * normals, scales, quats, opacities(rng, kind), harmonics(rng, colours, degree)


def aligned(rng: Rng, normals: np.ndarray) -> np.ndarray:
    """[n, 4] quaternions w x y z that turn the local z axis onto the normal, with a random roll and, as training
    leaves them, a norm that is not one."""
    x, y, z = normals.T
    w = 1 + z
    back = w < 1e-9
    w, ax, ay = np.where(back, 0, w), np.where(back, 1, -y), np.where(back, 0, x)
    norm = np.sqrt(w * w + ax * ax + ay * ay) / np.exp(0.3 * rng.standard_normal(len(w)))
    half = rng.random(len(w)) * np.pi
    c, s = np.cos(half) / norm, np.sin(half) / norm
    return np.stack([w * c, ax * c + ay * s, ay * c - ax * s, w * s], axis=1)


def axis_scales(rng: Rng, kind: np.ndarray, pitch: np.ndarray) -> np.ndarray:
    """[n, 3] standard deviations: log-normal, flat along local z, needles long along it.

    `pitch` is the distance between neighbours. Disks have a median aspect (longest to shortest) near 5.
    """
    n = len(kind)
    size = pitch * np.exp(0.5 * rng.standard_normal(n)) * np.array([0.85, 0.5, 1.6, 0.9, 0.8, 0.6])[kind]
    inplane = np.exp(-0.65 * np.abs(rng.standard_normal(n)))
    thin = np.exp(-np.maximum(0.05, 1.2 + 0.8 * rng.standard_normal(n)))
    long = np.exp(2.2 + 0.7 * rng.standard_normal(n))
    scales = np.stack([size, size * inplane, size * inplane * thin], axis=1)
    needle = kind == NEEDLE
    scales[needle] = np.stack([size, size * inplane, size * long], axis=1)[needle] * 0.5
    round_ = kind == FLOATER
    scales[round_, 2] = (size * np.sqrt(inplane))[round_]
    return scales


def opacities(rng: Rng, kind: np.ndarray) -> np.ndarray:
    """[n] mixture: about half nearly opaque, a third in between, the rest near 0.1; panes and floaters are faint."""
    n = len(kind)
    pick = rng.random(n)
    solid = rng.beta(7, 1, n)
    middle = rng.beta(1.6, 1.6, n)
    faint = rng.beta(1.4, 12, n)
    out = np.where(pick < 0.5, solid, np.where(pick < 0.82, middle, faint))
    out = np.where(kind == PANE, 0.6 * rng.beta(2, 10, n), out)
    return np.where(kind == FLOATER, 0.7 * rng.beta(1.5, 12, n), out)


def harmonics(rng: Rng, colours: np.ndarray, degree: int) -> np.ndarray:
    """[n, K, 3] float32: the colour as the constant term; higher bands small, mostly grey, a few glossy Gaussians."""
    n = len(colours)
    sh = rng.standard_normal((n, (degree + 1) ** 2, 3), np.float32)
    bands = np.concatenate([np.full(3 * (2 * b + 1), s) for b, s in enumerate((0.0, *SH_SPREAD[:degree]))])
    gloss = np.exp(0.7 * rng.standard_normal((n, 1), np.float32))
    rows = sh.reshape(n, -1)
    rows *= gloss
    rows *= bands.astype(np.float32)
    for channel in (1, 2):
        sh[:, :, channel] *= 0.5
        sh[:, :, channel] += 0.85 * sh[:, :, 0]
    sh[:, 0] = (colours - 0.5) / SH_C0
    return sh
