"""Table entries and feature records as the memories hold them (docs/architecture.md, section 2)."""

from __future__ import annotations

import numba
import numpy as np

from golden import params

INDEX_MASK = (1 << params.INDEX_W) - 1
KEY_MASK = (1 << params.KEY_W) - 1
INVALID = 1 << (params.ENTRY_W - 1)
SHORT_BYTES = 4  # {spare, invalid, index}: the entry of a table that is sorted late
SHORT_GROUP = 4  # short entries that hold one key in their spare bits
_SPARE_AT = params.INDEX_W + 1
_SPARE_W = 8 * SHORT_BYTES - _SPARE_AT
KEY_MAX_DEPTH = 2.0 ** ((1 << params.KEY_E) - params.KEY_BIAS)


def entries(keys: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """[n] int64 valid entries {invalid = 0, key, index}."""
    return (keys.astype(np.int64) << params.INDEX_W) | indices.astype(np.int64)


def keys_of(words: np.ndarray) -> np.ndarray:
    """[n] int64 depth keys of entries."""
    return (words >> params.INDEX_W) & KEY_MASK


def indices_of(words: np.ndarray) -> np.ndarray:
    """[n] int64 Gaussian indices of entries."""
    return words & INDEX_MASK


def depth_key(z: np.ndarray) -> np.ndarray:
    """Depths (float64, > 0.125) to KEY_E.KEY_M float keys, truncated; monotone; above the range it saturates."""
    bits = np.ascontiguousarray(z, dtype=np.float64).view(np.int64)
    key = (bits >> (52 - params.KEY_M)) - ((1023 - params.KEY_BIAS) << params.KEY_M)
    return np.clip(key, 0, KEY_MASK)


def entry_bytes(words: np.ndarray) -> np.ndarray:
    """[n] int64 entries -> [n * 6] uint8, little endian, packed."""
    return words.astype("<i8").view(np.uint8).reshape(-1, 8)[:, : params.ENTRY_BYTES].ravel()


def entries_from_bytes(data: np.ndarray) -> np.ndarray:
    """[n * 6] uint8 -> [n] int64 entries."""
    wide = np.zeros((data.size // params.ENTRY_BYTES, 8), np.uint8)
    wide[:, : params.ENTRY_BYTES] = data.reshape(-1, params.ENTRY_BYTES)
    return wide.view("<i8").ravel().astype(np.int64)


@numba.njit(cache=True)
def with_group_keys(words):
    """[n] int64 entries of one table, each with the key of the last valid entry of its group (0: there is none)."""
    out = np.empty_like(words)
    for start in range(0, len(words), SHORT_GROUP):
        key = 0
        for word in words[start : start + SHORT_GROUP]:
            if word < INVALID:
                key = word >> params.INDEX_W
        for k in range(start, min(start + SHORT_GROUP, len(words))):
            out[k] = (words[k] & (INVALID | INDEX_MASK)) | (key << params.INDEX_W)
    return out


def short_bytes(words: np.ndarray) -> np.ndarray:
    """[n] int64 entries of one table -> uint8 short entries, little endian, filled up to whole groups.

    Entry k of a group holds bits 7k to 7k + 6 of the group's key, bit 0 lowest; see `with_group_keys`.
    """
    whole = np.full(-(-len(words) // SHORT_GROUP) * SHORT_GROUP, INVALID, np.int64)
    whole[: len(words)] = words
    key = keys_of(with_group_keys(whole))
    spare = (key >> _SPARE_W * (np.arange(len(whole)) % SHORT_GROUP)) & ((1 << _SPARE_W) - 1)
    short = (spare << _SPARE_AT) | ((whole >= INVALID).astype(np.int64) << params.INDEX_W) | indices_of(whole)
    return short.astype("<u4").view(np.uint8)


def words_from_short(data: np.ndarray, n: int) -> np.ndarray:
    """uint8 short entries -> [n] int64 entries with the keys of their groups."""
    short = data.view("<u4").astype(np.int64).reshape(-1, SHORT_GROUP)
    key = ((short >> _SPARE_AT) << _SPARE_W * np.arange(SHORT_GROUP)).sum(axis=1, keepdims=True)
    invalid = (short >> params.INDEX_W) & 1
    return ((invalid * INVALID) | (key << params.INDEX_W) | indices_of(short)).ravel()[:n]


def columns(features) -> dict[str, np.ndarray]:
    """Field name (RECORD_FIELDS of params.py) -> [n] codes of features.mean, .chol, .opacity, .colour and .key."""
    values = (*features.mean.T, *features.chol.T, features.opacity, *features.colour.T, features.key)
    return dict(zip((name for name, _ in params.RECORD_FIELDS), values))


def record_bytes(features) -> np.ndarray:
    """Codes of n Gaussians (see `columns`) to their records: [n, 24] uint8, little endian."""
    fields = columns(features)
    n = len(features.opacity)
    words = np.zeros((n, params.RECORD_W // 64), np.uint64)
    for name, (low, width) in params.record_offsets().items():
        code = fields[name].astype(np.int64).astype(np.uint64) & np.uint64((1 << width) - 1)
        word, shift = divmod(low, 64)
        words[:, word] |= code << np.uint64(shift)
        if shift + width > 64:
            words[:, word + 1] |= code >> np.uint64(64 - shift)
    return words.astype("<u8").view(np.uint8).reshape(n, params.RECORD_BYTES)
