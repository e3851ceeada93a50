"""Built-in scenes `builtin:NAME?n=..&seed=..&sh=..`: made by rule, yet with the habits of trained ones.

Surfaces of flat disks, needles along edges and wires, leaves, floaters, faint panes, a far shell; log-normal sizes, a
median aspect near 5 with a tail beyond 100, opacities from nearly opaque to about 0.1, unnormalised quaternions.
The same n, seed and sh give the same bits (NumPy's PCG64). World: metres, y down, ground at y = 0.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np

from golden.errors import InputError
from golden.scene.files import one_line
from golden.scene.gaussians import Gaussians, checked
from golden.scene.shapes import (
    FLOATER,
    LEAF,
    NEEDLE,
    PANE,
    Patch,
    Rng,
    ball,
    box,
    checker,
    cloud,
    dome,
    facade,
    flat,
    gaussians_of,
    planks,
    rect,
    sky,
    tube,
)

N_MAX = 2_000_000
DEFAULT = "room"
View = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float], float]
UP = (0.0, -1.0, 0.0)


def room(rng: Rng) -> list[Patch]:
    """A furnished room of 6 x 5 x 2.7 m with a window."""
    wall = flat(0.80, 0.76, 0.68)
    parts = [
        rect((-3, 0, -2.5), (6, 0, 0), (0, 0, 5), planks((0.50, 0.32, 0.18), (0.66, 0.45, 0.27), 0.14)),
        rect((-3, -2.7, -2.5), (6, 0, 0), (0, 0, 5), flat(0.88, 0.88, 0.86), 0.6),
        rect((-3, 0, 2.5), (1.2, 0, 0), (0, -2.7, 0), wall),
        rect((0.6, 0, 2.5), (2.4, 0, 0), (0, -2.7, 0), wall),
        rect((-1.8, 0, 2.5), (2.4, 0, 0), (0, -0.9, 0), wall),
        rect((-1.8, -2.3, 2.5), (2.4, 0, 0), (0, -0.4, 0), wall),
        rect((-3, 0, -2.5), (0, 0, 5), (0, -2.7, 0), facade((0.70, 0.62, 0.52), (0.66, 0.58, 0.48), 0.4, 0.9)),
        rect((3, 0, -2.5), (0, 0, 5), (0, -2.7, 0), wall),
        rect((-3, 0, -2.5), (6, 0, 0), (0, -2.7, 0), wall, 0.6),
        rect((-1.8, -0.9, 2.5), (2.4, 0, 0), (0, -1.4, 0), flat(0.85, 0.92, 0.95), 0.5, PANE),
        rect((-6, 0.5, 6), (12, 0, 0), (0, -4, 0), sky, 0.1),
        rect((-1.5, -0.01, -1.2), (2.8, 0, 0), (0, 0, 2), checker((0.62, 0.16, 0.14), (0.85, 0.74, 0.55), 0.25), 3),
        *box((-0.1, -0.72, -0.2), (1.5, 0.05, 0.8), planks((0.36, 0.2, 0.1), (0.42, 0.26, 0.14), 0.1), 3),
        *box((2.45, -0.25, 0.2), (0.9, 0.5, 2.0), flat(0.20, 0.32, 0.46), 2),
        *box((2.85, -0.6, 0.2), (0.25, 1.0, 2.0), flat(0.18, 0.29, 0.42), 2),
        rect((2.98, -2.1, -0.6), (0, 0, 1.4), (0, 0.9, 0), checker((0.9, 0.75, 0.2), (0.15, 0.3, 0.55), 0.175), 4),
        ball((-0.3, -0.86, -0.2), (0.12, 0.12, 0.12), flat(0.85, 0.35, 0.1), 8),
        ball((0.3, -0.83, -0.1), (0.09, 0.09, 0.09), flat(0.3, 0.62, 0.2), 8),
        ball((0, -2.05, 0), (0.28, 0.2, 0.28), flat(1.05, 0.98, 0.8), 4),
        tube((0, -2.25, 0), (0, -2.7, 0), 0.012, flat(0.1, 0.1, 0.1), 8, NEEDLE),
        tube((-2.5, 0, 2.0), (-2.5, -0.45, 2.0), 0.2, flat(0.65, 0.36, 0.24), 4),
        cloud((-2.5, -0.95, 2.0), (0.4, 0.5, 0.4), (0.22, 0.46, 0.16), 4.0, LEAF),
        cloud((0, -1.35, 0), (2.9, 1.2, 2.4), (0.7, 0.66, 0.6), 1.5, FLOATER),
    ]
    for x, z in ((-0.8, -0.55), (0.6, -0.55), (-0.8, 0.15), (0.6, 0.15)):
        parts += box((x, -0.35, z), (0.06, 0.7, 0.06), flat(0.35, 0.2, 0.1), 4)
    for shelf in range(4):
        parts += box((1.8, -0.5 * shelf - 0.3, 2.35), (1.6, 0.03, 0.28), flat(0.55, 0.4, 0.25), 2)
        for book in np.arange(1.05, 2.5, 0.055):
            tall = 0.25 + 0.14 * rng.random()
            shade = tuple(0.15 + 0.7 * rng.random(3))
            parts += box((book, -0.5 * shelf - 0.32 - tall / 2, 2.35), (0.05, tall, 0.2), flat(*shade), 4)
    for x in (-1.8, -0.6, 0.6):
        parts.append(tube((x, -0.9, 2.49), (x, -2.3, 2.49), 0.025, flat(0.92, 0.92, 0.9), 6, NEEDLE))
    return parts


def tree(rng: Rng, x: float, z: float, tall: float) -> list[Patch]:
    green = tuple(np.array([0.20, 0.40, 0.13]) * (0.8 + 0.5 * rng.random(3)))
    parts = [tube((x, 0, z), (x, -0.55 * tall, z), 0.03 * tall, flat(0.33, 0.24, 0.17), 1.5)]
    for _ in range(5):
        at = rng.normal(0, 0.13 * tall, 3)
        size = tall * rng.uniform(0.14, 0.24, 3)
        parts.append(cloud((x + at[0], -0.7 * tall + at[1], z + at[2]), tuple(size), green, 1.2 * tall, LEAF))
    return parts


def street(rng: Rng) -> list[Patch]:
    """A street of 100 m with houses, trees, cars, lamp posts and wires, under a sky shell."""
    parts = [
        rect((-4, 0, -20), (8, 0, 0), (0, 0, 100), planks((0.27, 0.27, 0.28), (0.33, 0.33, 0.34), 2.0, 7), 0.6),
        rect((-60, 0, 78), (120, 0, 0), (0, 0, 60), flat(0.36, 0.44, 0.26), 0.02),
        dome(160, sky, 400),
        cloud((0, -4, 20), (14, 4, 40), (0.6, 0.62, 0.65), 6, FLOATER),
    ]
    for z in np.arange(-15, 78, 4.0):
        parts.append(rect((-0.08, -0.01, z), (0.16, 0, 0), (0, 0, 2), flat(0.92, 0.92, 0.88), 3))
    for side in (-1, 1):
        paving = checker((0.60, 0.58, 0.55), (0.68, 0.66, 0.62), 0.6)
        parts.append(rect((side * 7, 0, -20), (side * 40, 0, 0), (0, 0, 98), flat(0.36, 0.44, 0.26), 0.05))
        parts.append(rect((side * 4, -0.12, -20), (side * 3, 0, 0), (0, 0, 100), paving, 0.6))
        parts.append(rect((side * 4, 0, -20), (0, -0.12, 0), (0, 0, 100), flat(0.7, 0.7, 0.68), 1.5))
        z = -20.0
        while z < 78:
            deep, tall = rng.uniform(7, 12), 3.0 * rng.integers(2, 5)
            wall = tuple(np.array([0.62, 0.45, 0.36]) * rng.uniform(0.7, 1.35, 3))
            front = facade(wall, (0.24, 0.30, 0.36))
            parts += box((side * 11, -tall / 2, z + deep / 2), (8, tall, deep), front, 0.8)
            parts += box((side * 11, -tall - 0.25, z + deep / 2), (8.6, 0.5, deep), flat(0.35, 0.24, 0.22), 0.8)
            z += deep + (0 if rng.random() < 0.7 else 2.5)
        for z in np.arange(-8 + 3 * side, 70, 13.0):
            parts += tree(rng, side * 5.6, z, rng.uniform(4.5, 7))
        for z in np.arange(-2, 70, 18.0):
            x = side * 4.6
            parts.append(tube((x, 0, z), (x, -6, z), 0.05, flat(0.2, 0.22, 0.22), 6, NEEDLE))
            parts.append(ball((x - side * 0.5, -6, z), (0.35, 0.12, 0.2), flat(0.95, 0.93, 0.85), 6))
        parts.append(tube((side * 4.6, -5.6, -2), (side * 4.6, -5.4, 70), 0.02, flat(0.08, 0.08, 0.09), 12, NEEDLE))
        for z in (2.0, 9.5, 21.0, 34.0, 48.0):
            paint = flat(*rng.uniform(0.1, 0.75, 3))
            z, x = z + 3 * side, side * 2.9
            parts += box((x, -0.62, z), (1.7, 0.6, 4.0), paint, 2)
            parts += box((x, -1.15, z + 0.2), (1.5, 0.5, 2.1), flat(0.16, 0.2, 0.24), 2)
            for dx in (-0.8, 0.8):
                for dz in (-1.25, 1.25):
                    parts.append(ball((x + dx, -0.32, z + dz), (0.1, 0.32, 0.32), flat(0.08, 0.08, 0.08), 3))
    return parts


def object_(rng: Rng) -> list[Patch]:
    """A painted animal on a plinth, nothing behind it."""
    coat, pale = flat(0.82, 0.42, 0.16), flat(0.93, 0.88, 0.8)
    parts = [
        tube((0, 0, 0), (0, -0.5, 0), 0.42, facade((0.62, 0.60, 0.57), (0.5, 0.48, 0.46), 0.33, 0.5)),
        rect((-0.42, -0.5, -0.42), (0.84, 0, 0), (0, 0, 0.84), checker((0.56, 0.55, 0.52), (0.66, 0.65, 0.62), 0.21)),
        ball((0, -0.85, 0.05), (0.2, 0.3, 0.24), coat, 2),
        ball((0, -0.82, -0.1), (0.13, 0.22, 0.12), pale, 2),
        ball((0, -1.28, -0.08), (0.16, 0.15, 0.17), coat, 3),
        ball((0, -1.22, -0.26), (0.07, 0.06, 0.12), pale, 4),
        ball((0, -1.235, -0.38), (0.025, 0.02, 0.02), flat(0.06, 0.05, 0.05), 10),
        cloud((0.24, -0.62, 0.2), (0.14, 0.11, 0.3), (0.85, 0.5, 0.24), 0.5, LEAF),
        cloud((0, -0.9, 0), (0.6, 0.7, 0.6), (0.6, 0.55, 0.5), 0.08, FLOATER),
    ]
    for side in (-1, 1):
        parts.append(ball((side * 0.1, -1.45, -0.03), (0.045, 0.1, 0.03), coat, 5))
        parts.append(ball((side * 0.07, -1.31, -0.22), (0.028, 0.03, 0.02), flat(0.05, 0.04, 0.04), 12))
        parts.append(ball((side * 0.1, -0.62, -0.14), (0.06, 0.14, 0.07), coat, 3))
        for k in range(4):
            end = (side * 0.3, -1.24 + 0.03 * k, -0.34)
            parts.append(tube((side * 0.05, -1.22, -0.32), end, 0.002, flat(0.95, 0.95, 0.92), 30, NEEDLE))
    return parts


def aerial(rng: Rng) -> list[Patch]:
    """A village of 300 m from above: fields, roads, houses with roofs, trees, far hills."""
    parts = [
        rect(
            (-600, 0.5, -600), (1200, 0, 0), (0, 0, 1200), planks((0.45, 0.52, 0.25), (0.66, 0.6, 0.33), 90, 130), 0.02
        ),
        rect((-150, 0.4, -150), (300, 0, 0), (0, 0, 300), planks((0.30, 0.42, 0.18), (0.42, 0.5, 0.24), 31, 43), 0.4),
        rect((-4, -0.1, -150), (8, 0, 0), (0, 0, 300), flat(0.36, 0.36, 0.37), 1),
        rect((-150, -0.1, -3), (300, 0, 0), (0, 0, 6), flat(0.38, 0.37, 0.37), 1),
        rect((-150, -0.1, 77), (300, 0, 0), (0, 0, 5), flat(0.4, 0.39, 0.38), 1),
        dome(1500, sky, 6000),
        cloud((0, -25, 0), (140, 20, 140), (0.7, 0.7, 0.72), 1500, FLOATER),
    ]
    for _ in range(90):
        x, z = rng.uniform(-140, 140, 2)
        if min(abs(x), abs(z), abs(z - 79)) < 14:
            continue
        wide, deep, tall, turn = *rng.uniform(8, 15, 2), rng.uniform(4, 9), rng.uniform(0, np.pi)
        wall = tuple(np.array([0.80, 0.74, 0.64]) * rng.uniform(0.8, 1.15))
        parts += box((x, -tall / 2, z), (wide, tall, deep), facade(wall, (0.25, 0.28, 0.32)), 1.5, turn)
        c, s = np.cos(turn), np.sin(turn)
        along, across = np.array([c, 0, s]) * (wide + 1), np.array([-s, 0, c]) * (deep / 2 + 0.5)
        roof = planks((0.50, 0.22, 0.15), (0.62, 0.30, 0.2), 0.6, 0.9)
        for side in (-1, 1):
            eave = np.array([x, -tall, z]) - along / 2 + side * across
            parts.append(rect(tuple(eave), tuple(along), tuple(-side * across - [0, 2.8, 0]), roof, 2))
    for _ in range(160):
        x, z = rng.uniform(-145, 145, 2)
        if min(abs(x), abs(z), abs(z - 79)) > 6:
            green = tuple(np.array([0.16, 0.34, 0.12]) * rng.uniform(0.8, 1.4))
            tall = rng.uniform(3, 7)
            parts.append(cloud((x, -tall, z), (0.5 * tall, 0.6 * tall, 0.5 * tall), green, 6 * tall, LEAF))
    return parts


def translucent(rng: Rng) -> list[Patch]:
    """Panes, curtains, glass balls and smoke, many faint layers deep, before a chequered floor and solid balls."""
    parts = [
        rect((-5, 0, -2), (10, 0, 0), (0, 0, 12), checker((0.85, 0.85, 0.85), (0.2, 0.22, 0.25), 0.5)),
        rect((-6, 0, 10), (12, 0, 0), (0, -5, 0), planks((0.3, 0.34, 0.5), (0.5, 0.4, 0.42), 1.0), 0.6),
        cloud((-1.9, -1.7, 3), (1.0, 1.2, 1.0), (0.85, 0.85, 0.9), 4, FLOATER),
        cloud((2.2, -2.2, 6), (1.3, 1.5, 1.3), (0.9, 0.75, 0.6), 4, FLOATER),
    ]
    for k in range(14):
        z = 0.5 + 0.6 * k
        x = rng.uniform(-3.5, 2)
        tint = tuple(rng.uniform(0.35, 1.0, 3))
        parts.append(
            rect((x, 0, z), (rng.uniform(1, 2.2), 0, 0.3), (0, -rng.uniform(1.2, 2.6), 0), flat(*tint), 1.5, PANE)
        )
    for _ in range(10):
        x, z, r = rng.uniform(-3.5, 3.5), rng.uniform(2, 8.5), rng.uniform(0.25, 0.6)
        tint = flat(*rng.uniform(0.2, 0.95, 3))
        parts.append(ball((x, -r, z), (r, r, r), tint, 2))
        parts.append(ball((-x, -r - 1.4, z - 1), (r, r, r), tint, 2, PANE))
    return parts


def sparse(rng: Rng) -> list[Patch]:
    """A few small things far apart in the dark: most tiles are empty, most pixels see one layer or none."""
    parts = [cloud((0, -2, 10), (9, 3, 7), (0.5, 0.5, 0.6), 0.4, FLOATER)]
    for _ in range(26):
        at = tuple(rng.uniform((-8, -5.5, 4), (8, 1.5, 16)))
        r = rng.uniform(0.1, 0.3)
        parts.append(ball(at, (r, r, r), flat(*rng.uniform(0.3, 1, 3)), 1))
    for _ in range(14):
        a = rng.uniform((-8, -5.5, 4), (8, 1.5, 16))
        b = a + rng.normal(0, 1.2, 3)
        parts.append(tube(tuple(a), tuple(b), 0.008, flat(*rng.uniform(0.5, 1, 3)), 3, NEEDLE))
    return parts


SCENES: dict[str, tuple[Callable[[Rng], list[Patch]], View]] = {
    "room": (room, ((-2.4, -1.55, -2.1), (0.7, -0.95, 1.2), UP, 65.0)),
    "street": (street, ((-0.8, -1.7, -9.0), (0.6, -2.1, 12.0), UP, 60.0)),
    "object": (object_, ((-1.1, -1.35, -1.9), (0.0, -0.85, 0.0), UP, 45.0)),
    "aerial": (aerial, ((-90.0, -75.0, -130.0), (0.0, 0.0, 10.0), UP, 50.0)),
    "translucent": (translucent, ((0.4, -1.6, -2.6), (0.0, -1.3, 4.0), UP, 60.0)),
    "sparse": (sparse, ((0.0, -2.0, -1.0), (0.0, -2.0, 9.0), UP, 60.0)),
}
OPTIONS = {"n": (20_000, 1, N_MAX), "seed": (0, 0, 2**63 - 1), "sh": (3, 0, 3), "antialias": (0, 0, 1)}


def load(spec: str) -> Gaussians:
    """Gaussians of `builtin:NAME?n=..&seed=..&sh=..&antialias=..`."""
    name, _, query = spec.removeprefix("builtin:").partition("?")
    name = name or DEFAULT
    require(name, spec)
    values = {key: default for key, (default, _, _) in OPTIONS.items()}
    for pair in filter(None, query.split("&")):
        key, _, text = pair.partition("=")
        if key not in OPTIONS:
            raise InputError(f"{one_line(spec)}: option '{one_line(key)}' is unknown, there are {', '.join(OPTIONS)}")
        _, low, high = OPTIONS[key]
        if not re.fullmatch(r"[0-9]{1,19}", text) or not low <= int(text) <= high:
            raise InputError(f"{one_line(spec)}: {key}={one_line(text)}, a whole number {low} to {high} is needed")
        values[key] = int(text)
    return make(name, values["n"], values["seed"], values["sh"], bool(values["antialias"]), spec)


def require(name: str, where: str) -> None:
    if name not in SCENES:
        raise InputError(f"{one_line(where)}: no built-in scene '{one_line(name)}', there are {', '.join(SCENES)}")


def make(
    name: str, n: int, seed: int = 0, degree: int = 3, antialias: bool = False, source: str | None = None
) -> Gaussians:
    """n Gaussians of a built-in scene; layout and Gaussians depend on the seed only through PCG64."""
    require(name, source or name)
    patches = SCENES[name][0](np.random.Generator(np.random.PCG64(seed)))
    rng = np.random.Generator(np.random.PCG64([seed, n]))
    arrays = gaussians_of(rng, patches, n, degree)
    return checked(name, *arrays, antialias=antialias, source=source or f"builtin:{name}")


def default_view(name: str) -> View:
    """(eye, look-at, up, vertical field of view in degrees) that shows the scene well."""
    require(name, name)
    return SCENES[name][1]


def scale(name: str) -> float:
    """World units a metre: built-in scenes are metric."""
    require(name, name)
    return 1.0
