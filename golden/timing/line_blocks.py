"""Lines read and written in blocks, as the preprocessing agent takes them."""

from __future__ import annotations

import numba
import numpy as np

from golden.timing.address_map import LINE
from golden.timing.preprocess_lines import Blocks


def no_blocks() -> Blocks:
    """No work for the preprocessing agent."""
    none = np.zeros(0, np.int64)
    return Blocks(none, np.zeros(1, np.int64), none, np.zeros(1, np.int64), none)


def line_blocks(reads: np.ndarray, writes: np.ndarray, cycles: int, size: int = 64) -> Blocks:
    """Lines read and written in bunches of `size`, the cycles spread over them."""
    count = max(-(-len(reads) // size), -(-len(writes) // size), 1)
    cut = np.arange(count + 1)
    return Blocks(
        np.diff(cycles * cut // count), len(reads) * cut // count, reads, len(writes) * cut // count, writes
    )  # fmt: skip


@numba.njit(cache=True, parallel=True)
def in_order(at, lines):
    """Sorts each block's lines: a block is read and written region by region, which keeps rows open."""
    for b in numba.prange(len(at) - 1):
        lines[at[b] : at[b + 1]].sort()


def lines_of(starts: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """All lines of byte ranges, in order."""
    first = starts // LINE
    count = np.where(sizes > 0, (starts + sizes - 1) // LINE - first + 1, 0)
    at = np.cumsum(count) - count
    return np.arange(count.sum()) - np.repeat(at - first, count)
