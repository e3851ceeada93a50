"""gs_slice: when a frame's tiles are sorted, drawn and finished, in cycles equal to the RTL's.

What is computed stands beside each unit: golden/sorting_core/sort_lane.py (tables), golden/raster_core/raster_core.py
(pixels, bitmaps, tables written back). Cycle 0 is the first one in which the slice is out of reset; the host offers a
tile as soon as the one before it is taken, and takes done at once; every memory port has the same fixed latency.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from golden import dma, params
from golden.raster_core import raster_lane, timing
from golden.records import indices_of
from golden.sorting_core import sort_lane

QUEUE = 2  # tile taken to its origin at the end of the tile queue
OFFER = 1  # first cycle in which the host offers a tile


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
    exact: bool  # see raster_lane.exact

    @property
    def cycles(self) -> int:
        """Cycles of the frame, the last tile's done beat included."""
        return int(self.done[-1]) + 1 if len(self.done) else 0


@numba.njit(cache=True)
def _frame(job, n, batch_offsets, counts, beats, read, write, state, accepted, ready, started, px, done):
    cores = params.SORT_CORES
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
        part = counts[batch_offsets[t] : batch_offsets[t + 1]]
        raster_lane.step(state, start, n[t], part, beats[t], read, write, times)
        started[t] = times[raster_lane.START]
        px[t, 0] = times[raster_lane.PX_FIRST]
        px[t, 1] = times[raster_lane.PX_LAST]
        done[t] = times[raster_lane.DONE]


def frame_times(
    jobs: np.ndarray,
    order: tuple[np.ndarray, np.ndarray],
    raster,
    tile_xy: np.ndarray,
    width: int,
    height: int,
    latency: dma.Latency = dma.LATENCY,
    feature_addr: int = 0,
) -> SliceTimes:
    """When everything happens in a frame.

    jobs int64[T]: sort_lane.job's cycles of every tile; order: (offsets int64[T + 1], words int64[E]) the tables as
    sorted; raster: RasterResult of them (batch_offsets, counts); tile_xy [T, 2] in the order of the tiles.
    """
    offsets, words = order
    count = len(jobs)
    accepted, ready, started, done = np.zeros((4, count), np.int64)
    px = np.zeros((count, 2), np.int64)
    _frame(
        np.asarray(jobs, np.int64), np.diff(offsets), raster.batch_offsets, raster.counts,
        timing.pixel_beats(np.asarray(tile_xy, np.int64), width, height), latency.read, latency.write,
        raster_lane.new_state(), accepted, ready, started, px, done,
    )  # fmt: skip
    exact = raster_lane.exact(indices_of(words), feature_addr)
    return SliceTimes(accepted, ready, started, px[:, 0], px[:, 1], done, np.asarray(jobs, np.int64), exact)


def sort_jobs(
    table: tuple[np.ndarray, np.ndarray],
    incoming: tuple[np.ndarray, np.ndarray],
    first: int = params.CHUNK,
    latency: dma.Latency = dma.LATENCY,
) -> tuple[np.ndarray, list[np.ndarray]]:
    """(cycles int64[T], new tables) of all tiles' sorts. table, incoming: (offsets int64[T + 1], words int64[E])."""
    (table_at, table_words), (in_at, in_words) = table, incoming
    jobs = [
        sort_lane.job(table_words[table_at[t] : table_at[t + 1]], in_words[in_at[t] : in_at[t + 1]], first, latency)
        for t in range(len(table_at) - 1)
    ]
    return np.array([cycles for cycles, _ in jobs], np.int64), [words for _, words in jobs]
