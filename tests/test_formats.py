"""Number formats as values: presets, what each key changes, 32 and 64 bits, and what does not go together."""

from __future__ import annotations

import hashlib
import math
from itertools import pairwise

import numpy as np
import pytest

from golden import formats, keys, oracle, params, records, scene
from golden.cameras import default_view
from golden.cameras.camera import look_at
from golden.errors import InputError
from golden.formats import PRESETS, REFERENCE, make
from golden.frame import Renderer
from golden.preprocess import duplicate, encode, project
from golden.raster_core import exp2_unit, group_finder, pixel_blender, power_unit, subtile_blender
from golden.raster_core import subtile_compute_unit as scu
from golden.raster_core.group_test_unit import tile_bitmap
from golden.raster_core.group_tester import tile_bits
from golden.settings import Settings, parse
from tests.test_preprocess import random_scene, tilted

ROOM = scene.load("builtin:room?n=3000")
SIZE = 130, 70


def room_camera():
    eye, at, up, fovy = default_view(ROOM)
    return look_at(eye, at, up, fovy, *SIZE)


def preset(name: str, **changes) -> formats.Formats:
    return make(**PRESETS[name] | changes)


def test_the_reference_is_what_it_was():
    """Codes and pixels of two frames, as drawn when the widths were constants."""
    text = hashlib.sha256()
    renderer = Renderer(ROOM, Settings())
    for _ in range(2):
        frame = renderer.frame(room_camera())
        f = frame.features
        for part in (frame.raster.value, f.mean, f.chol, f.key, f.opacity):
            text.update(part.tobytes())
    assert text.hexdigest().startswith("a6b3f2bf082a1b73")


def test_presets_are_the_settings_of_their_name():
    assert Settings().formats() == REFERENCE == preset("reference")
    for name in PRESETS:
        assert parse([f"setting={name}"]).formats() == preset(name)
    assert parse(["setting=small", "alpha_bits=13"]).formats() == preset("small", alpha_bits=13)
    assert parse(["alpha_bits=13", "setting=small"]).formats() == preset("small")
    sizes = {name: (preset(name).entry_bytes, preset(name).record_bytes) for name in PRESETS}
    assert sizes == {"small": (5, 24), "reference": (6, 24), "wide": (7, 32)}
    assert [formats.narrow(preset(name)) for name in PRESETS] == [True, True, False]


@pytest.mark.parametrize("bits", range(8, 32))
def test_entries_are_whole_bytes_and_hold_the_key(bits):
    f = make(key_bits=bits)
    assert f.entry_w == 8 * f.entry_bytes == 1 + f.key_w + params.INDEX_W and 0 <= f.key_w - bits < 8
    words = records.entries(np.array([0, 5, (1 << bits) - 1]), np.array([7, 0, (1 << params.INDEX_W) - 1]))
    words[1] |= records.INVALID
    data = records.entry_bytes(f, words)
    assert data.size == 3 * f.entry_bytes and np.array_equal(records.entries_from_bytes(f, data), words)
    assert np.array_equal(np.argsort(records.hardware(f, words)), np.argsort(words))


@pytest.mark.parametrize("name", PRESETS)
def test_records_hold_every_field(name):
    f = preset(name)
    features = encode(f, project(random_scene(300, 5), tilted()))
    raw = records.record_bytes(f, features)
    assert raw.shape == (300, f.record_bytes)
    for i in (0, 17, 299):
        word = int.from_bytes(raw[i].tobytes(), "little")
        for field, (low, width) in formats.record_offsets(f).items():
            code = int(records.columns(f, features)[field][i])
            assert word >> low & (1 << width) - 1 == code & (1 << width) - 1 and abs(code) < 1 << width


FIELDS = {"mean_bits": "mean", "footprint_bits": "chol", "opacity_bits": "opacity", "colour_bits": "colour"}


@pytest.mark.parametrize(
    ("key", "bits"), [("mean_bits", 6), ("footprint_bits", 15), ("opacity_bits", 9), ("colour_bits", 6)]
)
def test_a_narrower_field_is_the_field_rounded_and_nothing_else(key, bits):
    seen = project(random_scene(400, 6), tilted())
    fine, coarse = (encode(make(**{key: value}), seen) for value in (keys.known(Settings)[key].default, bits))
    drop = keys.known(Settings)[key].default - bits
    for name in ("mean", "chol", "opacity", "colour", "key"):
        a, b = getattr(fine, name)[fine.visible], getattr(coarse, name)[fine.visible]
        if FIELDS[key] == name:
            assert np.abs(b - a / 2**drop).max() <= 0.5 + 2.0**-drop
            assert not np.array_equal(a, b)
        else:
            assert np.array_equal(a, b), name


