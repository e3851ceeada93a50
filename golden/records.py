"""Table entries and feature records, here and as the memories hold them (docs/architecture.md, section 2).

Here an entry is {invalid[62], key, index[23:0]} in int64 whatever bits its key has: the same order as in hardware,
where the invalid bit is next to the key's field.
"""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.formats import KEY_BIAS, KEY_E, KEY_KINDS, Formats, record_fields, record_offsets

INDEX_MASK = (1 << params.INDEX_W) - 1
INVALID = 1 << 62
SHORT_BYTES = 4  # {spare, invalid, index}: the entry of a table that is sorted late
SHORT_GROUP = 4  # short entries that hold one key in their spare bits
_SPARE_AT = params.INDEX_W + 1
_SPARE_W = 8 * SHORT_BYTES - _SPARE_AT
FLOAT, LOG, LINEAR, HALF = range(len(KEY_KINDS))
LINEAR_NEAR = 0.2  # as the cameras' near plane
_SHORT_KEY_W = SHORT_GROUP * _SPARE_W  # bits of a key that a group holds
KEY_MAX_DEPTH = 2.0 ** ((1 << KEY_E) - KEY_BIAS)


def entries(keys: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """[n] int64 valid entries {invalid = 0, key, index}."""
    return (keys.astype(np.int64) << params.INDEX_W) | indices.astype(np.int64)


def keys_of(words: np.ndarray) -> np.ndarray:
    """[n] int64 depth keys of entries."""
    return (words & ~INVALID) >> params.INDEX_W


def indices_of(words: np.ndarray) -> np.ndarray:
    """[n] int64 Gaussian indices of entries."""
    return words & INDEX_MASK


def key_range(f: Formats, far: float) -> tuple[float, float]:
    """(least depth, first depth beyond) that keys tell apart; far: the largest depth of a linear key."""
    ranges = {LINEAR: (LINEAR_NEAR, np.nextafter(far, np.inf)), HALF: (2.0**-14, 65520.0)}
    return ranges.get(f.key_kind, (2.0**-KEY_BIAS, KEY_MAX_DEPTH))


def depth_key(f: Formats, z: np.ndarray, far: float = 0.0) -> np.ndarray:
    """[n] float64 depths to [n] int64 keys of f.key_kind, truncated (half: rounded); outside their range they saturate.

    far: the largest depth of a linear key.
    """
    z = np.ascontiguousarray(z, dtype=np.float64)
    low, high = key_range(f, far)
    if f.key_kind == HALF:
        return np.clip(z, 0, 65504).astype(np.float16).view(np.uint16).astype(np.int64)
    if f.key_kind == FLOAT:
        mantissa = f.key_bits - KEY_E
        key = (z.view(np.int64) >> (52 - mantissa)) - ((1023 - KEY_BIAS) << mantissa)
        return np.clip(key, 0, (1 << f.key_bits) - 1)
    z = np.maximum(z, low)
    share = (z - low) / (high - low) if f.key_kind == LINEAR else np.log2(z / low) / np.log2(high / low)
    return np.minimum(share * (1 << f.key_bits), (1 << f.key_bits) - 1).astype(np.int64)


def hardware(f: Formats, words: np.ndarray) -> np.ndarray:
    """[n] int64 entries -> the words of entry_w bits that the hardware sorts."""
    return (words & ~INVALID) | ((words >= INVALID).astype(np.int64) << (f.entry_w - 1))


def entries_of(f: Formats, words: np.ndarray) -> np.ndarray:
    """The inverse of `hardware`."""
    invalid = 1 << (f.entry_w - 1)
    return (words & (invalid - 1)) | (((words & invalid) != 0) * INVALID)


def entry_bytes(f: Formats, words: np.ndarray) -> np.ndarray:
    """[n] int64 entries -> [n * entry_bytes] uint8, little endian, packed."""
    return hardware(f, words).astype("<i8").view(np.uint8).reshape(-1, 8)[:, : f.entry_bytes].ravel()


def entries_from_bytes(f: Formats, data: np.ndarray) -> np.ndarray:
    """[n * entry_bytes] uint8 -> [n] int64 entries."""
    wide = np.zeros((data.size // f.entry_bytes, 8), np.uint8)
    wide[:, : f.entry_bytes] = data.reshape(-1, f.entry_bytes)
    return entries_of(f, wide.view("<i8").ravel().astype(np.int64))


@numba.njit(cache=True)
def with_group_keys(words, drop=0):
    """[n] int64 entries of one table, each with the key of the last valid entry of its group (0: there is none).

    drop: low bits of the key that a group has no room for (`short_drop`); they are 0."""
    out = np.empty_like(words)
    for start in range(0, len(words), SHORT_GROUP):
        key = 0
        for word in words[start : start + SHORT_GROUP]:
            if word < INVALID:
                key = word >> (params.INDEX_W + drop) << drop
        for k in range(start, min(start + SHORT_GROUP, len(words))):
            out[k] = (words[k] & (INVALID | INDEX_MASK)) | (key << params.INDEX_W)
    return out


def short_drop(f: Formats) -> int:
    """Low bits of a key that four short entries cannot hold."""
    return max(f.key_bits - _SHORT_KEY_W, 0)


def short_bytes(words: np.ndarray, drop: int = 0) -> np.ndarray:
    """[n] int64 entries of one table -> uint8 short entries, little endian, filled up to whole groups.

    Entry k of a group holds bits 7k to 7k + 6 of the group's key, bit 0 lowest; see `with_group_keys`.
    """
    whole = np.full(-(-len(words) // SHORT_GROUP) * SHORT_GROUP, INVALID, np.int64)
    whole[: len(words)] = words
    key = keys_of(with_group_keys(whole, drop)) >> drop
    spare = (key >> _SPARE_W * (np.arange(len(whole)) % SHORT_GROUP)) & ((1 << _SPARE_W) - 1)
    short = (spare << _SPARE_AT) | ((whole >= INVALID).astype(np.int64) << params.INDEX_W) | indices_of(whole)
    return short.astype("<u4").view(np.uint8)


def words_from_short(data: np.ndarray, n: int, drop: int = 0) -> np.ndarray:
    """uint8 short entries -> [n] int64 entries with the keys of their groups."""
    short = data.view("<u4").astype(np.int64).reshape(-1, SHORT_GROUP)
    key = ((short >> _SPARE_AT) << _SPARE_W * np.arange(SHORT_GROUP)).sum(axis=1, keepdims=True) << drop
    invalid = (short >> params.INDEX_W) & 1
    return ((invalid * INVALID) | (key << params.INDEX_W) | indices_of(short)).ravel()[:n]


def columns(f: Formats, features) -> dict[str, np.ndarray]:
    """Field name (formats.record_fields) -> [n] codes of features.mean, .chol, .opacity, .colour and .key."""
    values = (*features.mean.T, *features.chol.T, features.opacity, *features.colour.T, features.key)
    return dict(zip((name for name, _ in record_fields(f)), values))


def record_bytes(f: Formats, features) -> np.ndarray:
    """Codes of n Gaussians (see `columns`) to their records: [n, record_bytes] uint8, little endian."""
    fields = columns(f, features)
    n = len(features.opacity)
    words = np.zeros((n, f.record_w // 64), np.uint64)
    for name, (low, width) in record_offsets(f).items():
        code = fields[name].astype(np.int64).astype(np.uint64) & np.uint64((1 << width) - 1)
        word, shift = divmod(low, 64)
        words[:, word] |= code << np.uint64(shift)
        if shift + width > 64:
            words[:, word + 1] |= code >> np.uint64(64 - shift)
    return words.astype("<u8").view(np.uint8).reshape(n, f.record_bytes)
