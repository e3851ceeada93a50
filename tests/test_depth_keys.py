"""Depth keys of every kind, and what of them fits a group of short entries."""

from __future__ import annotations

import math

import numpy as np
import pytest

from golden import formats, records
from golden.formats import REFERENCE, make
from golden.frame import Renderer
from golden.settings import parse
from tests.test_formats import ROOM, room_camera

Z = np.exp(np.random.default_rng(3).uniform(np.log(0.13), np.log(1e4), 5000))


@pytest.mark.parametrize("kind", formats.KEY_KINDS)
@pytest.mark.parametrize("bits", [16, 23, 31])
def test_keys_are_monotone_and_saturate(kind, bits):
    if kind == "half" and bits != 16:
        return
    f = make(key_kind=kind, key_bits=bits)
    key = records.depth_key(f, np.sort(Z), 100.0)
    assert (np.diff(key) >= 0).all() and key.min() >= 0 and key.max() < 1 << bits
    top = records.depth_key(f, np.array([1e30, 2.0**29, 100.0, 99.0, 0.01]), 100.0)
    assert top[0] == top[1] > top[3] and top[4] <= key[0]
    step = {"float": 2.0 ** (5 - bits), "log": 32 * math.log(2) / 2**bits, "linear": 100 / 2**bits, "half": 2.0**-10}[
        kind
    ]
    pair = np.array([50.0, 50 * (1 + 1.01 * step) if kind != "linear" else 50 + 1.01 * step])
    assert np.diff(records.depth_key(f, pair, 100.0)) >= 1


def test_a_half_key_is_the_bits_of_a_half():
    f = make(key_kind="half", key_bits=16)
    assert np.array_equal(records.depth_key(f, Z), Z.astype(np.float16).view(np.uint16))


def test_linear_keys_reach_to_the_first_frames_farthest():
    renderer = Renderer(ROOM, parse(["key_kind=linear", "key_bits=20"]))
    frame = renderer.frame(room_camera())
    depth = frame.projection.depth[frame.features.visible]
    assert renderer.far == depth.max() and frame.features.key[frame.features.visible].max() == (1 << 20) - 1
    assert frame.counters["clamped_depth"] == 0
    renderer.far = np.median(depth)
    assert renderer.frame(room_camera()).counters["clamped_depth"] == np.count_nonzero(depth > renderer.far) > 100


def test_a_group_of_short_entries_holds_the_upper_bits_of_a_long_key():
    f = make(key_bits=31)
    words = records.entries(np.array([1, 2, 3, 0x7ABCDEF7]), np.arange(4))
    drop = records.short_drop(f)
    assert drop == 3 and records.short_drop(REFERENCE) == 0
    back = records.words_from_short(records.short_bytes(words, drop), 4, drop)
    assert np.array_equal(back, records.with_group_keys(words, drop))
    assert set(records.keys_of(back).tolist()) == {0x7ABCDEF0}
