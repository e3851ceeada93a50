"""The truth in float64: what golden and RTL are measured against (docs/oracle.md).

`render` is the mathematics: exact sort by depth (ties: lower index), alpha = min(0.99, o exp(-q / 2)), skipped below
the cut, front to back, no early stop unless asked. `render_injected` takes every decision (which pixels blend, when one
stops) from the integer arithmetic run in lockstep, so that only the arithmetic differs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numba
import numpy as np

from golden import params
from golden.formats import Formats
from golden.preprocess.encode import Features
from golden.preprocess.projection import ALPHA_CUT, Projection, project
from golden.raster_core import bounds, exp2_unit, pixel_blender
from golden.raster_core import subtile_compute_unit as scu
from golden.raster_core.ellipse_setup import setup
from golden.raster_core.group_test_unit import group_hits

if TYPE_CHECKING:
    from golden.cameras.camera import Camera
    from golden.scene.gaussians import Gaussians

ALPHA_MAX = 0.99
_SIDE = 32  # tile of the oracle's own lists; does not change the picture

Tables = tuple[np.ndarray, np.ndarray, int]  # offsets int64[T + 1], index [E] in blending order, pixels along a tile


def render(
    scene: Gaussians | Projection,
    camera: Camera,
    background: tuple[float, float, float] = (0.0, 0.0, 0.0),
    stop: float | None = None,
    rule: str = "blend-last",
    tables: Tables | None = None,
) -> np.ndarray:
    """[H, W, 3] float64, linear, unclamped.

    stop: a pixel ends when its transmittance falls below; "blend-last" blends the layer that does it, "drop-last" does
    not (T * (1 - alpha) < stop ends the pixel before that layer). tables: blend each tile's entries in the given order
    instead of sorting; only entries that are visible in the projection count.
    """
    if rule not in ("blend-last", "drop-last"):
        raise ValueError(f"render: rule {rule!r} is not blend-last or drop-last")
    p = scene if isinstance(scene, Projection) else project(scene, camera)
    a, b, c, reach = _ellipses(p)
    if tables is None:
        seen = np.flatnonzero(p.visible)
        order = seen[np.argsort(p.depth[seen], kind="stable")]
        tables = (*_lists(p.mean2d, p.cov2d, reach, order, camera.width, camera.height, _SIDE), _SIDE)
    offsets, index, side = tables
    out = np.zeros((camera.height, camera.width, 3))
    _blend(
        np.asarray(offsets, np.int64),
        np.ascontiguousarray(index, np.int64),
        int(side),
        p.mean2d,
        a,
        b,
        c,
        reach,
        p.opacity,
        p.colour,
        np.asarray(background, np.float64),
        0.0 if stop is None else float(stop),
        rule == "drop-last",
        out,
    )
    return out


def render_injected(
    f: Formats,
    features: Features,
    projection: Projection,
    tables: Tables,
    width: int,
    height: int,
    background: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> np.ndarray:
    """[H, W, 3] float64: real footprints, opacities and colours, the golden model's decisions and order.

    A pixel blends an entry when the golden p <= CUT and it is not done; it is done when the golden T < T_STOP.
    tables: the sorted tables of the frame, side params.TILE; entries of Gaussians that are not visible are never hit.
    """
    offsets, index, side = tables
    if side != params.TILE:
        raise ValueError(f"render_injected: tables of {side}-pixel tiles; wants {params.TILE}")
    a, b, c, _ = _ellipses(projection)
    out = np.zeros((height, width, 3))
    _blend_injected(
        f,
        np.asarray(offsets, np.int64),
        np.ascontiguousarray(index, np.int64),
        features.mean,
        features.chol,
        features.opacity,
        projection.mean2d,
        a,
        b,
        c,
        projection.opacity,
        projection.colour,
        np.asarray(background, np.float64),
        out,
    )
    return out


def _ellipses(p: Projection) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(a, b, c, reach), each [N] float64: q = (a dx + b dy)^2 + (c dy)^2; reach: the q at which alpha is at the cut."""
    with np.errstate(divide="ignore", invalid="ignore"):
        root_yy, root_det = np.sqrt(p.cov2d[:, 2]), np.sqrt(p.det)
        a, b, c = root_yy / root_det, -p.cov2d[:, 1] / root_yy / root_det, 1 / root_yy
        reach = np.where(p.visible, 2 * np.log(p.opacity / ALPHA_CUT), -1.0)
    return a, b, c, reach


