"""How alike the tiles' lists of two frames are (paper, Figs. 6 and 7)."""

from __future__ import annotations

import numba
import numpy as np

from golden import tables
from golden.frame import Renderer
from golden.job import Job
from golden.records import indices_of
from golden.tables import Lists

KEEPING = range(50, 100, 2)  # % of a tile's Gaussians
PERCENTILES = (90, 95, 99)


def sorted_lists(renderer: Renderer, camera) -> Lists:
    """Every tile's Gaussians, exactly sorted."""
    _, features, pairs = renderer.preprocess(camera)
    none = Lists.empty(len(pairs.tile_offsets) - 1)
    everything = np.ones(len(none.lengths), bool)
    keys = features.key, features.key
    new, _ = tables.incoming(pairs, none, everything, keys, renderer.settings.capacity)
    return tables.sort(none, new, 1, tables.WHOLE)


@numba.njit(cache=True)
def compare(was_at, was, now_at, now, kept, moved):
    """kept int64[T]: Gaussians of tile t in both lists; moved: of each, how far its place among them differs.

    Returns how many of `moved` were written. was, now: indices of the Gaussians, tile after tile, in depth order.
    """
    size = 1
    for lists in (was, now):
        for index in lists:
            size = max(size, index + 1)
    here, stays, place = np.full(size, -1), np.full(size, -1), np.zeros(size, np.int64)
    n = 0
    for t in range(len(kept)):
        for index in was[was_at[t] : was_at[t + 1]]:
            here[index] = t
        rank = 0
        for index in now[now_at[t] : now_at[t + 1]]:
            if here[index] == t:
                stays[index] = t
                place[index] = rank
                rank += 1
        kept[t] = rank
        rank = 0
        for index in was[was_at[t] : was_at[t + 1]]:
            if stays[index] == t:
                moved[n] = abs(place[index] - rank)
                rank += 1
                n += 1
    return n


def measure(job: Job) -> dict:
    """Over all tiles that had a Gaussian and all pairs of frames, as JSON.

    keeping: {x: % of the tiles that keep more than x % of their Gaussians}; moved: {percentile or "largest": places}.
    """
    renderer = Renderer(job.gaussians, job.settings)
    shares, histogram = [], np.zeros(1, np.int64)
    last = None
    for camera in job.cameras:
        lists = sorted_lists(renderer, camera)
        if last is not None:
            kept = np.zeros(len(lists.lengths), np.int64)
            moved = np.zeros(len(last.words), np.int64)
            n = compare(last.offsets, indices_of(last.words), lists.offsets, indices_of(lists.words), kept, moved)
            shares.append(kept[last.lengths > 0] / last.lengths[last.lengths > 0])
            counts = np.bincount(moved[:n], minlength=len(histogram))
            counts[: len(histogram)] += histogram
            histogram = counts
        last = lists
    share = np.concatenate(shares)
    total = np.cumsum(histogram)
    places = {str(p): int(np.searchsorted(total, p / 100 * total[-1])) for p in PERCENTILES}
    return {
        "frames": len(job.cameras),
        "keeping": {str(x): 100 * float(np.mean(share > x / 100)) if share.size else None for x in KEEPING},
        "moved": {**places, "largest": len(histogram) - 1},
    }
