"""The write-combining buffer in front of the incoming lists: one open line a tile, the longest unused one goes first.

A line is written when it is full, when its place is needed for another tile, and at the end of the frame. A line that
is not full is written with byte masks: that costs a write and no read, and another write when the rest is there.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from golden.timing.address_map import LINE


class Buffer(NamedTuple):
    """S lines for T tiles."""

    tile: np.ndarray  # int64[S] whose line it is, -1: free
    used: np.ndarray  # int64[S] when it was appended to last
    slot: np.ndarray  # int64[T] where the tile's open line is, -1: nowhere
    filled: np.ndarray  # int64[T] bytes of the tile's list so far
    clock: np.ndarray  # int64[1] entries appended


@numba.njit(cache=True)
def new_buffer(tiles, slots):
    return Buffer(
        np.full(slots, -1, np.int64), np.zeros(slots, np.int64), np.full(tiles, -1, np.int64),
        np.zeros(tiles, np.int64), np.zeros(1, np.int64),
    )  # fmt: skip


@numba.njit(cache=True)
def append(buffer, out, at, tile, list_at, size, artifact):
    """Appends an entry of `size` bytes to a tile's list at byte list_at[tile]; writes lines to out from place `at` on.

    artifact: every entry writes its line twice and one of the tile's first line, as the paper's simulator counts.
    Returns the next place in out.
    """
    begin = list_at[tile] + buffer.filled[tile]
    buffer.filled[tile] += size
    if artifact:
        out[at] = out[at + 1] = begin // LINE
        out[at + 2] = list_at[tile] // LINE
        return at + 3
    buffer.clock[0] += 1
    end = begin + size
    slot = buffer.slot[tile]
    if slot < 0:
        slot = np.argmin(buffer.used)
        evicted = buffer.tile[slot]
        if evicted >= 0:
            out[at] = (list_at[evicted] + buffer.filled[evicted]) // LINE
            at += 1
            buffer.slot[evicted] = -1
        buffer.tile[slot] = tile
        buffer.slot[tile] = slot
    buffer.used[slot] = buffer.clock[0]
    if end // LINE > begin // LINE:
        out[at] = begin // LINE
        at += 1
        if end % LINE == 0:
            buffer.tile[slot] = -1
            buffer.used[slot] = 0
            buffer.slot[tile] = -1
    return at


@numba.njit(cache=True)
def flush(buffer, out, at, list_at):
    """Writes every open line; returns the next place in out."""
    for tile in buffer.tile:
        if tile >= 0:
            out[at] = (list_at[tile] + buffer.filled[tile]) // LINE
            at += 1
    return at
