"""The Verilated slice as a Python object: a flat memory, frames of tiles in it, and what came out, with cycles."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from golden import dma, params, records
from golden.cosim import build
from golden.formats import Formats
from golden.slice import Places

SLOT = 64  # bytes: tables begin at multiples of it
STEP = 50_000  # cycles between two looks at the progress
RUNNING, FINISHED = 0, 1


class CosimError(RuntimeError):
    """The RTL hangs, or breaks a rule of its memory ports."""


@dataclass(frozen=True)
class Progress:
    cycle: int
    tiles: int  # handed to the slice
    drawn: int  # all pixels sent
    done: int  # finished, responses included
    entries: int  # tested


@dataclass(frozen=True)
class SliceFrame:
    """One frame as the slice made it. T tiles in the order they were given, E entries of the new tables."""

    offsets: np.ndarray  # int64[T + 1]
    words: np.ndarray  # int64[E] the new tables, as written back
    bitmaps: np.ndarray  # uint64[E] subtiles hit, bit 8*row + column
    value: np.ndarray  # int32[H, W, 3] UQ3.ACC_F
    rgb8: np.ndarray  # uint8[H, W, 3], from memory
    blends: np.ndarray  # int64[T]
    accepted: np.ndarray  # int64[T] cycle in which the slice took the tile
    sorted: np.ndarray  # int64[T] first cycle with its sorted table in memory
    px_first: np.ndarray  # int64[T] cycles of its first and last beat of pixels
    px_last: np.ndarray
    done: np.ndarray  # int64[T] cycle of its done beat
    counters: dict[str, int]  # cycles; beats and bursts of every memory port

    @property
    def cycles(self) -> int:
        """Cycles of the frame, the last tile's done beat included."""
        return self.counters["cycles"]


def _library(formats: Formats, rtl: list[Path] | None) -> ctypes.CDLL:
    library = ctypes.CDLL(str(build.library(formats, rtl)))
    pointer, i64, u64 = ctypes.c_void_p, ctypes.c_int64, ctypes.c_uint64
    for name, result, arguments in (
        ("new", pointer, (pointer, u64)),
        ("free", None, (pointer,)),
        ("timing", None, (pointer, *[u64] * 6)),
        ("start", None, (pointer, pointer, pointer, i64, *[pointer] * 8, i64, pointer)),
        ("run", ctypes.c_int, (pointer, i64)),
        ("progress", None, (pointer, pointer)),
        ("counters", None, (pointer, pointer)),
        ("late", u64, (u64, u64, u64, u64)),
        ("message", ctypes.c_char_p, (pointer,)),
    ):
        function = getattr(library, f"slice_{name}")
        function.restype, function.argtypes = result, arguments
    return library


def _at(array: np.ndarray) -> int:
    return array.ctypes.data


