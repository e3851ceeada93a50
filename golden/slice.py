"""gs_slice: when a frame's tiles are sorted, drawn and finished, in cycles equal to the RTL's.

What is computed stands beside each unit: golden/sorting_core/sort_lane.py (tables), golden/raster_core/raster_core.py
(pixels, bitmaps, tables written back). Cycle 0 is the first one in which the slice is out of reset; the host offers a
tile as soon as the one before it is taken, and takes done at once. Behind every memory port is a memory of dma.py; it
takes addresses and data at once, answers after a fixed latency and, with jitter, later by chance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np

from golden import dma, params
from golden.formats import Formats
from golden.raster_core import raster_lane
from golden.sorting_core import sort_lane
from golden.sorting_core.sort_sequencer import OUT, REGIONS

QUEUE = 2  # tile taken to its origin at the end of the tile queue
OFFER = 1  # first cycle in which the host offers a tile


class Places(NamedTuple):
    """Byte addresses of a frame of T tiles. Those of lists and pixels matter only to a memory with jitter."""

    lists: np.ndarray  # int64[T, 4] of each tile's table, incoming, scratch and out region
    feature: int = 0  # of record 0
    frame: int = 0  # of pixel (0, 0)
    stride: int = 0  # from row to row


@dataclass(frozen=True)
class SliceTimes:
    """Cycles of T tiles."""

    accepted: np.ndarray  # int64[T] the slice takes the tile
    sorted: np.ndarray  # int64[T] first cycle with its sorted table in memory
    started: np.ndarray  # int64[T] handed to the raster lane
    px_first: np.ndarray  # int64[T] first and last beat of pixels
    px_last: np.ndarray
    done: np.ndarray  # int64[T] done beat
    job: np.ndarray  # int64[T] cycles of its sort

    @property
    def cycles(self) -> int:
        """Cycles of the frame, the last tile's done beat included."""
        return int(self.done[-1]) + 1 if len(self.done) else 0


def anywhere(tiles: int) -> Places:
    """Places of a frame in which every list begins at a multiple of dma.BORDER."""
    return Places(np.zeros((tiles, len(REGIONS)), np.int64))


@numba.njit(cache=True)
def _frame(state, job, offsets, words, lists, batch_offsets, counts, tile_xy, view, latency):
    cores = params.SORT_CORES
    ports = dma.new_ports()
    result = np.zeros((6, len(job)), np.int64)
    accepted, ready, started, px_first, px_last, done = result[0], result[1], result[2], result[3], result[4], result[5]
    times = np.empty(raster_lane.TIMES_N, np.int64)
    for t in range(len(job)):
        # A lane takes a tile when the last one's table is done, which waits until the one before it has been started.
        accepted[t] = accepted[t - 1] + 1 if t else OFFER
        if t >= cores:
            accepted[t] = max(accepted[t], ready[t - cores])
        ready[t] = accepted[t] + job[t]
        if t >= cores:
            ready[t] = max(ready[t], started[t - cores] + 1)
        start = max(ready[t], accepted[t] + QUEUE)  # the lane takes it behind the last one in any case
        raster_lane.step(
            state, start, words[offsets[t] : offsets[t + 1]], lists[t, OUT], tile_xy[t, 0], tile_xy[t, 1],
            counts[batch_offsets[t] : batch_offsets[t + 1]], view, latency, ports, times,
        )  # fmt: skip
        started[t] = times[raster_lane.START]
        px_first[t] = times[raster_lane.PX_FIRST]
        px_last[t] = times[raster_lane.PX_LAST]
        done[t] = times[raster_lane.DONE]
    return result


def frame_times(
    f: Formats,
    jobs: np.ndarray,
    order: tuple[np.ndarray, np.ndarray],
    raster,
    tile_xy: np.ndarray,
    width: int,
    height: int,
    latency: dma.Latency = dma.LATENCY,
    places: Places | None = None,
) -> SliceTimes:
    """When everything happens in a frame.

    jobs int64[T]: sort_jobs's cycles of every tile; order: (offsets int64[T + 1], words int64[E]) the tables as sorted;
    raster: RasterResult of them (batch_offsets, counts); tile_xy [T, 2] in the order of the tiles.
    """
    jobs, offsets, words = (np.ascontiguousarray(x, np.int64) for x in (jobs, *order))
    places = places or anywhere(len(jobs))
    view = raster_lane.View(width, height, places.feature, places.frame, places.stride, f.entry_bytes, f.record_bytes)
    times = _frame(
        raster_lane.new_state(), jobs, offsets, words, places.lists, raster.batch_offsets, raster.counts,
        np.ascontiguousarray(tile_xy, np.int64), view, latency,
    )  # fmt: skip
    return SliceTimes(*times, jobs)


@numba.njit(cache=True)
def _jobs(table_at, table, in_at, incoming, size, firsts, lists, latency, chunk, cycles, lengths, out):
    ports = dma.new_ports()
    for t in range(len(cycles)):
        a = table[table_at[t] : table_at[t + 1]]
        b = incoming[in_at[t] : in_at[t + 1]]
        core = t % params.SORT_CORES
        cycles[t], words = sort_lane.run_job(a, b, size, firsts, lists[t], core, latency, ports, chunk)
        lengths[t] = len(words)
        start = table_at[t] + in_at[t]
        out[start : start + len(words)] = words


def sort_jobs(
    f: Formats,
    table: tuple[np.ndarray, np.ndarray],
    incoming: tuple[np.ndarray, np.ndarray],
    first: int | tuple[int, ...] = params.CHUNK,
    latency: dma.Latency = dma.LATENCY,
    places: Places | None = None,
    chunk: int = params.CHUNK,
) -> tuple[np.ndarray, list[np.ndarray]]:
    """(cycles int64[T], new tables) of all tiles' sorts. table, incoming: (offsets int64[T + 1], words int64[E]).

    first: entries of the tables' first chunk, of several passes one each; chunk: of every other chunk.
    """
    lists = [np.ascontiguousarray(x, np.int64) for x in (*table, *incoming)]
    starts = lists[0] + lists[2]
    places = places or anywhere(len(starts) - 1)
    cycles, lengths = np.zeros((2, len(starts) - 1), np.int64)
    out = np.empty(starts[-1], np.int64)
    firsts = np.atleast_1d(np.asarray(first, np.int64))
    _jobs(*lists, f.entry_bytes, firsts, places.lists, latency, chunk, cycles, lengths, out)
    return cycles, [out[start : start + n] for start, n in zip(starts, lengths, strict=False)]
