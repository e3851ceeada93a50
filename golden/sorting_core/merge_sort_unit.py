"""gs_merge_sort_unit: merges two sorted lists and drops the invalid entries (MSU+)."""

from __future__ import annotations

import numba
import numpy as np

from golden.records import INVALID


@numba.njit(inline="always", cache=True)
def takes_a(a, b, keep):
    """Is head a taken before head b? First what is to be dropped, then the smaller entry, a when they are equal."""
    return (not keep and a >= INVALID) or ((keep or b < INVALID) and a <= b)


@numba.njit(cache=True)
def merge(a, b, keep=False):
    """[n] entries of lists a and b (int64) merged as the unit takes them; without keep the invalid ones are dropped.

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


def cycles(n_a: int, n_b: int) -> int:
    """Cycles that take two lists: one a beat, one for both end beats. The output follows a cycle later."""
    return n_a + n_b + 1
