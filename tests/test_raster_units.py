"""Hard cases of blending and of the intersection test at the level of the units' arithmetic."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from golden.fixed import half_up
from golden.formats import COLOUR_LIMIT, REFERENCE
from golden.raster_core import exp2_unit, pixel_blender, power_unit
from golden.raster_core import subtile_compute_unit as scu
from golden.raster_core.group_test_unit import tile_bitmap
from tb.lib.footprints import COLOUR_MAX, cholesky, gaussians, mean_code, opacity_code

ONE = 1 << REFERENCE.colour_f
WHITE = (ONE, ONE, ONE)
BLACK = (0, 0, 0)
CUT_OPACITY = REFERENCE.cut >> (REFERENCE.power_f - REFERENCE.opacity_f)  # alpha at the cut in the centre
CENTRE = (4 << REFERENCE.mean_f) + (1 << (REFERENCE.mean_f - 1))


def flat(opacity: int, colour=WHITE, n: int = 1) -> np.ndarray:
    """[n, 9] layers with the same alpha at every pixel."""
    return np.tile(np.array([0, 0, 0, 0, 0, opacity, *colour], np.int64), (n, 1))


def blend(layers: np.ndarray, x0: int = 0, y0: int = 0):
    """(t [64], acc [3, 64], done [64], pixels [n] that blended) of layers on a fresh subtile."""
    state = scu.fresh(REFERENCE)
    trace = np.zeros(len(layers), np.uint64)
    scu.blend_subtile(REFERENCE, *state, x0, y0, layers, trace)
    return *state, trace


def in_lsb(acc: np.ndarray) -> np.ndarray:
    return acc * 255 / 2**REFERENCE.acc_f


# Blending


def test_s01_two_layers_at_the_clamp_are_blended_and_a_third_is_not():
    t, acc, done, trace = blend(np.concatenate([flat(0, BLACK), flat(0, WHITE, 2)]))
    assert [int(x).bit_count() for x in trace] == [64, 64, 0] and done.all()
    assert (t == 26).all() and (acc == acc[0, 0]).all()
    assert abs(in_lsb(acc[0, 0]) - 0.01 * 0.99 * 255) < 0.1


@pytest.mark.parametrize("white_first", [True, False])
def test_s02_a_thousand_faint_layers(white_first):
    layers = np.concatenate([flat(CUT_OPACITY, WHITE, 500), flat(CUT_OPACITY, BLACK, 500)])
    t, acc, _, trace = blend(layers if white_first else layers[::-1])
    want = 255 * (1 - (1 - 1 / 255) ** 500) * (1 if white_first else (1 - 1 / 255) ** 500)
    assert all(int(x).bit_count() == 64 for x in trace)
    assert np.abs(in_lsb(acc) - want).max() <= 0.25
    assert np.abs(t / 2**REFERENCE.t_f - (1 - 1 / 255) ** 1000).max() < 2e-4


def test_s03_faint_layers_run_into_the_rest_of_t_and_not_into_the_stop():
    colours = np.arange(2500) // 100 % 2 * ONE
    layers = flat(CUT_OPACITY, WHITE, 2500)
    layers[:, 6:] = colours[:, None]
    t, acc, done, trace = blend(layers)
    alpha = 2.0 ** -(REFERENCE.cut / 2**REFERENCE.power_f)
    want = 255 * np.sum(alpha * (1 - alpha) ** np.arange(2500) * (colours > 0))
    assert np.abs(in_lsb(acc) - want).max() <= 1
    rest = 127  # the largest T at which alpha * T rounds to 0: 0.12 LSB
    assert half_up(exp2_unit.alpha(REFERENCE, REFERENCE.cut) * rest, REFERENCE.alpha_f) == 0
    assert half_up(exp2_unit.alpha(REFERENCE, REFERENCE.cut) * (rest + 1), REFERENCE.alpha_f) == 1
    assert (t == rest).all() and not done.any() and int(trace[-1]).bit_count() == 64


def test_s04_white_on_white_is_white():
    for kind in ("mixed", "needle", "small"):
        layers = gaussians(1000, 3, kind=kind)
        layers[:, 6:] = ONE
        t, acc, _, _ = blend(layers)
        assert (scu.resolve(REFERENCE, acc, t, ONE) == 1 << REFERENCE.acc_f).all()


def test_s05_alpha_at_the_cut_and_at_the_clamp():
    kept = [bool(blend(flat(CUT_OPACITY + code))[3][0]) for code in (-1, 0, 1)]
    assert kept == [True, True, False]
    assert abs(2.0 ** -(REFERENCE.cut / 2**REFERENCE.power_f) * 255 - 1) < 2.0**-13  # the cut's real value is 1/255
    codes = np.arange(1 << 12)
    alphas = np.array([exp2_unit.alpha(REFERENCE, int(p)) for p in codes])
    exact = 2.0 ** (-codes / 2**REFERENCE.power_f)
    error = 2.0**-11  # of the exponential: it decides next to the clamp
    assert (alphas[exact >= 0.99 * (1 + error)] == REFERENCE.alpha_max).all()
    assert (alphas[exact < 0.99 * (1 - error)] < REFERENCE.alpha_max).all()
    assert alphas.max() == REFERENCE.alpha_max and (np.diff(alphas) <= 0).all()


def test_s06_three_opaque_layers_leave_one_code_of_t():
    t = 1 << REFERENCE.t_f
    for _ in range(3):
        t, *_ = pixel_blender.blend_pixel(REFERENCE, 0, t, 0, 0, 0, 0, 0, 0)
    assert t == 1 and abs(t / (1 << REFERENCE.t_f) - 1e-6) <= 2.0**-REFERENCE.t_f
    assert pixel_blender.blend_pixel(REFERENCE, 0, t, 0, 0, 0, 0, 0, 0)[0] == 1


def test_weights_stay_below_t_and_fit_one_bit_less():
    """The RTL gives a weight T_F bits, and looks for w = T in few low bits of T only."""
    t = np.arange(1, (1 << REFERENCE.t_f) + 1)
    w = half_up(REFERENCE.alpha_max * t, REFERENCE.alpha_f)
    assert (w <= t).all() and w.max() < (1 << REFERENCE.t_f)
    assert t[w == t].max() == (1 << (REFERENCE.alpha_f - 1)) // ((1 << REFERENCE.alpha_f) - REFERENCE.alpha_max)


def test_s07_far_pixels_are_never_blended_and_p_is_monotone():
    steps = np.concatenate(
        [np.arange(0, 1 << 22, 997), 2 ** np.arange(18, REFERENCE.step_w), [(1 << REFERENCE.step_w) - 1]]
    )
    p = np.array([power_unit.power(REFERENCE, int(u), 0, 0) for u in np.sort(steps)])
    assert (np.diff(p) >= 0).all() and (p[np.sort(steps) > 3 << REFERENCE.step_f] > REFERENCE.cut).all()
    assert all(power_unit.power(REFERENCE, int(u), 0, 0) == power_unit.power(REFERENCE, -int(u), 0, 0) for u in steps)


def test_s08_no_footprint_makes_an_exponent_negative_or_alpha_large():
    for n, row in enumerate(gaussians(3000, 5, kind="codes")):
        p = power_unit.powers(REFERENCE, *row[:6], 8 * (n % 512), 8 * (n // 512))
        floor = int(row[5]) << (REFERENCE.power_f - REFERENCE.opacity_f)
        assert (p >= floor).all()
        assert exp2_unit.alpha(REFERENCE, min(floor, REFERENCE.cut)) <= REFERENCE.alpha_max


def test_s09_every_code_of_the_exponential():
    codes = np.arange(1 << (REFERENCE.power_f + 3))
    y = np.array([exp2_unit.exp2(REFERENCE, p) for p in codes.tolist()])
    exact = 2.0 ** (REFERENCE.exp_f - codes / 2**REFERENCE.power_f)
    relative = y / exact - 1
    kept = codes <= REFERENCE.cut
    assert (np.diff(y) <= 0).all() and y.max() <= 1 << REFERENCE.exp_f
    assert abs(y[0] / 2**REFERENCE.exp_f - 1) <= 2**-12
    assert np.abs(relative[kept]).max() <= 2**-10 and abs(relative[kept].mean()) <= 2**-12
    seams = np.arange(1, 8 * REFERENCE.exp_segments) << REFERENCE.offset_w
    alpha = half_up(y, REFERENCE.exp_f - REFERENCE.alpha_f)
    assert (alpha[seams - 1] - alpha[seams]).max() <= 2 + np.ceil(
        2**REFERENCE.alpha_f * np.log(2) / 2**REFERENCE.power_f
    )


@pytest.mark.parametrize(("alpha", "n"), [(0.05, 1000), (1, 3)])
def test_s11_largest_colour_does_not_wrap(alpha, n):
    layers = flat(int(opacity_code(np.array([alpha]))[0]), (COLOUR_MAX,) * 3, n)
    t, acc, _, _ = blend(layers)
    top = scu.resolve(REFERENCE, acc, t, COLOUR_MAX)
    assert top.max() < 1 << REFERENCE.acc_w and np.abs(top / 2**REFERENCE.acc_f - COLOUR_LIMIT).max() < 1e-3
    assert (np.array([scu.to_8_bit(REFERENCE, int(x)) for x in acc.ravel()]) == 255).all()


def test_s11_many_layers_of_one_code_cannot_fill_the_head_room():
    """At most half a code of rounding per code of T that a layer takes."""
    assert (
        COLOUR_MAX * (1 << REFERENCE.t_f) * 2 ** (REFERENCE.acc_f - REFERENCE.t_f - REFERENCE.colour_f)
        + (1 << REFERENCE.t_f) / 2
        < 2**REFERENCE.acc_w
    )


def test_s12_final_rounding_is_half_up():
    for k in (0, 1, 127, 254):
        half = (2 * k + 1) * 2**REFERENCE.acc_f / (2 * 255)
        below, above = int(np.ceil(half)) - 1, int(np.ceil(half))
        assert [scu.to_8_bit(REFERENCE, below), scu.to_8_bit(REFERENCE, above)] == [k, k + 1]
    assert scu.to_8_bit(REFERENCE, 0) == 0 and scu.to_8_bit(REFERENCE, (1 << REFERENCE.acc_w) - 1) == 255


def test_pixel_words_hold_the_state():
    t, acc, done, _ = blend(gaussians(100, 6))
    t[5], done[5] = 1, 1
    for got, want in zip(scu.unpack(REFERENCE, scu.pack(REFERENCE, t, acc, done)), (t, acc, done), strict=True):
        assert (got == want).all()


# Intersection


@numba.njit(cache=True)
def needed(mean_x, mean_y, a, b, c, opacity, x0, y0):
    """64-bit bitmap of the subtiles of a tile in which the blend unit keeps a pixel."""
    bits = np.uint64(0)
    for s in range(64):
        p = power_unit.powers(REFERENCE, mean_x, mean_y, a, b, c, opacity, x0 + 8 * (s & 7), y0 + 8 * (s >> 3))
        if p.min() <= REFERENCE.cut:
            bits |= np.uint64(1) << np.uint64(s)
    return bits


@numba.njit(cache=True)
def compare(rows, x0, y0):
    """(subtiles missed, subtiles set, subtiles needed) over the Gaussians in rows, on the tile at (x0, y0)."""
    missed = hits = need = 0
    for n in range(len(rows)):
        mean_x, mean_y, a, b, c, opacity = rows[n, :6]
        got = tile_bitmap(REFERENCE, a, b, c, mean_x, mean_y, opacity, x0, y0, x0 + 64, y0 + 64)
        want = needed(mean_x, mean_y, a, b, c, opacity, x0, y0)
        for s in range(64):
            g, w = (got >> np.uint64(s)) & np.uint64(1), (want >> np.uint64(s)) & np.uint64(1)
            missed += w > g
            hits += g
            need += w
    return missed, hits, need


def rows_of(x, y, chol, alpha) -> np.ndarray:
    """[n, 6] from positions, footprints [n, 3] and opacities."""
    x, y, alpha = np.broadcast_arrays(x, y, alpha)
    chol = np.broadcast_to(chol, (x.size, 3))
    return np.column_stack([mean_code(x.ravel()), mean_code(y.ravel()), chol, opacity_code(alpha.ravel())])


# kind, and a bound just above the measured share of subtiles that are set where no pixel passes
@pytest.mark.parametrize(
    ("kind", "vain"),
    [("mixed", 5e-3), ("needle", 3.8e-3), ("huge", 3.3e-3), ("far", 2.5e-3), ("small", 1.3e-2), ("codes", 9.5e-3)],
)
def test_no_pixel_is_missed_and_hardly_a_subtile_is_set_in_vain(kind, vain):
    rows = gaussians(20_000, 31, 28, 28, kind)
    if kind == "codes":
        rows[:, :2] >>= 6  # within 128 pixels
    missed, hits, need = compare(rows, 0, 0)
    print(f"{kind}: {hits} set, {hits - need} in vain ({(hits - need) / hits:.2e})")
    assert missed == 0 and need > 1000
    assert hits - need <= vain * hits


def test_i01_ellipse_that_ends_on_a_pixel_centre():
    """Nine neighbours of the case; the unit's margin may set the tile where no pixel passes, never the reverse."""
    chol = np.rint(np.sqrt(np.log2(np.e) / 2) * 2**REFERENCE.chol_f).astype(np.int64) * np.array([1, 0, 1])
    exact = rows_of(np.array([61.5]), np.array([32.5]), chol, 0.3530083580)[0]
    rows = np.array([exact + [dx, 0, 0, 0, 0, do] for dx in (-1, 0, 1) for do in (-1, 0, 1)])
    found = [
        (int(tile_bitmap(REFERENCE, *r[2:5], *r[:2], r[5], 64, 0, 128, 64)) > 0, int(needed(*r, 64, 0)) > 0)
        for r in rows
    ]
    assert all(hit >= need for hit, need in found)
    assert {need for _, need in found} == {False, True}
    assert sum(hit > need for hit, need in found) <= 4  # counted: the margin covers these


