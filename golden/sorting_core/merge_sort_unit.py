"""gs_merge_sort_unit: merges two sorted lists and drops the invalid entries (MSU+)."""

from __future__ import annotations

import numba
import numpy as np

from golden.records import INVALID


@numba.njit(inline="always", cache=True)
def takes_a(a, b, keep):
    """Is head a taken before head b? The smaller entry, a when they are equal, but first what is to be dropped."""
    first = 0 if keep else INVALID
    return (a ^ first) <= (b ^ first)


@numba.njit(cache=True)
def merge(a, b, keep=False):
    """[n] entries of two lists a and b (int64) merged as the unit does; without keep the invalid ones are dropped.

    Without keep it equals the plain merge of what is valid in a with what is valid in b, sorted or not.
    """
    out = np.empty(len(a) + len(b), np.int64)
    i = j = n = 0
    while i < len(a) or j < len(b):
        if i < len(a) and (j == len(b) or takes_a(a[i], b[j], keep)):
            entry = a[i]
            i += 1
        else:
            entry = b[j]
            j += 1
        if keep or entry < INVALID:
            out[n] = entry
            n += 1
    return out[:n]


def merge4(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, keep: bool = False) -> np.ndarray:
    """[n] entries of the unit's four lists; a and b are parts of one list, put in order before anything is dropped."""
    return merge(merge(a, b, True), merge(c, d, keep), keep)


def cycles(n: int) -> int:
    """Cycles that take lists of n entries in all: one each, one for the end beats. The output follows a cycle later."""
    return n + 1
