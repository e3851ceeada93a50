"""The tiles' tables from frame to frame: what is new, what the sorting cores make of it (docs/frames.md).

Compiled over the tiles of a frame; each tile is what the units' own functions make of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from golden import params, records
from golden.preprocess import Pairs
from golden.records import INVALID
from golden.sorting_core.merge_sort_unit import merge
from golden.sorting_core.sorting_core import sort_chunks

CHUNKS, WHOLE, AS_IT_IS = range(3)  # what is done to a table before the incoming entries are merged in


@dataclass(frozen=True)
class Lists:
    """One list of entries a tile: tile t holds words[offsets[t]:offsets[t + 1]]."""

    offsets: np.ndarray  # [T + 1] int64
    words: np.ndarray  # [E] int64 entries

    def tile(self, t: int) -> np.ndarray:
        return self.words[self.offsets[t] : self.offsets[t + 1]]

    @property
    def lengths(self) -> np.ndarray:
        """[T] int64."""
        return np.diff(self.offsets)

    @staticmethod
    def join(parts: list[np.ndarray]) -> Lists:
        offsets = np.zeros(len(parts) + 1, np.int64)
        np.cumsum([part.size for part in parts], out=offsets[1:])
        return Lists(offsets, np.concatenate(parts) if parts else np.zeros(0, np.int64))

    @staticmethod
    def empty(tiles: int) -> Lists:
        return Lists(np.zeros(tiles + 1, np.int64), np.zeros(0, np.int64))

    def without(self, dropped: np.ndarray) -> Lists:
        """The same lists, those of the tiles `dropped` (bool [T]) empty."""
        if not dropped.any():
            return self
        counts = np.where(dropped, 0, self.lengths)
        return _close_up(self.offsets[:-1], counts, self.words)


def _close_up(starts: np.ndarray, counts: np.ndarray, words: np.ndarray) -> Lists:
    """Lists of counts[t] words from starts[t] on."""
    offsets = np.zeros(len(counts) + 1, np.int64)
    np.cumsum(counts, out=offsets[1:])
    out = np.empty(offsets[-1], np.int64)
    _copy(starts, offsets, words, out)
    return Lists(offsets, out)


@numba.njit(cache=True)
def _copy(starts, offsets, words, out):
    for t in range(len(starts)):
        count = offsets[t + 1] - offsets[t]
        out[offsets[t] : offsets[t + 1]] = words[starts[t] : starts[t] + count]


@numba.njit(cache=True)
def _difference(now, members, out):
    """Elements of now (ascending) that are not in members (ascending), into out; returns how many."""
    n = k = 0
    for value in now:
        while k < members.size and members[k] < value:
            k += 1
        if k == members.size or members[k] != value:
            out[n] = value
            n += 1
    return n


@numba.njit(cache=True)
def _damaged(members, n):
    """Do indices, ascending, hold one twice or one that is not below n?"""
    for k in range(1, len(members)):
        if members[k] == members[k - 1]:
            return True
    return len(members) > 0 and members[-1] >= n


@numba.njit(cache=True, parallel=True)
def _arrivals(now_offsets, now, offsets, words, n, out, counts, damaged):
    for t in numba.prange(len(counts)):
        members = words[offsets[t] : offsets[t + 1]]
        members = np.sort(members[members < INVALID] & records.INDEX_MASK)
        damaged[t] = _damaged(members, n)
        here = now[now_offsets[t] : now_offsets[t + 1]]
        counts[t] = _difference(here, members, out[now_offsets[t] : now_offsets[t + 1]])


def arrivals(pairs: Pairs, table: Lists, n: int) -> tuple[Lists, np.ndarray]:
    """(indices, ascending, that touch a tile now and are not among the valid entries of its table; bool [T] damaged).

    A table is damaged when its valid entries name a Gaussian twice or one that is not below n.
    """
    counts = np.empty(len(table.offsets) - 1, np.int64)
    damaged = np.empty(len(counts), np.bool_)
    out = np.empty(len(pairs.index), np.int64)
    with numba.parallel_chunksize(1):
        _arrivals(pairs.tile_offsets, pairs.index, table.offsets, table.words, n, out, counts, damaged)
    return _close_up(pairs.tile_offsets[:-1], counts, out), damaged


def incoming(pairs: Pairs, new: Lists, scratch: np.ndarray, keys, capacity: int) -> tuple[Lists, int]:
    """(entries that the sorting cores insert, how many did not fit).

    A tile inserts the indices `new`, with keys[1]; a tile of `scratch` (bool [T]) all that touch it, with keys[0].
    Beyond `capacity` the nearest are kept, in order.
    """
    starts = np.where(scratch, pairs.tile_offsets[:-1], new.offsets[:-1])
    counts = np.where(scratch, np.diff(pairs.tile_offsets), new.lengths)
    offsets = np.concatenate((np.zeros(1, np.int64), np.cumsum(counts)))
    out = np.empty(offsets[-1], np.int64)
    _insert(starts, offsets, scratch, pairs.index, new.words, keys[0], keys[1], capacity, out)
    kept = np.minimum(counts, capacity)
    return _close_up(offsets[:-1], kept, out), int((counts - kept).sum())


@numba.njit(cache=True, parallel=True)
def _insert(starts, offsets, scratch, all_of, new, fresh_key, new_key, capacity, out):
    for t in numba.prange(len(starts)):
        count = offsets[t + 1] - offsets[t]
        here = out[offsets[t] : offsets[t + 1]]
        for k in range(count):
            if scratch[t]:
                index = np.int64(all_of[starts[t] + k])
                here[k] = (np.int64(fresh_key[index]) << params.INDEX_W) | index
            else:
                index = new[starts[t] + k]
                here[k] = (np.int64(new_key[index]) << params.INDEX_W) | index
        if count > capacity:
            here.sort()


def sort(table: Lists, new: Lists, first: int, how: int, chunk: int = params.CHUNK) -> Lists:
    """New tables: each tile's table sorted in chunks, as a whole or not at all, and its incoming entries merged in.

    first, chunk: entries of the first chunk and of each other one.
    """
    starts = table.offsets[:-1] + new.offsets[:-1]
    counts = np.empty(len(starts), np.int64)
    out = np.empty(len(table.words) + len(new.words), np.int64)
    with numba.parallel_chunksize(1):
        _sort(table.offsets, table.words, new.offsets, new.words, first, chunk, how, starts, counts, out)
    return _close_up(starts, counts, out)


@numba.njit(cache=True, parallel=True)
def _sort(offsets, words, new_offsets, new, first, chunk, how, starts, counts, out):
    for t in numba.prange(len(starts)):
        a = words[offsets[t] : offsets[t + 1]]
        if how == CHUNKS:
            a = sort_chunks(a, first, chunk)
        elif how == WHOLE:
            a = np.sort(a)
        merged = merge(a, np.sort(new[new_offsets[t] : new_offsets[t + 1]]))
        counts[t] = len(merged)
        out[starts[t] : starts[t] + len(merged)] = merged


def shuffle(lists: Lists, seed: tuple[int, ...]) -> Lists:
    """The same lists, each in a random order."""
    tile = np.repeat(np.arange(len(lists.lengths)), lists.lengths)
    order = np.lexsort((np.random.default_rng(seed).random(tile.size), tile))
    return Lists(lists.offsets, lists.words[order])


def renewed(table: Lists, key: np.ndarray, visible: np.ndarray) -> Lists:
    """The tables in the order that they have, the valid entries of what is in sight with the keys `key` [N].

    What went out of sight keeps its key: with the largest one it would hold up the merge behind its chunk.
    """
    words = table.words.copy()
    here = words < INVALID
    here[here] = visible[records.indices_of(words[here])]
    index = records.indices_of(words[here])
    words[here] = records.entries(key[index], index)
    return Lists(table.offsets, words)


def late_sort(merged: Lists, key: np.ndarray, first: int, chunk: int = params.CHUNK) -> Lists:
    """The lists with the keys `key` [N] of this frame, each chunk sorted by them."""
    out = np.empty(len(merged.words), np.int64)
    with numba.parallel_chunksize(1):
        _late_sort(merged.offsets, merged.words, key, first, chunk, out)
    return Lists(merged.offsets, out)


@numba.njit(cache=True, parallel=True)
def _late_sort(offsets, words, key, first, chunk, out):
    for t in numba.prange(len(offsets) - 1):
        here = words[offsets[t] : offsets[t + 1]] & records.INDEX_MASK
        for k in range(len(here)):
            here[k] |= np.int64(key[here[k]]) << params.INDEX_W
        out[offsets[t] : offsets[t + 1]] = sort_chunks(here, first, chunk)


def group_keys(written: Lists, drop: int) -> Lists:
    """Tables as they are read back from 4-byte entries; drop: records.short_drop."""
    out = np.empty(len(written.words), np.int64)
    _group_keys(written.offsets, written.words, drop, out)
    return Lists(written.offsets, out)


@numba.njit(cache=True, parallel=True)
def _group_keys(offsets, words, drop, out):
    for t in numba.prange(len(offsets) - 1):
        out[offsets[t] : offsets[t + 1]] = records.with_group_keys(words[offsets[t] : offsets[t + 1]], drop)