def test_i02_the_extent_depends_on_the_opacity_and_is_not_three_sigma():
    chol = cholesky(np.array([10.0]), np.array([10.0]), np.zeros(1), low_pass=0)
    row = rows_of(np.array([33.0]), np.array([32.5]), chol, 1.0)[0]
    assert needed(*row, 64, 0) and tile_bitmap(REFERENCE, *row[2:5], *row[:2], row[5], 64, 0, 128, 64)
    faint = rows_of(np.array([33.0]), np.array([32.5]), chol, 0.3)[0]
    assert not tile_bitmap(REFERENCE, *faint[2:5], *faint[:2], faint[5], 64, 0, 128, 64)


def test_i05_needles_at_all_angles_and_shifts():
    shift = np.arange(16) / 16
    x, y, angle = (v.ravel() for v in np.meshgrid(28 + shift, 28 + shift, np.arange(16) * np.pi / 16))
    chol = cholesky(np.full(x.size, 640.0), np.full(x.size, 0.0064), angle)
    missed, hits, need = compare(rows_of(x, y, chol, 0.8), 0, 0)
    print(f"needles: {hits / need:.6f} set for one needed")
    assert missed == 0 and hits / need <= 1.0004


def test_i06_splat_between_pixel_centres_blends_nothing():
    """Its four nearest centres are 0.26 % below the cut: less than the margin, so a tile may list it in vain."""
    chol = cholesky(np.zeros(1), np.zeros(1), np.zeros(1))
    row = rows_of(np.array([64.0]), np.array([64.0]), chol, 0.0090)[0]
    listed = 0
    for x0, y0 in ((0, 0), (64, 0), (0, 64), (64, 64)):
        assert not needed(*row, x0, y0)
        listed += int(tile_bitmap(REFERENCE, *row[2:5], *row[:2], row[5], x0, y0, 128, 128)).bit_count()
    assert listed <= 4
    faint = rows_of(np.array([64.0]), np.array([64.0]), chol, 0.0088)[0]
    assert not any(
        tile_bitmap(REFERENCE, *faint[2:5], *faint[:2], faint[5], x, y, 128, 128) for x in (0, 64) for y in (0, 64)
    )
