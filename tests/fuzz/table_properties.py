"""What holds of any table, in any disorder, and of the golden units on any words and records."""

from __future__ import annotations

import warnings
from types import SimpleNamespace

import numpy as np
from hypothesis import strategies as st

from golden import params, records, tables
from golden.formats import BUILD
from golden.frame import tiles_of
from golden.preprocess import Pairs
from golden.raster_core.raster_core import rasterise
from golden.records import INDEX_MASK, INVALID, indices_of
from golden.sorting_core import sorting_core
from golden.tables import Lists
from tb.lib.footprints import gaussians

KEY_MASK = (1 << BUILD.key_bits) - 1
KINDS = ["mixed", "needle", "huge", "far", "small", "codes"]


@st.composite
def lists(draw, most: int = 1500) -> Lists:
    """Entries of 1 to 5 tiles: random keys or few equal ones, sorted, reversed or not, with holes and duplicates."""
    rng = np.random.default_rng(draw(st.integers(0, 1 << 32)))
    parts = []
    for _ in range(draw(st.integers(1, 5))):
        n = draw(st.sampled_from([0, 1, 127, 128, 129, 255, 256, 257, 513]) | st.integers(0, most))
        keys = rng.integers(0, draw(st.sampled_from([1, 4, KEY_MASK])) + 1, n)
        index = rng.integers(0, INDEX_MASK + 1, n) if draw(st.booleans()) else rng.permutation(max(n, 1))[:n]
        words = records.entries(keys, index)
        order = draw(st.sampled_from(["random", "sorted", "reversed", "nearly"]))
        if order != "random":
            words = np.sort(words)[:: -1 if order == "reversed" else 1]
        if order == "nearly":
            words = words[np.argsort(np.arange(n) + rng.normal(0, 20, n))]
        holes = rng.random(n) < draw(st.sampled_from([0.0, 0.1, 1.0]))
        parts.append(np.where(holes, words | INVALID, words))
    return Lists.join(parts)


def sorting(table: Lists, new: Lists, number: int) -> None:
    """Nothing lost, nothing made; in order after ceil(2N/C) frames without arrivals."""
    count = min(len(table.lengths), len(new.lengths))
    table, new = (Lists.join([part.tile(t) for t in range(count)]) for part in (table, new))
    new = Lists(new.offsets, new.words & ~INVALID)
    merged = tables.sort(table, new, sorting_core.first_length(number), tables.CHUNKS)
    whole = tables.sort(table, new, 0, tables.WHOLE)
    for t in range(count):
        there = np.concatenate([table.tile(t)[table.tile(t) < INVALID], new.tile(t)])
        assert np.array_equal(np.sort(merged.tile(t)), np.sort(there))
        assert np.array_equal(whole.tile(t), np.sort(there))
    frames = -(-2 * int(merged.lengths.max(initial=0)) // params.CHUNK)
    for k in range(frames):
        merged = tables.sort(merged, Lists.empty(count), sorting_core.first_length(number + 1 + k), tables.CHUNKS)
    for t in range(count):
        assert (np.diff(merged.tile(t)) >= 0).all()
        assert np.array_equal(
            records.entries_from_bytes(BUILD, records.entry_bytes(BUILD, table.tile(t))), table.tile(t)
        )
        short = records.words_from_short(records.short_bytes(table.tile(t)), len(table.tile(t)))
        assert np.array_equal(short, records.with_group_keys(table.tile(t)))


def membership(table: Lists, now: Lists) -> None:
    """What is incoming is the difference of two sets; damage is told exactly."""
    count = min(len(table.lengths), len(now.lengths))
    table, now = (Lists.join([part.tile(t) for t in range(count)]) for part in (table, now))
    here = [np.unique(indices_of(now.tile(t))) for t in range(count)]
    listed = Lists.join(here)
    n = int(np.median(indices_of(table.words))) if table.words.size else 0
    new, damaged = tables.arrivals(Pairs(listed.offsets, listed.words.astype(np.int32)), table, n)
    for t in range(count):
        members = indices_of(table.tile(t)[table.tile(t) < INVALID])
        assert np.array_equal(new.tile(t), np.setdiff1d(here[t], members))
        assert damaged[t] == (members.size > np.unique(members).size or members.max(initial=-1) >= n)


def raster(table: Lists, kind: str, seed: int, width: int, height: int, first: int) -> None:
    """Any record codes in any order: values in range, weights that add up to 1, bitmaps that agree with the marks."""
    xy = tiles_of(width, height)
    codes = gaussians(200, seed, kind=kind)
    key = np.random.default_rng(seed).integers(0, KEY_MASK + 1, 200)
    features = SimpleNamespace(mean=codes[:, :2], chol=codes[:, 2:5], opacity=codes[:, 5], colour=codes[:, 6:], key=key)
    parts = [table.tile(t % len(table.lengths)) for t in range(len(xy))]
    order = Lists.join([(part & ~INDEX_MASK) | (part & INDEX_MASK) % 200 for part in parts])
    with warnings.catch_warnings(action="error"):
        result = rasterise(BUILD, (order.offsets, order.words), features, xy, width, height, (0, 512, 1024), first)
    t = result.transmittance
    assert t.min() > 0 and t.max() <= 1 << BUILD.t_f
    assert result.value.min() >= 0 and result.value.max() < 8 << BUILD.acc_f
    assert np.array_equal(result.words_out >= INVALID, result.bitmaps == 0)
    assert np.array_equal(
        result.words_out & ~INVALID, records.entries(key[indices_of(order.words)], indices_of(order.words))
    )
    assert (result.scu_ops <= result.pairs).all() and (result.blends <= 64 * result.scu_ops).all()
    one = 1 << BUILD.colour_f
    features.colour = np.full_like(codes[:, 6:], one)
    white = rasterise(BUILD, (order.offsets, order.words), features, xy, width, height, (one, one, one), first)
    assert (white.value == 1 << BUILD.acc_f).all()


SEED = st.integers(0, 1 << 32)
SIDE = st.sampled_from([1, 8, 63, 64, 65]) | st.integers(1, 130)
TARGETS = {
    "sorting": (sorting, dict(table=lists(), new=lists(), number=st.integers(0, 3))),
    "membership": (membership, dict(table=lists(), now=lists())),
    "raster": (
        raster,
        dict(
            table=lists(400), kind=st.sampled_from(KINDS), seed=SEED, width=SIDE, height=SIDE,
            first=st.integers(1, params.CHUNK),
        ),
    ),
}  # fmt: skip
