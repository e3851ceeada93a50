"""gs_batch_buffer: a table cut into batches, and when they are loaded and written back.

Cycles are named as in timing.py.
"""

from __future__ import annotations

import numba
import numpy as np

from golden import params, records
from golden.formats import Formats

BANKS = 2  # batches that are fetched or worked on at once


def batches(n: int) -> list[tuple[int, int]]:
    """(first entry, entries) of each batch of a table of n; the last one has less than CHUNK, maybe none."""
    return [(first, min(params.CHUNK, n - first)) for first in range(0, n + 1, params.CHUNK)]


def updated(words: np.ndarray, keys: np.ndarray, hit: np.ndarray) -> np.ndarray:
    """[n] entries with their new keys, invalid where not hit."""
    return records.entries(keys, records.indices_of(words)) | np.where(hit, 0, records.INVALID)


def blocks(f: Formats, words: np.ndarray) -> list[tuple[int | None, int, int]]:
    """A table's beats (word, len, last) of the block stream; the word of an empty block is None."""
    out = []
    for first, n in batches(len(words)):
        last = int(n < params.CHUNK)
        out += [(int(word), n, last) for word in records.hardware(f, words[first : first + n])] or [(None, 0, last)]
    return out


@numba.njit(cache=True)
def load(fill, arrivals, requests):
    """Cycle behind the last of len(requests) entries, taken from cycle `fill` on, one a cycle.

    Fills requests: each request leaves one cycle behind its entry.
    """
    for k in range(len(requests)):
        fill = max(fill, arrivals[k]) + 1
        requests[k] = fill
    return fill


@numba.njit(inline="always", cache=True)
def loaded(fill, n, record, before):
    """Cycle from which a batch is loaded: its end is known, its records are there, and the one before is loaded."""
    whole = max(fill, before)
    return max(whole, record + 1) + 1 if n > 0 else whole + 1


@numba.njit(inline="always", cache=True)
def write_back(read, n):
    """(first beat, last beat) of a batch whose first slot is read in cycle `read`. Behind the last it is written."""
    return read + 2, read + max(n, 1) + 1