def _align(n: int, to: int = SLOT) -> int:
    return -(-n // to) * to


class Slice:
    """gs_slice and its memory.

    Low level: fill `memory`, `start` a frame, `run` until it has ended, read the arrays. `frame` does it all.
    latency: of the memory. stall: not 0 pauses every handshake at random, drawn from it; the results are the same, the
    cycles are not. rtl: other sources than those of the project, as of build.library.
    """

    def __init__(
        self,
        formats: Formats,
        latency: dma.Latency = dma.LATENCY,
        stall: int = 0,
        watchdog: int = 200_000,
        size: int = 1 << 20,
        rtl: list[Path] | None = None,
    ):
        self.formats = formats
        self._library = _library(formats, rtl)
        self._slice = None
        self._timing = (*latency, stall, watchdog)
        self.memory = np.zeros(0, np.uint8)
        self.resize(size)

    def resize(self, size: int) -> None:
        """A memory of `size` bytes, with nothing in it, and a slice in reset."""
        if size > 1 << 32:
            raise CosimError(f"the frame needs {size} bytes of memory, the slice addresses {1 << 32}")
        self.close()
        self.memory = np.zeros(size, np.uint8)
        self._slice = self._library.slice_new(_at(self.memory), size)
        self._library.slice_timing(self._slice, *self._timing)

    def close(self) -> None:
        if self._slice is not None:
            self._library.slice_free(self._slice)
            self._slice = None

    def __del__(self) -> None:
        if hasattr(self, "_slice"):
            self.close()

    def start(self, config: np.ndarray, tiles: np.ndarray) -> None:
        """Reset the slice and give it a frame.

        config int64[9]: width, height, background red, green, blue, addresses of features and picture, stride, entries
        of the tables' first chunk. tiles int64[T, 8]: x, y, table address and entries, incoming address and entries,
        scratch address, out address.
        """
        self.config = np.ascontiguousarray(config, np.int64)
        self.tiles = np.ascontiguousarray(tiles, np.int64)
        count, room = len(self.tiles), int(self.tiles[:, [3, 5]].sum())
        times = np.zeros((7, count), np.int64)
        self.accepted, self.sorted, self.px_first, self.px_last, self.done, self.done_n, self.blends = times
        self.bitmaps = np.zeros(room, np.uint64)
        self.value = np.zeros((int(config[1]), int(config[0]), 3), np.int32)
        arrays = (*times, self.bitmaps)
        self._library.slice_start(
            self._slice, _at(self.config), _at(self.tiles), count, *map(_at, arrays), room, _at(self.value)
        )

    def run(self, max_cycles: int) -> Progress | None:
        """Simulate up to max_cycles; None when the frame has ended. CosimError when nothing moves any more."""
        status = self._library.slice_run(self._slice, max_cycles)
        if status not in (RUNNING, FINISHED):
            raise CosimError(self._library.slice_message(self._slice).decode())
        return None if status == FINISHED else self.progress()

    def places(self) -> Places:
        """Where the frame that was started last lies in memory."""
        feature, frame, stride = map(int, self.config[5:8])
        return Places(np.ascontiguousarray(self.tiles[:, [2, 4, 6, 7]]), feature, frame, stride)

    def progress(self) -> Progress:
        numbers = np.zeros(5, np.int64)
        self._library.slice_progress(self._slice, _at(numbers))
        return Progress(*map(int, numbers))

    def counters(self) -> dict[str, int]:
        numbers = np.zeros((dma.PORTS, 2), np.int64)
        self._library.slice_counters(self._slice, _at(numbers))
        result = {"cycles": self.progress().cycle}
        names = [f"{port}_read" for port in dma.READ_PORTS] + [f"{port}_write" for port in dma.WRITE_PORTS]
        for name, (beats, bursts) in zip(names, numbers.tolist(), strict=True):
            result[f"{name}_beats"] = beats
            result[f"{name}_bursts"] = bursts
        return result

    def frame(
        self,
        features,
        table: tuple[np.ndarray, np.ndarray],
        incoming: tuple[np.ndarray, np.ndarray],
        tile_xy: np.ndarray,
        width: int,
        height: int,
        background: tuple[int, int, int] = (0, 0, 0),
        first: int = params.CHUNK,
        watch: Callable[[Progress], None] | None = None,
    ) -> SliceFrame:
        """One frame from start to end.

        features: arrays mean [N, 2], chol [N, 3], opacity [N], colour [N, 3], key [N] of record codes. table, incoming:
        (offsets int64[T + 1], words int64[E]). tile_xy [T, 2]: pixel origins, in the order of the tiles. first: entries
        of the tables' first chunk (sorting_core.first_length). watch is called now and then.
        """
        config, tiles = self.place(features, table, incoming, tile_xy, width, height, background, first)
        self.start(config, tiles)
        while (progress := self.run(STEP)) is not None:
            if watch:
                watch(progress)
        return self._unload()

    def place(self, features, table, incoming, tile_xy, width, height, background, first):
        """Places a frame in memory, which grows when it has to; returns (config, tiles) for `start`."""
        data = records.record_bytes(self.formats, features).ravel()
        (table_at, table_words), (in_at, in_words) = table, incoming
        table_n, in_n = np.diff(table_at), np.diff(in_at)
        stride = _align(4 * width, SLOT)
        sizes = [
            (n * self.formats.entry_bytes + SLOT - 1) // SLOT * SLOT for n in (table_n, in_n, in_n, table_n + in_n)
        ]
        places, end = [], 0
        for size in sizes:
            places.append(end + np.concatenate([[0], np.cumsum(size)[:-1]]).astype(np.int64))
            end += int(size.sum())
        feature_at, picture_at = end, end + _align(data.size)
        total = picture_at + stride * height
        if total > self.memory.size:
            self.resize(_align(total, 1 << 16))
        self.memory[feature_at : feature_at + data.size] = data
        self.memory[picture_at:total] = 0
        for place, at, words in ((places[0], table_at, table_words), (places[1], in_at, in_words)):
            for t, start in enumerate(place):
                part = records.entry_bytes(self.formats, np.asarray(words[at[t] : at[t + 1]], np.int64))
                self.memory[start : start + part.size] = part
        config = np.array([width, height, *background, feature_at, picture_at, stride, first], np.int64)
        xy = np.asarray(tile_xy, np.int64)
        return config, np.stack([xy[:, 0], xy[:, 1], places[0], table_n, places[1], in_n, places[2], places[3]], 1)

    def _unload(self) -> SliceFrame:
        width, height, picture_at, stride = (int(self.config[k]) for k in (0, 1, 6, 7))
        offsets = np.concatenate([[0], np.cumsum(self.done_n)]).astype(np.int64)
        parts = [
            records.entries_from_bytes(self.formats, self.memory[at : at + n * self.formats.entry_bytes])
            for at, n in zip(self.tiles[:, 7].tolist(), self.done_n.tolist(), strict=True)
        ]
        picture = self.memory[picture_at : picture_at + stride * height].reshape(height, stride)
        return SliceFrame(
            offsets=offsets,
            words=np.concatenate(parts) if parts else np.zeros(0, np.int64),
            bitmaps=self.bitmaps[: offsets[-1]].copy(),
            value=self.value,
            rgb8=picture[:, : 4 * width].reshape(height, width, 4)[:, :, :3].copy(),
            blends=self.blends,
            accepted=self.accepted,
            sorted=self.sorted,
            px_first=self.px_first,
            px_last=self.px_last,
            done=self.done,
            counters=self.counters(),
        )
