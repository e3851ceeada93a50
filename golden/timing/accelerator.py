"""An accelerator over a sequence of frames: what it reads, computes and writes in each, and how long that takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from golden import dma, params, slice
from golden.frame import Frame, tiles_of
from golden.raster_core import late_core
from golden.raster_core.pixel_resolver import pixel_beats
from golden.records import INVALID, indices_of
from golden.settings import Settings
from golden.timing import engine, memory, raster_state, record_cache, tiles16
from golden.timing.address_map import LINE, PIXEL_BYTES, Formats, list_starts, record_bytes, regions
from golden.timing.clusters import store
from golden.timing.hardware import Hardware
from golden.timing.jobs import HIERARCHICAL, NO_KEYS, NONE, REUSE, Keys, chunk_sort_cycles, jobs, renew_cycles
from golden.timing.line_blocks import in_order, line_blocks, lines_of, no_blocks
from golden.timing.preprocess_engine import Blocks, preprocess

ENTRIES = 1 << 25  # that the address map has room for in all tables of a frame
CORES = {"groups": raster_state.GROUPS, "candidates": raster_state.CANDIDATES, "given": raster_state.SIMPLE}


@dataclass(frozen=True)
class Drawn:
    """What the timing needs of a frame on one accelerator, tile by tile."""

    blocks: Blocks
    order: np.ndarray  # int64[T] tiles along a Morton curve
    jobs: object
    raster: object
    after: Blocks  # the pass behind the last tile: depth and valid bits, where the raster cores do not write them
    beside: Blocks  # a sort in the background
    scu_ops: int
    tests: int


def morton_tiles(columns: int, rows: int) -> np.ndarray:
    """[T] int64 row-major tile numbers along a Morton curve; x lowest."""
    tiles = np.arange(columns * rows)
    x, y = tiles % columns, tiles // columns
    code = sum(((x >> k & 1) << 2 * k) | ((y >> k & 1) << 2 * k + 1) for k in range(16))
    return np.argsort(code, kind="stable").astype(np.int64)


class Accelerator:
    """One hardware with one sorting strategy, on one scene. `frame` goes from picture to picture."""

    def __init__(self, hardware: Hardware, gaussians, width: int, height: int, settings: Settings | None = None):
        self.hardware = hardware
        self.settings = settings = settings or Settings()
        f = settings.formats()
        self.width, self.height = width, height
        self.stored = store(gaussians, hardware.morton)
        self.formats = Formats(
            degree=min(gaussians.degree, settings.sh_degree),
            position_bytes=hardware.position_bytes,
            colour_every=settings.colour_every,
            clusters=hardware.clusters,
            membership=not (hardware.scratch or hardware.reproject),
            record_stride=hardware.record_stride,
            record_bytes=record_bytes(f, settings.depth == "predicted"),
            incoming_bytes=hardware.entry_bytes if hardware.scratch else f.entry_bytes,
            tile=hardware.tile,
            combine_lines=hardware.combine_lines,
        )
        self.at = regions(self.formats, len(gaussians), width, height, ENTRIES)
        self.memory = memory.lpddr4(hardware.channels)
        self.core = CORES["given" if not (hardware.charge_tests and hardware.charge_imbalance) else hardware.raster]
        self.lanes = raster_state.new_state(self.core, hardware.slices, 0, self.batch)
        self.columns, self.rows = -(-width // hardware.tile), -(-height // hardware.tile)
        self.order = morton_tiles(self.columns, self.rows)
        self.blank = np.ones((2, len(self.order)), np.bool_)  # of the images: background only, as the host made them
        self.cycle = 0
        self.number = 0
        self.members = None
        self.lengths = np.zeros(self.columns * self.rows, np.int64)  # room of the last frame's tables
        self.hit_rate = 0.0

    @property
    def batch(self) -> int:
        """Entries of a raster core's batch."""
        return self.settings.chunk if self.hardware.late_sort else params.CHUNK

    def prepare(self, frame: Frame) -> Drawn:
        """The frame's lists, addresses, lines and cycles; once for each frame, in order."""
        if self.hardware.tile == params.TILE:
            return self._prepare(frame, None)
        return self._prepare(frame, tiles16.split(frame.order.offsets, frame.raster.bitmaps, self.width, self.height))

    def _prepare(self, frame: Frame, small: tiles16.Tiles16 | None) -> Drawn:
        h, at, this = self.hardware, self.at, self.number & 1
        late = h.late_sort
        offsets = frame.order.offsets if small is None else small.offsets
        index = indices_of(frame.order.words)
        if small is not None:
            index = index[small.entry]
        n = np.diff(offsets)
        fetched = frame.raster.fetched if small is None else n
        if h.scratch:
            table_n, in_n = np.zeros_like(n), n
            listed = offsets, index
        else:
            table_n, in_n = frame.table.lengths, frame.incoming.lengths
            listed = frame.incoming.offsets, indices_of(frame.incoming.words)
        size = h.entry_bytes
        in_size = self.formats.incoming_bytes
        in_start = list_starts(at.incoming[this], in_n, in_size)
        table_start = list_starts(at.tables[1 - this], self.lengths, size)
        room = table_n + in_n if not h.scratch else n
        out_start = list_starts(at.tables[this], room, size)
        scratch = at.scratch + (in_start - at.incoming[this])
        self.lengths = room

        last = None if h.scratch or not frame.table.words.size else self.members
        done = preprocess(
            self.stored, self.formats, at, frame, last, self.number,
            (in_start, *listed), h.preprocess_units,
        )  # fmt: skip
        self.members = done.members
        blocks = done.blocks
        in_order(blocks.read_at, blocks.read)
        in_order(blocks.write_at, blocks.write)
        if h.reproject:
            blocks = blocks._replace(cycles=2 * blocks.cycles)
        if not h.charge_projection:
            blocks = blocks._replace(cycles=np.zeros_like(blocks.cycles))

        nominal, kind = self._sort_cycles(frame, n)
        beside = no_blocks()
        if frame.sorting == "background":
            pairs = lines_of(in_start[:-1], in_n * in_size) if in_n.any() else np.zeros(0, np.int64)
            now = np.diff(frame.pairs.tile_offsets)
            lists = lines_of(list_starts(at.scratch, now, size)[:-1], now * size)
            passes = np.concatenate([pairs, lists, lists])
            sorts = chunk_sort_cycles(now, self.settings.chunk)
            beside = line_blocks(passes, passes, int(sorts.sum()) // (h.slices * h.sort_cores))
        keys = NO_KEYS
        if self.settings.depth == "fresh" and kind in (REUSE, HIERARCHICAL) and not h.scratch:
            keys = self._keys(frame)
            nominal = nominal + renew_cycles(table_n)
        job = jobs(
            kind, nominal, np.zeros_like(table_n) if late else table_n, in_n, table_start[:-1], in_start[:-1],
            scratch[:-1], scratch[:-1] if late else out_start[:-1], in_size if late or h.scratch else size,
            self.settings.chunk, len(frame.firsts), keys,
        )  # fmt: skip
        fetch = record_cache.fetch(
            offsets, index, self.stored.place, at.features[this], h.record_stride,
            [self.order[core :: h.slices] for core in range(h.slices)], h.cache_kb, h.cache_shared,
            size=self.formats.record_bytes, batch=self.batch, fetched=fetched,
        )  # fmt: skip
        self.hit_rate = fetch.hit_rate
        heads = np.full(len(index), self.formats.record_bytes // dma.BEAT, np.int64)
        if h.record_stride == self.formats.record_bytes:
            heads = dma.record_heads(self.stored.place[index], h.record_stride, at.features[this])
        starts = table_start[:-1].copy(), out_start[:-1].copy(), scratch[:-1].copy()
        raster = self._raster(frame, small, offsets, fetched, fetch, heads, starts, table_n, in_n)
        after = no_blocks()
        if not h.deferred_update:
            tables = lines_of(out_start[:-1], fetched * size)
            after = line_blocks(
                np.concatenate([tables, fetch.lines]), tables, int(fetched.sum()) // (h.slices * h.sort_cores)
            )
        tests = int(fetched.sum()) * params.GROUPS
        if h.raster == "candidates":
            tests = int(raster.candidates.sum())
        order = self.order
        if h.skip_blank:
            blank = table_n + in_n == 0
            order = order[~(blank & self.blank[this])[order]]
            self.blank[this] = blank
        self.number += 1
        return Drawn(
            blocks, order, job, raster, after, beside,
            int(raster.counts.sum()), tests,
        )  # fmt: skip

    def _sort_cycles(self, frame: Frame, n: np.ndarray) -> tuple[np.ndarray, int]:
        """(nominal cycles int64[T] of the tiles' sorts, kind of job)."""
        chunk = self.settings.chunk
        if self.hardware.scratch:
            return np.where(n > 0, n + chunk_sort_cycles(n, chunk), 2), HIERARCHICAL
        if frame.sorting in ("frozen", "background"):
            return np.full(len(n), 2, np.int64), NONE
        if frame.sorting == "hierarchical":
            total = frame.table.lengths + frame.incoming.lengths
            return np.where(total > 0, total + chunk_sort_cycles(total, chunk), 2), HIERARCHICAL
        incoming = frame.incoming.offsets, frame.incoming.words
        table = frame.table.offsets, frame.table.words
        if self.hardware.late_sort:
            table = np.zeros_like(frame.table.offsets), np.zeros(0, np.int64)
        return slice.sort_jobs(frame.formats, table, incoming, frame.firsts, chunk=chunk)[0], REUSE

    def _keys(self, frame: Frame) -> Keys:
        """The records of valid entries, read for new keys of the tables, tile by tile on the cores that sort them."""
        h, table = self.hardware, frame.table
        behind = np.concatenate(([0], np.cumsum(table.words < INVALID)))  # valid entries in front of each
        valid = table.words[table.words < INVALID]
        fetch = record_cache.fetch(
            behind[table.offsets], indices_of(valid), self.stored.place, self.at.features[self.number & 1],
            h.record_stride, [self.order[core :: h.slices] for core in range(h.slices)], h.cache_kb, h.cache_shared,
            size=self.formats.record_bytes, batch=self.settings.chunk,
        )  # fmt: skip
        return Keys(table.offsets, fetch.line_at[behind], fetch.lines)

    def _raster(self, frame, small, offsets, fetched, fetch, heads, starts, table_n, in_n):
        h, core, n = self.hardware, self.core, np.diff(offsets)
        first = frame.firsts[-1] if h.late_sort else params.CHUNK
        length = self.batch
        result = frame.raster
        hits = np.zeros((1, params.GROUPS, params.UNITS), np.uint16)
        candidates = np.zeros((1, params.GROUPS, 1), np.uint8)
        batch_at, counts = result.batch_offsets, result.counts
        if core == raster_state.CANDIDATES:
            hits, candidates = late_core.work(
                frame.formats, result, offsets, frame.features, tiles_of(self.width, self.height), self.width,
                self.height, first, length,
            )  # fmt: skip
        if small is not None:
            batch_at, counts = _small_counts(small, n, result)
        cycles = np.zeros(1, np.int64)
        if core == raster_state.SIMPLE:
            blend = counts.max(axis=2).sum(axis=1) * params.BEATS if h.charge_imbalance else _even(counts)
            cycles = blend.astype(np.int64)
            if h.raster == "groups" and h.charge_tests:
                cycles = np.maximum(cycles, _entries(fetched, batch_at, first, length) * params.GROUPS)
        if not len(counts):
            counts = np.zeros((1, params.GROUPS, params.UNITS), np.uint16)
        side = h.tile
        x = np.arange(self.columns * self.rows) % self.columns * side
        y = np.arange(self.columns * self.rows) // self.columns * side
        stride = -(-self.width * PIXEL_BYTES // LINE) * LINE
        wide, tall = np.minimum(side, self.width - x), np.minimum(side, self.height - y)
        image = self.at.image[self.number & 1]
        rows = np.stack(
            [image + y * stride + x * PIXEL_BYTES, wide * PIXEL_BYTES, np.full_like(x, stride), tall * h.charge_image],
            1,
        )
        if side == params.TILE:
            beats = np.asarray(pixel_beats(np.stack([x, y], 1), self.width, self.height), np.int64)
        else:
            beats = wide * tall // raster_state.RESOLVE
        table_start, out_start, scratch = starts
        if not h.deferred_update or h.scratch or frame.sorting in ("frozen", "background"):
            writes = np.full(len(n), -1, np.int64)
        else:
            writes = out_start
        sizes = np.array(
            [h.entry_bytes, self.formats.incoming_bytes, frame.formats.entry_bytes, self.formats.record_bytes], np.int64
        )
        return raster_state.Raster(
            core, first, length, sizes, np.asarray(offsets, np.int64), np.asarray(fetched, np.int64),
            table_start if h.late_sort else out_start, scratch, table_n if h.late_sort else n,
            in_n if h.late_sort else np.zeros_like(n), fetch.line_at, fetch.lines, heads, batch_at, hits, counts,
            candidates, cycles, writes, beats, rows, *self.lanes,
        )  # fmt: skip

    def run(self, blocks: Blocks, drawn: Drawn | None) -> tuple[int, engine.Trace]:
        """Blocks and a frame's tiles at the same time: (cycles, when it happened)."""
        h = self.hardware
        tiles = 0 if drawn is None else len(drawn.order)
        trace = engine.new_trace(tiles)
        if drawn is None:
            end = engine.only_blocks(self.cycle, blocks, self.memory, trace)
        else:
            end = engine.run(
                self.cycle, blocks, drawn.order, drawn.jobs, drawn.raster, self.memory, h.slices, h.sort_cores, trace
            )
        cycles, self.cycle = int(end) - self.cycle, int(end)
        return cycles, trace


def _even(counts: np.ndarray) -> np.ndarray:
    """Cycles of each batch if its operations were spread evenly over the SCUs."""
    return -(-counts.sum(axis=(1, 2)).astype(np.int64) * params.BEATS // params.UNITS)


def _entries(n: np.ndarray, batch_at: np.ndarray, first: int, length: int) -> np.ndarray:
    """Entries of each batch of tables of which n entries are drawn."""
    batch = np.arange(batch_at[-1]) - np.repeat(batch_at[:-1], np.diff(batch_at))
    begin = np.where(batch > 0, first + (batch - 1) * length, 0)
    most = np.where(batch > 0, length, first)
    return np.clip(np.repeat(n, np.diff(batch_at)) - begin, 0, most)


def _small_counts(small: tiles16.Tiles16, n: np.ndarray, result) -> tuple[np.ndarray, np.ndarray]:
    """(batch_at, counts [B, 1, UNITS]) of 16-pixel tiles: an SCU for each subtile.

    The share of pairs behind a subtile's end is taken from the frame as a whole.
    """
    share = result.scu_ops.sum() / max(result.pairs.sum(), 1)
    batch_at = np.concatenate((np.zeros(1, np.int64), np.cumsum(-(-n // params.CHUNK))))
    counts = np.zeros((batch_at[-1], 1, params.UNITS), np.uint16)
    tile = np.repeat(np.arange(len(n)), n)
    batch = batch_at[tile] + (np.arange(len(small.bits)) - small.offsets[tile]) // params.CHUNK
    for unit in range(params.UNITS):
        counts[:, 0, unit] = np.bincount(batch, small.bits >> unit & 1, minlength=len(counts)) * share + 0.5
    return batch_at, counts
