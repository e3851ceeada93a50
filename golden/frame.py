"""One frame after the other: which entries come, what the tables become, what the picture is.

A tile's table in frame f is P(f-1) united with P(f), P the Gaussians whose bitmap is not empty (docs/architecture.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from golden import params
from golden.cameras.camera import Camera
from golden.preprocess import Features, Pairs, Projection, duplicate, encode, project
from golden.raster_core.raster_core import RasterResult, rasterise
from golden.records import INVALID, entries, indices_of
from golden.scene.gaussians import Gaussians
from golden.settings import Settings
from golden.sorting_core import sorting_core


@dataclass(frozen=True)
class Lists:
    """One list of entries a tile: tile t holds words[offsets[t]:offsets[t + 1]]."""

    offsets: np.ndarray  # [T + 1] int64
    words: np.ndarray  # [E] int64 entries

    def tile(self, t: int) -> np.ndarray:
        return self.words[self.offsets[t] : self.offsets[t + 1]]

    @staticmethod
    def join(parts: list[np.ndarray]) -> Lists:
        offsets = np.zeros(len(parts) + 1, np.int64)
        np.cumsum([part.size for part in parts], out=offsets[1:])
        return Lists(offsets, np.concatenate(parts) if parts else np.zeros(0, np.int64))

    @staticmethod
    def empty(tiles: int) -> Lists:
        return Lists(np.zeros(tiles + 1, np.int64), np.zeros(0, np.int64))


@dataclass(frozen=True)
class Frame:
    """Everything that the hardware sees and makes in one frame."""

    camera: Camera
    projection: Projection
    features: Features
    pairs: Pairs
    table: Lists  # last frame's tables as the sorting cores read them; empty where a tile starts from scratch
    incoming: Lists  # ascending index
    order: Lists  # the tables as sorted, keys as sorted by
    raster: RasterResult
    counters: dict[str, int]

    @property
    def written(self) -> Lists:
        """The tables as the raster core wrote them back: what the next frame starts from."""
        return Lists(self.order.offsets, self.raster.words_out)

    @property
    def image(self) -> np.ndarray:
        """[H, W, 3] float32, unclamped."""
        return (self.raster.value * 2.0**-params.ACC_F).astype(np.float32)


def tiles_of(width: int, height: int) -> np.ndarray:
    """[T, 2] int64 pixel origins of the tiles, row-major."""
    ys, xs = np.mgrid[0 : -(-height // params.TILE), 0 : -(-width // params.TILE)]
    return np.stack([xs.ravel(), ys.ravel()], 1).astype(np.int64) * params.TILE


@numba.njit(cache=True)
def _difference(now, members):
    """Elements of now (ascending) that are not in members (ascending)."""
    out = np.empty(now.size, np.int64)
    n = k = 0
    for value in now:
        while k < members.size and members[k] < value:
            k += 1
        if k == members.size or members[k] != value:
            out[n] = value
            n += 1
    return out[:n]


def _incoming(pairs: Pairs, features: Features, table: Lists) -> list[np.ndarray]:
    """Indices that touch a tile now and are not among the valid entries of its table."""
    out = []
    for t in range(pairs.tile_offsets.size - 1):
        now = pairs.index[pairs.tile_offsets[t] : pairs.tile_offsets[t + 1]].astype(np.int64)
        words = table.tile(t)
        members = np.sort(indices_of(words[words < INVALID]))
        out.append(_difference(now, members))
    return out


class Renderer:
    """The golden model over a sequence of frames of one scene. `sorting` is "reuse" or "full"."""

    def __init__(self, gaussians: Gaussians, settings: Settings, sorting: str = "reuse"):
        self.gaussians = gaussians
        self.settings = settings
        self.sorting = sorting
        self.number = 0  # frames rendered: chooses the chunk boundaries
        self.written: Lists | None = None
        self.axis: np.ndarray | None = None  # last frame's optical axis

    def preprocess(self, camera: Camera) -> tuple[Projection, Features, Pairs]:
        antialias = {"auto": None, "on": True, "off": False}[self.settings.antialias]
        projection = project(self.gaussians, camera, antialias)
        features = encode(projection)
        return projection, features, duplicate(features, camera.width, camera.height)

    def lists(self, camera: Camera, features: Features, pairs: Pairs, cut: bool) -> tuple[Lists, Lists, dict[str, int]]:
        """(table, incoming, counters): what the sorting cores get for every tile."""
        tiles = tiles_of(camera.width, camera.height)
        fresh = self.written is None or self.written.offsets.size != len(tiles) + 1
        table = Lists.empty(len(tiles)) if fresh or self.sorting == "full" else self.written
        new = _incoming(pairs, features, table)
        total = int(pairs.tile_offsets[-1])
        jump = not fresh and (
            sum(part.size for part in new) > self.settings.cut_share * max(total, 1)
            or camera.rotation[2] @ self.axis < np.cos(np.radians(self.settings.cut_angle))
        )
        self.axis = camera.rotation[2]
        if (cut or jump) and not fresh:
            table = Lists.empty(len(tiles))
            new = _incoming(pairs, features, table)
        old = [table.tile(t) for t in range(len(tiles))]
        counters = {"full_frames": int(fresh or cut or jump), "full_tiles": 0, "overfull_tiles": 0, "overflow": 0}
        incoming = []
        for t, part in enumerate(new):
            overfull = old[t].size + part.size > self.settings.capacity
            if overfull:
                old[t] = old[t][:0]
                part = pairs.index[pairs.tile_offsets[t] : pairs.tile_offsets[t + 1]].astype(np.int64)
            words = entries(features.key[part], part)
            if words.size > self.settings.capacity:
                counters["overflow"] += words.size - self.settings.capacity
                words = np.sort(words)[: self.settings.capacity]
            incoming.append(words)
            counters["overfull_tiles"] += int(overfull)
            counters["full_tiles"] += int(old[t].size == 0 and words.size > 0)
        return Lists.join(old), Lists.join(incoming), counters

    def frame(self, camera: Camera, cut: bool = False) -> Frame:
        """Render one frame; `cut` declares that nothing of the last frame is to be used."""
        projection, features, pairs = self.preprocess(camera)
        table, incoming, counters = self.lists(camera, features, pairs, cut)
        first = sorting_core.first_length(self.number)
        tiles = tiles_of(camera.width, camera.height)
        order = Lists.join(
            [sorting_core.sort(table.tile(t), np.sort(incoming.tile(t)), first) for t in range(len(tiles))]
        )
        raster = rasterise(
            (order.offsets, order.words),
            features,
            tiles,
            camera.width,
            camera.height,
            self.settings.background_codes(),
        )
        counters = {**self.gaussians.counters, **projection.counters, **features.counters, **counters}
        counters["entries"] = order.words.size
        counters["incoming"] = incoming.words.size
        counters["outgoing"] = int(np.count_nonzero(table.words & INVALID))
        counters["pairs"] = int(raster.pairs.sum())
        counters["blends"] = int(raster.blends.sum())
        self.number += 1
        self.written = Lists(order.offsets, raster.words_out)
        return Frame(camera, projection, features, pairs, table, incoming, order, raster, counters)
