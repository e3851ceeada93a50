"""Tables and incoming lists given entry by entry: a frame whose tile t has the table and the arrivals of a recipe."""

from __future__ import annotations

import numpy as np

from golden import params
from golden.cameras.camera import Camera
from golden.hard_cases.pixels import one_a_tile
from golden.hard_cases.run import Run, Sequence
from golden.hard_cases.setting import ellipses
from golden.preprocess import Pairs, encode
from golden.records import INVALID, entries
from golden.tables import Lists


def sequence(
    run: Run, tables: list, arrivals: list, keys: np.ndarray, odd: bool, **set_keys
) -> tuple[Sequence, Camera]:
    """Frames in which tile t starts with the entries tables[t] and gets the indices arrivals[t] in its first frame.

    keys [N]: the depth key that Gaussian i has in every frame; each is drawn as a line through the row of tiles. odd:
    the first frame is an odd one, so that its first chunk is a whole one.
    """
    camera, _, _ = one_a_tile(len(tables), len(tables))
    given = ellipses(np.tile([0, 32.5], (len(keys), 1)), (1e9, 0, 0.3), 0.02)
    features = encode(run.formats, given)
    features.key[:] = keys
    lists = [np.asarray(table, np.int64) for table in tables]
    now = [_members(table, new) for table, new in zip(lists, arrivals)]
    pairs = Pairs(np.concatenate([[0], np.cumsum([part.size for part in now])]), np.concatenate(now).astype(np.int32))
    whole = {"cut_share": 1.0, "cut_angle": 180.0, "rebuild_share": "1", **set_keys}
    frames = run.given(given, features, pairs, Lists.join(lists), **whole)
    frames.renderer.number = int(odd)
    return frames, camera


def _members(table: np.ndarray, arrivals) -> np.ndarray:
    """Indices, ascending, that touch the tile: what is valid in its table and what arrives."""
    valid = table[table < INVALID] & ((1 << params.INDEX_W) - 1)
    return np.unique(np.concatenate([valid, np.asarray(arrivals, np.int64)]))


def valid(keys: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Entries of these indices, ascending by (key, index)."""
    return np.sort(entries(np.asarray(keys)[indices], np.asarray(indices, np.int64)))
