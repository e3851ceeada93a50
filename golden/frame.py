"""One frame after the other: which entries come, what the tables become, what the picture is.

A tile's table in frame f is P(f-1) united with P(f), P the Gaussians whose bitmap is not empty (docs/architecture.md).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from golden import params, tables
from golden.cameras.camera import Camera, extrapolate
from golden.errors import InputError
from golden.formats import Formats
from golden.preprocess import Features, Pairs, Projection, duplicate, encode, project
from golden.preprocess.projection import depths
from golden.raster_core import batch_buffer, late_buffer
from golden.raster_core.raster_core import RasterResult, rasterise
from golden.records import INVALID, LINEAR_NEAR, depth_key, short_drop
from golden.scene.gaussians import Gaussians
from golden.settings import Settings
from golden.sorting_core import sorting_core
from golden.tables import Lists

TILE_COUNTERS = ("full_frames", "full_tiles", "overfull_tiles", "rebuilt_tiles", "damaged_tiles", "overflow")
SORTINGS = "reuse, full, hierarchical, periodic:K, background:D, shuffled:SEED"


@dataclass(frozen=True)
class Frame:
    """Everything that the hardware sees and makes in one frame."""

    camera: Camera
    projection: Projection
    features: Features
    pairs: Pairs
    sorting: str  # what was done to the tables: reuse, full, hierarchical, frozen, background
    firsts: tuple[int, ...]  # entries of a table's first chunk, in each pass over it
    table: Lists  # last frame's tables as the sorting cores read them; empty where a tile starts from scratch
    incoming: Lists  # ascending index
    merged: Lists  # what the raster core reads; with late sort nearly in order, otherwise it is `order`
    order: Lists  # the tables as drawn, keys as sorted by
    raster: RasterResult
    formats: Formats
    coloured: np.ndarray  # [N] bool: the colour was computed in this frame
    counters: dict[str, int]

    @property
    def written(self) -> Lists:
        """The tables as the raster core wrote them back: what the next frame starts from."""
        return Lists(self.order.offsets, self.raster.words_out)

    @property
    def image(self) -> np.ndarray:
        """[H, W, 3] float32, unclamped."""
        return (self.raster.value * 2.0**-self.formats.acc_f).astype(np.float32)


def tiles_of(width: int, height: int) -> np.ndarray:
    """[T, 2] int64 pixel origins of the tiles, row-major."""
    ys, xs = np.mgrid[0 : -(-height // params.TILE), 0 : -(-width // params.TILE)]
    return np.stack([xs.ravel(), ys.ravel()], 1).astype(np.int64) * params.TILE


def parse_sorting(text: str) -> tuple[str, int]:
    """(strategy, K, D or SEED; 1 where the strategy has none) of "reuse", "periodic:4" and so on."""
    kind, colon, number = text.partition(":")
    if kind in ("reuse", "full", "hierarchical") and not colon:
        return kind, 1
    if kind in ("periodic", "background", "shuffled") and number.isascii() and number.isdigit() and int(number) > 0:
        return kind, int(number)
    raise InputError(f"--sorting {text}: wants {SORTINGS} (K, D: whole frames; each 1 or more)")


class Renderer:
    """The golden model over a sequence of frames of one scene (docs/frames.md).

    sorting: what `parse_sorting` takes. late: the raster core sorts each batch by fresh keys, and the tables have
    4-byte entries.
    """

    def __init__(self, gaussians: Gaussians, settings: Settings, sorting: str = "reuse", late: bool = False):
        self.gaussians = gaussians
        self.settings = settings
        self.formats = settings.formats()
        self.far: float | None = None  # largest depth of a linear key
        self.sorting, self.interval = parse_sorting(sorting)  # K, D or SEED
        self.late = late
        self.depth = settings.depth_rule(late)
        rules = (
            (f"--sorting {sorting}", late and self.sorting != "reuse", "late sort goes with reuse only"),
            (f"--set depth={self.depth}", late and self.depth in ("fresh", "predicted"), "late sort has fresh keys"),
            (f"--set passes={settings.passes}", late and settings.passes > 1, "late sort has one pass"),
            (
                f"--set passes={settings.passes}",
                settings.passes > 1 and self.sorting != "reuse",
                f"goes with --sorting reuse, not {sorting}",
            ),
        )
        for what, broken, why in rules:
            if broken:
                raise InputError(f"{what}: {why}")
        self.number = 0  # frames rendered: chooses the chunk boundaries
        self.camera: Camera | None = None  # of the last frame
        self.view: Camera | None = None  # that the keys of the tables belong to, where incoming ones follow them
        self.written: Lists | None = None  # by the last frame's raster core
        self.last: Features | None = None  # of the last frame, where colours are kept
        self.sorted: deque[Lists] = deque(maxlen=self.interval + 1)  # periodic, background: the last full sorts
        self.age = 0  # periodic: frames since the last full sort

    def preprocess(self, camera: Camera) -> tuple[Projection, Features, Pairs]:
        projection = project(self.gaussians, camera, self.settings.antialias_mode(), self.settings.sh_degree)
        if self.far is None:  # linear keys: of the first frame
            self.far = max(float(projection.depth[projection.visible].max(initial=0)), 2 * LINEAR_NEAR)
        features = encode(self.formats, projection, self.far)
        return projection, features, duplicate(self.formats, features, camera.width, camera.height)

    def _colours(self, features: Features, anew: bool) -> tuple[Features, np.ndarray]:
        """(features with the colours that are kept, which ones are not). anew: keep none."""
        every = self.settings.colour_every
        coloured = features.visible
        if every > 1:
            if not anew:
                due = np.arange(len(coloured)) % every == self.number % every
                kept = features.visible & self.last.visible & ~due
                colour = np.where(kept[:, None], self.last.colour, features.colour)
                features = replace(features, colour=colour)
                coloured = features.visible & ~kept
            self.last = features
        return features, coloured

    def _keys(self, view: Camera) -> np.ndarray:
        """[N] int32 keys of all Gaussians as a camera sees them."""
        return depth_key(self.formats, depths(self.gaussians, view), self.far).astype(np.int32)

    def _written_keys(self, camera: Camera, features: Features, anew: bool) -> np.ndarray:
        """[N] keys that the raster core writes back; sets `view`. anew: the camera did not come from the last one."""
        self.view = camera if self.depth == "consistent" else None
        if self.depth != "predicted":
            return features.key
        self.view = camera if anew or self.camera is None else extrapolate(self.camera, camera)
        return self._keys(self.view)

    def _turned(self, camera: Camera) -> bool:
        """Did the optical axis turn by more than `cut_angle` since the last frame?"""
        return bool(camera.rotation[2] @ self.camera.rotation[2] < np.cos(np.radians(self.settings.cut_angle)))

    def _lists(self, camera: Camera, features: Features, pairs: Pairs, anew: bool) -> tuple[Lists, Lists, dict]:
        """(table, incoming, counters): what the sorting cores get for every tile. anew: nothing is reused."""
        settings = self.settings
        now = np.diff(pairs.tile_offsets)
        none = Lists.empty(len(now))
        table = none if anew else self.written
        if self.late:
            table = tables.group_keys(table, short_drop(self.formats))
        new, damaged = tables.arrivals(pairs, table, len(self.gaussians))
        if not anew and (self._turned(camera) or new.words.size > settings.cut_share * max(int(now.sum()), 1)):
            anew, table = True, none
            new, damaged = tables.arrivals(pairs, table, len(self.gaussians))
        overfull = table.lengths + new.lengths > settings.capacity
        rebuilt = (table.lengths > 0) & (new.lengths > settings.rebuild_limit(self.late) * now) & ~overfull
        table = table.without(overfull | rebuilt | damaged)
        if self.depth == "fresh":
            table = tables.renewed(table, features.key, features.visible)
        keys = features.key, self._keys(self.view) if self.view else features.key
        incoming, overflow = tables.incoming(pairs, new, table.lengths == 0, keys, settings.capacity)
        counters = {
            "full_frames": int(anew),
            "full_tiles": int(np.count_nonzero((table.lengths == 0) & (incoming.lengths > 0))),
            "overfull_tiles": int(np.count_nonzero(overfull)),
            "rebuilt_tiles": int(np.count_nonzero(rebuilt)),
            "damaged_tiles": int(np.count_nonzero(damaged)),
            "overflow": overflow,
        }
        return table, incoming, counters

    def _sort(self, camera: Camera, features: Features, pairs: Pairs, anew: bool, firsts: tuple[int, ...]):
        """(sorting, table, incoming, merged, order, counters) of Frame."""
        if self.sorting == "periodic" and not anew and self.age < self.interval:
            self.age += 1
            order = self.sorted[-1]
            counters = dict.fromkeys(TILE_COUNTERS, 0)
            return "frozen", order, Lists.empty(len(order.offsets) - 1), order, order, counters
        kept = self.sorting in ("reuse", "hierarchical")
        table, incoming, counters = self._lists(camera, features, pairs, anew or not kept)
        how = tables.AS_IT_IS if self.late else (tables.CHUNKS if self.sorting == "reuse" else tables.WHOLE)
        chunk, repaired = self.settings.chunk, table
        for first in firsts[:-1]:
            repaired = tables.sort(repaired, Lists.empty(len(table.offsets) - 1), first, how, chunk)
        order = merged = tables.sort(repaired, incoming, firsts[-1], how, chunk)
        if self.late:
            order = tables.late_sort(merged, features.key, firsts[-1], chunk)
        if self.sorting == "shuffled":
            order = merged = tables.shuffle(order, (self.interval, self.number))
        self.age = 1
        if anew:
            self.sorted.clear()
        if self.sorting in ("periodic", "background"):
            self.sorted.append(order)
        if self.sorting == "background" and not anew:
            return "background", table, incoming, self.sorted[0], self.sorted[0], counters
        return "full" if counters["full_frames"] else self.sorting, table, incoming, merged, order, counters

    def _firsts(self) -> tuple[int, ...]:
        """Entries of the first chunk in each of this frame's passes: borders alternate from pass to pass."""
        passes, chunk = self.settings.passes, self.settings.chunk
        return tuple(sorting_core.first_length(self.number * passes + k, chunk) for k in range(passes))

    def frame(self, camera: Camera, cut: bool = False) -> Frame:
        """Render one frame; `cut` declares that nothing of the last frame is to be used."""
        anew = cut or self.camera is None or (camera.width, camera.height) != (self.camera.width, self.camera.height)
        projection, features, pairs = self.preprocess(camera)
        features, coloured = self._colours(features, anew or self._turned(camera))
        firsts = self._firsts()
        sorting, table, incoming, merged, order, counters = self._sort(camera, features, pairs, anew, firsts)
        written = self._written_keys(camera, features, counters["full_frames"] > 0)
        banks = late_buffer.BANKS if self.late else batch_buffer.BANKS
        raster = rasterise(
            self.formats,
            (order.offsets, order.words),
            replace(features, key=written),
            tiles_of(camera.width, camera.height),
            camera.width,
            camera.height,
            self.settings.background_codes(),
            *((firsts[-1], self.settings.chunk) if self.late else (params.CHUNK, params.CHUNK)),
            ahead=0 if self.settings.refreshes(self.number) else banks,
            kept=merged.words,
        )
        counters = {**self.gaussians.counters, **projection.counters, **features.counters, **counters}
        counters["entries"] = order.words.size
        counters["incoming"] = incoming.words.size
        counters["stale_entries"] = order.words.size - int(raster.fetched.sum())
        counters["outgoing"] = int(np.count_nonzero(table.words & INVALID))
        counters["pairs"] = int(raster.pairs.sum())
        counters["blends"] = int(raster.blends.sum())
        # pixels of the pairs that need no exponential: below the cut, done, or outside the picture
        counters["exp_skipped"] = counters["pairs"] * params.SUBTILE**2 - counters["blends"]
        counters["colours_reused"] = int(np.count_nonzero(features.visible & ~coloured))
        self.number += 1
        self.camera = camera
        self.written = Lists(order.offsets, raster.words_out)
        return Frame(
            camera, projection, features, pairs, sorting, firsts,
            table, incoming, merged, order, raster, self.formats, coloured, counters,
        )  # fmt: skip