def test_what_each_bit_of_the_evaluation_changes():
    """alpha, T and the accumulator change nothing else; the exponent's input follows exp_bits and opacity_bits."""
    f = make(alpha_bits=12, transmittance_bits=14, accumulator_bits=14)
    same = ("mean_w", "chol_w", "opacity_w", "colour_w", "key_w", "power_f", "cut", "exp_f", "record_bytes")
    assert all(getattr(f, name) == getattr(REFERENCE, name) for name in same)
    p = np.arange(0, REFERENCE.cut, 97)
    exact = 2.0 ** (-p / 2**REFERENCE.power_f)
    for one, worst in ((REFERENCE, 2.0**-16), (f, 2.0**-12)):
        error = np.array([exp2_unit.alpha(one, int(code)) for code in p]) / 2**one.alpha_f - np.minimum(exact, 0.99)
        assert worst / 4 < np.abs(error).max() < worst / 2 + 2.0**-12 * 0.5
    assert (f.alpha_max, f.t_stop, f.acc_w) == (round(0.99 * 2**12), math.floor(1e-4 * 2**14) + 1, 17)
    assert make(exp_bits=22).power_f == 18 and make(opacity_bits=16).power_f == 16 and make(exp_bits=17).power_f == 13
    assert make(stop_threshold=0).t_stop == 1 and make(alpha_cut=64).cut == 6 << 14


def python_pixel(f, p, t, acc, colour):
    """scu's equations in Python's unbounded integers; also the largest number on the way."""
    whole, rest = divmod(p, 1 << f.power_f)
    segment, offset = divmod(rest, 1 << f.offset_w)
    base, slope = formats.exp_table(f.exp_segments, f.exp_f)[segment]
    y = base - (slope * offset >> f.offset_w)
    y = ((y << 1) + (1 << whole)) >> (whole + 1)
    alpha = min((y + (1 << f.exp_f - f.alpha_f - 1)) >> (f.exp_f - f.alpha_f), f.alpha_max)
    w = min((alpha * t + (1 << f.alpha_f - 1)) >> f.alpha_f, t - 1)
    down = f.t_f + f.colour_f - f.acc_f
    sums = [a + ((w * c + (1 << down - 1)) >> down) for a, c in zip(acc, colour, strict=True)]
    return t - w, sums, max(slope * offset, alpha * t, *(w * c for c in colour), *sums)


def extremes() -> list[formats.Formats]:
    """The presets and formats at the ends of every key's range."""
    widest = dict(
        mean_bits=14, footprint_bits=26, opacity_bits=18, colour_bits=14, key_bits=31, alpha_bits=20,
        transmittance_bits=26, accumulator_bits=28, exp_segments=2, exp_bits=24,
    )  # fmt: skip
    return [*(preset(name) for name in PRESETS), make(**widest), make(**widest | {"exp_segments": 256})]


@pytest.mark.parametrize("f", extremes(), ids=[*PRESETS, "widest", "widest, 256 lines"])
def test_blending_is_that_of_unbounded_integers(f):
    r = np.random.default_rng(1)
    t_last = [1 << f.t_f, 1, f.t_stop]
    for n in range(3000):
        p = int(r.integers(0, f.cut + 1))
        t = t_last[n % 3] if n < 30 else int(r.integers(1, (1 << f.t_f) + 1))
        acc = [int(x) for x in r.integers(0, f.colour_max << (f.acc_f - f.colour_f) if f.acc_f > f.colour_f else 1, 3)]
        colour = [int(x) for x in r.integers(0, f.colour_max + 1, 3)]
        left, sums, largest = python_pixel(f, p, t, acc, colour)
        assert pixel_blender.blend_pixel(f, p, t, *acc, *colour) == (left, *sums)
        assert largest < 1 << 62 and max(sums) < 1 << f.acc_w + 1


@pytest.mark.parametrize("f", extremes(), ids=[*PRESETS, "widest", "widest, 256 lines"])
def test_the_fast_blender_is_the_unit(f):
    """Random layers on one subtile, in the integers that rasterise takes and in 64 bits."""
    r = np.random.default_rng(2)
    n = 200
    mean = (r.uniform(-4, 12, (n, 2)) * 2**f.mean_f).astype(np.int64)
    chol = np.column_stack([r.uniform(0.01, 0.3, n), r.uniform(-0.1, 0.1, n), r.uniform(0.01, 0.3, n)])
    chol = (chol * 2**f.chol_f).astype(np.int64)
    opacity = r.integers(0, 4 << f.opacity_f, n)
    colour = r.integers(0, f.colour_max + 1, (n, 3))
    rows = np.column_stack([mean, chol, opacity, colour])
    for drop in (f, f._replace(drop_last=1, t_stop=1 << f.t_f - 6)):
        t, acc, done = scu.fresh(drop)
        blends = scu.blend_subtile(drop, t, acc, done, 0, 0, rows, np.zeros(n, np.uint64))
        for integer in {np.int64, np.int32 if formats.narrow(drop) else np.int64}:
            state = np.zeros((params.SUBTILES, 4, 64), integer)
            subtile_blender.fresh_tile(drop, state, 0, 0, 64, 64)
            held, known = np.full(4, subtile_blender.NONE, np.int64), np.zeros(64, bool)
            hits = np.arange(n)
            found = subtile_blender.blend_subtile(drop, state, 0, 0, 0, hits, mean, chol, opacity, colour, held, known)
            assert found[1] == blends > 100
            assert np.array_equal(np.abs(state[0, 0]), t) and np.array_equal(state[0, 1:], acc)
        assert done.sum() > 5


