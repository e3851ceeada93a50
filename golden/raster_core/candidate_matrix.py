"""gs_candidate_matrix: masks of groups, one an entry, turned into words of one bit an entry for each group."""

from __future__ import annotations

import numba
import numpy as np

from golden import params

BLOCK = 16  # entries in a word


def words(masks: np.ndarray) -> np.ndarray:
    """[n] masks of a batch in order -> [GROUPS, ceil(n / BLOCK)]: bit i of word b is entry BLOCK*b + i, 0 from n on."""
    blocks = -(-len(masks) // BLOCK)
    bits = np.zeros((blocks * BLOCK, params.GROUPS), np.int64)
    bits[: len(masks)] = masks[:, None] >> np.arange(params.GROUPS) & 1
    return (bits.T.reshape(params.GROUPS, blocks, BLOCK) << np.arange(BLOCK)).sum(axis=2)


@numba.njit(inline="always", cache=True)
def done_cycle(last_mask):
    """First cycle in which a batch can be read whose last mask comes in cycle `last_mask`."""
    return last_mask + 1