@numba.njit(cache=True, error_model="numpy")
def _floor(value, low, high):
    """The next whole number below, in [low, high]: a float of 1e20 has no int64. low for NaN."""
    return high if value >= high else int(np.floor(value)) if value > low else low


@numba.njit(cache=True, error_model="numpy")
def _lists(mean2d, cov2d, reach, order, width, height, side):
    """(offsets [T + 1], index [P]): for each tile, in the given order, whatever the box of its ellipse touches."""
    columns, rows = -(-width // side), -(-height // side)
    boxes = np.empty((len(order), 4), np.int64)
    offsets = np.zeros(columns * rows + 1, np.int64)
    for k in range(len(order)):
        i = order[k]
        half_x = np.sqrt(reach[i] * cov2d[i, 0]) + 1
        half_y = np.sqrt(reach[i] * cov2d[i, 2]) + 1
        boxes[k, 0] = _floor((mean2d[i, 0] - half_x) / side, 0, columns)
        boxes[k, 1] = _floor((mean2d[i, 1] - half_y) / side, 0, rows)
        boxes[k, 2] = _floor((mean2d[i, 0] + half_x) / side + 1, 0, columns)
        boxes[k, 3] = _floor((mean2d[i, 1] + half_y) / side + 1, 0, rows)
        for row in range(boxes[k, 1], boxes[k, 3]):
            for column in range(boxes[k, 0], boxes[k, 2]):
                offsets[row * columns + column + 1] += 1
    offsets = np.cumsum(offsets)
    cursor = offsets[:-1].copy()
    index = np.empty(offsets[-1], np.int64)
    for k in range(len(order)):
        for row in range(boxes[k, 1], boxes[k, 3]):
            for column in range(boxes[k, 0], boxes[k, 2]):
                tile = row * columns + column
                index[cursor[tile]] = order[k]
                cursor[tile] += 1
    return offsets, index


@numba.njit(parallel=True, cache=True, error_model="numpy")
def _blend(offsets, index, side, mean2d, a, b, c, reach, opacity, colour, background, stop, drop_last, out):
    height, width, _ = out.shape
    columns = -(-width // side)
    for tile in numba.prange(len(offsets) - 1):
        x0, y0 = tile % columns * side, tile // columns * side
        x1, y1 = min(x0 + side, width), min(y0 + side, height)
        left = np.ones((y1 - y0, x1 - x0))  # transmittance; negative: the pixel ended with -left
        for at in range(offsets[tile], offsets[tile + 1]):
            i = index[at]
            if reach[i] < 0:
                continue
            limit = reach[i] * (1 + 1e-9) + 1e-9  # a little more than the pixels that pass the exact test below
            half_y = np.sqrt(limit) / c[i]
            first = _floor(mean2d[i, 1] - half_y - 0.5, y0, y1)
            last = _floor(np.ceil(mean2d[i, 1] + half_y - 0.5) + 1, y0, y1)
            for y in range(first, last):
                dy = y + 0.5 - mean2d[i, 1]
                v = c[i] * dy
                rest = limit - v * v
                if rest < 0:
                    continue
                middle = mean2d[i, 0] - b[i] / a[i] * dy - 0.5
                half_x = np.sqrt(rest) / a[i] + 1
                begin = _floor(middle - half_x, x0, x1)
                end = _floor(np.ceil(middle + half_x) + 1, x0, x1)
                for x in range(begin, end):
                    t = left[y - y0, x - x0]
                    u = a[i] * (x + 0.5 - mean2d[i, 0]) + b[i] * dy
                    q = u * u + v * v
                    if t < 0 or q > limit:
                        continue
                    alpha = min(ALPHA_MAX, opacity[i] * np.exp(-0.5 * q))
                    if alpha < ALPHA_CUT:
                        continue
                    rest_t = t * (1 - alpha)
                    if drop_last and rest_t < stop:
                        left[y - y0, x - x0] = -t
                        continue
                    for k in range(3):
                        out[y, x, k] += t * alpha * colour[i, k]
                    left[y - y0, x - x0] = -rest_t if rest_t < stop else rest_t
        for y in range(y0, y1):
            for x in range(x0, x1):
                for k in range(3):
                    out[y, x, k] += abs(left[y - y0, x - x0]) * background[k]


@numba.njit(parallel=True, cache=True, error_model="numpy")
def _blend_injected(f: Formats, offsets, index, mean, chol, code, mean2d, a, b, c, opacity, colour, background, out):
    height, width, _ = out.shape
    columns = -(-width // params.TILE)
    side = params.SUBTILE
    for tile in numba.prange(len(offsets) - 1):
        tile_x, tile_y = tile % columns * params.TILE, tile // columns * params.TILE
        t_code = np.empty((side, side), np.int64)
        t_real = np.empty((side, side))
        for subtile in range(params.SUBTILES):
            x0, y0 = tile_x + subtile % side * side, tile_y + subtile // side * side
            if x0 >= width or y0 >= height:
                continue
            t_code[:] = 1 << f.t_f
            t_real[:] = 1.0
            for at in range(offsets[tile], offsets[tile + 1]):
                i = index[at]
                ca, cb, cc = np.int64(chol[i, 0]), np.int64(chol[i, 1]), np.int64(chol[i, 2])
                o = np.int64(code[i])
                u0, v0 = setup(f, ca, cb, cc, np.int64(mean[i, 0]), np.int64(mean[i, 1]), x0, y0)
                if f.bound:
                    m_x, m_y = np.int64(mean[i, 0]), np.int64(mean[i, 1])
                    bits = bounds.tile_bits(f, ca, cb, cc, m_x, m_y, o, tile_x, tile_y, width, height)
                    hit = (bits >> np.uint64(subtile)) & np.uint64(1) == 1
                else:
                    m_x, m_y = np.int64(mean[i, 0]), np.int64(mean[i, 1])
                    first = x0 - x0 % (side * params.UNITS)  # of the group
                    hits = group_hits(f, ca, cb, cc, m_x, m_y, o, first, y0, width, height)
                    hit = (hits >> ((x0 - first) // side)) & 1 == 1
                if not hit:
                    continue
                for y in range(y0, min(y0 + side, height)):
                    for x in range(x0, min(x0 + side, width)):
                        t = t_code[y - y0, x - x0]
                        p = scu.power(f, u0 + (x - x0) * ca + (y - y0) * cb, v0 + (y - y0) * cc, o)
                        if t < f.t_stop or p > f.cut:
                            continue
                        left = t - pixel_blender.weight(f, exp2_unit.alpha(f, p), t)
                        if f.drop_last and left < f.t_stop:
                            t_code[y - y0, x - x0] = 0
                            continue
                        t_code[y - y0, x - x0] = left
                        dx, dy = x + 0.5 - mean2d[i, 0], y + 0.5 - mean2d[i, 1]
                        u, v = a[i] * dx + b[i] * dy, c[i] * dy
                        weight = t_real[y - y0, x - x0] * min(ALPHA_MAX, opacity[i] * np.exp(-0.5 * (u * u + v * v)))
                        t_real[y - y0, x - x0] -= weight
                        for k in range(3):
                            out[y, x, k] += weight * colour[i, k]
            for y in range(y0, min(y0 + side, height)):
                for x in range(x0, min(x0 + side, width)):
                    for k in range(3):
                        out[y, x, k] += t_real[y - y0, x - x0] * background[k]