@pytest.mark.parametrize("name", PRESETS)
def test_tests_have_no_false_negative_and_agree(name):
    f = preset(name)
    features = encode(f, project(random_scene(150, 8, terms=1), tilted(*SIZE)))
    pairs = duplicate(f, features, *SIZE)
    listed = {(t, int(i)) for t, (a, b) in enumerate(pairwise(pairs.tile_offsets)) for i in pairs.index[a:b]}
    hits = missed = 0
    for i in np.flatnonzero(features.visible):
        row = [int(v) for v in (*features.chol[i], *features.mean[i], features.opacity[i])]
        for tile, (x, y) in enumerate((x, y) for y in (0, 64) for x in (0, 64, 128)):
            bits = int(tile_bits(f, *row, x, y, *SIZE))
            assert bits == int(tile_bitmap(f, *row, x, y, *SIZE)) and (bits > 0) == ((tile, i) in listed)
            mask = group_finder.mask(f, *row, x, y, *SIZE)
            hits += bits.bit_count()
            for s in range(64):
                sx, sy = x + 8 * (s & 7), y + 8 * (s >> 3)
                if bits >> s & 1:
                    assert mask >> (s // 4) & 1
                elif sx < SIZE[0] and sy < SIZE[1]:
                    missed += int(power_unit.powers(f, *row[3:5], *row[:3], row[5], sx, sy).min() <= f.cut)
    assert hits > 300 and missed == 0


def test_wider_formats_draw_closer_to_the_oracle():
    camera, lsb = room_camera(), {}
    for name in PRESETS:
        frame = Renderer(ROOM, parse([f"setting={name}"])).frame(camera)
        tables = frame.order.offsets, records.indices_of(frame.order.words), params.TILE
        given = oracle.render_injected(frame.formats, frame.features, frame.projection, tables, *SIZE)
        lsb[name] = 255 * np.sqrt(np.mean((frame.image - given) ** 2))
    assert lsb["small"] > 4 * lsb["reference"] > 8 * lsb["wide"] > 0


@pytest.mark.parametrize(
    ("pairs", "words"),
    [
        (["alpha_bits=18"], ["alpha_bits=18 with exp_bits=18", "exp_bits above"]),
        (["accumulator_bits=28"], ["accumulator_bits=28", "less than", "28"]),
        (["exp_segments=256", "exp_bits=8", "alpha_bits=6", "opacity_bits=4"], ["exp_segments=256", "fewer than 256"]),
        (["key_kind=half"], ["key_kind=half with key_bits=23", "key_bits=16"]),
        (["key_bits=32"], ["key_bits=32", "8..31"]),
        (["footprint_bits=12"], ["13..26"]),
        (["setting=tiny"], ["small|reference|wide"]),
        (["alpha_cut=1"], ["2..16384"]),
        (["stop_rule=never"], ["blend-last|drop-last"]),
        (["bound=sphere"], ["exact|box|oriented|circle"]),
        (["exp_segments=3"], ["2|4|8"]),
    ],
)
def test_what_does_not_go_together_is_refused(pairs, words):
    with pytest.raises(InputError) as caught:
        parse(pairs)
    assert all(word in str(caught.value) for word in words), caught.value


def test_every_format_within_the_ranges_is_made_or_refused():
    r = np.random.default_rng(4)
    ranges = {
        "mean_bits": (2, 14), "footprint_bits": (13, 26), "opacity_bits": (4, 18), "colour_bits": (4, 14),
        "key_bits": (8, 31), "alpha_bits": (6, 20), "transmittance_bits": (8, 26), "accumulator_bits": (8, 28),
        "exp_bits": (8, 24),
    }  # fmt: skip
    made = 0
    for _ in range(3000):
        values = {key: int(r.integers(low, high + 1)) for key, (low, high) in ranges.items()}
        values |= {
            "exp_segments": 1 << int(r.integers(1, 9)),
            "alpha_cut": float(r.choice([2, 64, 255, 256, 1024, 16384])),
        }
        try:
            f = make(**values)
        except InputError:
            continue
        made += 1
        shifts = (f.step_f - f.dist_f, 2 * f.dist_f - f.power_f, f.exp_f - f.alpha_f, f.t_f + f.colour_f - f.acc_f)
        assert min(shifts) >= 1 and min(f.chol_f - f.edge_f - 3, f.edge_f - f.itu_f, f.power_f - f.opacity_f) >= 0
        none = ((1 << f.opacity_w) - 1) << (f.power_f - f.opacity_f)
        assert (
            f.cut + f.itu_margin < none
            and f.cut < 1 << f.power_w - 1
            and f.record_w >= sum(width for _, width in formats.record_fields(f))
        )
        assert 2 * f.dist_w + 1 < 63 and f.chol_w + f.mean_w + 3 < 63
    assert made > 1000
