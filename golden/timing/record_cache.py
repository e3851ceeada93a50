"""Which 64-byte lines the raster cores fetch for the feature records of their tables' entries (docs/traffic.md).

Records lie at `place * stride` of the feature table; a record touches one line, or two where it lies across a border.
Without a cache each entry fetches its lines. With caches (set-associative, the least recently used line goes) each
raster core has its own, or all share one, which keeps what tiles of different cores have in common; the cores then take
turns of a batch. A line that is still on its way counts as present.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from golden import params
from golden.formats import REFERENCE
from golden.timing.address_map import LINE

WAYS = 4


class Fetch(NamedTuple):
    """Lines to fetch: entry e (of all tables in order) needs lines[line_at[e] : line_at[e + 1]]."""

    line_at: np.ndarray  # int64[E + 1]
    lines: np.ndarray  # int64[..]
    asked: int  # lines that records touch
    fetched: int  # lines that were not in a cache

    @property
    def hit_rate(self) -> float:
        return 1 - self.fetched / self.asked if self.asked else 0.0


def fetch(
    offsets: np.ndarray,
    index: np.ndarray,
    place: np.ndarray,
    base: int,
    stride: int,
    visits: list[np.ndarray],
    cache_kb: int = 0,
    shared: bool = False,
    ways: int = WAYS,
    size: int = REFERENCE.record_bytes,
    batch: int = params.CHUNK,
    fetched: np.ndarray | None = None,
) -> Fetch:
    """Lines of every entry that a core visits; entries of tiles that no core visits fetch nothing.

    offsets int64[T + 1], index [E]: the Gaussians of each tile's table in drawing order; place [N]: where a Gaussian's
    record lies; base: byte address of the feature table, a multiple of LINE; visits: for each raster core its tiles in
    order; cache_kb: KB of all caches together; shared: it is one cache. size: bytes of a record; batch: entries behind
    which it is the next core's turn. fetched int64[T]: entries of each tile whose records are fetched, from its first
    on; default: all.
    """
    cores = len(visits)
    caches = 1 if shared else max(cores, 1)
    sets = cache_kb * 1024 // (LINE * ways * caches)
    if cache_kb and not sets:
        raise ValueError(f"record cache of {cache_kb} KB in {caches} parts: wants at least {ways} lines in each")
    visit_at = np.zeros(cores + 1, np.int64)
    np.cumsum([len(tiles) for tiles in visits], out=visit_at[1:])
    tiles = np.concatenate([np.asarray(tiles, np.int64) for tiles in visits]) if cores else np.zeros(0, np.int64)
    offsets = np.ascontiguousarray(offsets, np.int64)
    index = np.ascontiguousarray(index, np.int64)
    place = np.ascontiguousarray(place, np.int64)
    need = np.zeros(len(index), np.uint8)
    ends = offsets[1:] if fetched is None else offsets[:-1] + fetched
    asked = _need(offsets, ends, batch, index, place, base, stride, size, visit_at, tiles, caches, sets, ways, need)
    line_at = np.zeros(len(index) + 1, np.int64)
    _count(need, line_at)
    lines = np.empty(line_at[-1], np.int64)
    _fill(index, place, base, stride, need, line_at, lines)
    return Fetch(line_at, lines, int(asked.sum()), int(line_at[-1]))


@numba.njit(inline="always", cache=True)
def _missed(tags, row, line):
    """Looks a line up in its set, newest first, and makes it the newest; True when it was not there."""
    ways = tags.shape[1]
    at = 0
    while at < ways - 1 and tags[row, at] != line:
        at += 1
    missed = tags[row, at] != line
    for k in range(at, 0, -1):
        tags[row, k] = tags[row, k - 1]
    tags[row, 0] = line
    return missed


@numba.njit(parallel=True, cache=True)
def _need(offsets, ends, batch, index, place, base, stride, size, visit_at, tiles, caches, sets, ways, need):
    """Sets bits of need[e]: 1 the record's first line is fetched, 2 its second. Returns the lines asked for."""
    each = (len(visit_at) - 1) // caches  # cores of a cache
    asked = np.zeros(caches, np.int64)
    for cache in numba.prange(caches):
        tags = np.full((max(sets, 1), ways), -1, np.int64)
        visit = visit_at[cache * each : (cache + 1) * each].copy()  # of each core: its tile
        at = np.zeros(each, np.int64)  # and the entry in it that comes next
        busy = True
        while busy:
            busy = False
            for k in range(each):
                if visit[k] == visit_at[cache * each + k + 1]:
                    continue
                busy = True
                begin, end = offsets[tiles[visit[k]]] + at[k], ends[tiles[visit[k]]]
                stop = min(begin + batch, end)
                for e in range(begin, stop):
                    byte = base + place[index[e]] * stride
                    first = byte // LINE
                    last = (byte + size - 1) // LINE
                    bits = 0
                    for line in range(first, last + 1):
                        if sets == 0 or _missed(tags, line % sets, line):
                            bits |= 1 << (line - first)
                    need[e] = bits
                    asked[cache] += last - first + 1
                at[k] += batch
                if stop == end:
                    visit[k] += 1
                    at[k] = 0
    return asked


@numba.njit(cache=True)
def _count(need, line_at):
    for e in range(len(need)):
        line_at[e + 1] = line_at[e] + (need[e] & 1) + (need[e] >> 1)


@numba.njit(parallel=True, cache=True)
def _fill(index, place, base, stride, need, line_at, lines):
    for e in numba.prange(len(index)):
        first = (base + place[index[e]] * stride) // LINE
        at = line_at[e]
        if need[e] & 1:
            lines[at] = first
            at += 1
        if need[e] & 2:
            lines[at] = first + 1
