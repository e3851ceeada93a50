"""Table entries and feature records as the memories hold them (docs/architecture.md, section 2)."""

from __future__ import annotations

import numpy as np

from golden import params

INDEX_MASK = (1 << params.INDEX_W) - 1
KEY_MASK = (1 << params.KEY_W) - 1
INVALID = 1 << (params.ENTRY_W - 1)
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
