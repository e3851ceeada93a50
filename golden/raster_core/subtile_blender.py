"""gs_subtile_blender: what four SCUs do with a group's lists, and when.

The arithmetic is that of subtile_compute_unit.py in the integers of the state: 32 bits, which the compiler can
vectorise, where formats.narrow says that they do, else 64. Cycles as in timing.py.
"""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.fixed import add, floor, mul, shl, sub
from golden.formats import Formats
from golden.raster_core import subtile_compute_unit as scu
from golden.raster_core.ellipse_setup import setup
from golden.raster_core.exp2_unit import BASE, SLOPE

OP_DELAY = 2  # issue of an operation to the cycle in which its SCU takes it
CHANGE = OP_DELAY + scu.LATENCY + 1  # issue of a change of the subtile to the cycle that sees it through
NONE = -1  # no group is held
DEAD_T = 0  # here: transmittance of a pixel outside the picture, so that it counts as done


@numba.njit(cache=True)
def fresh_tile(f: Formats, state, x0, y0, width, height):
    """Sets state int[SUBTILES, 4, 64] (T, red, green, blue) to that of the tile at (x0, y0) without a Gaussian."""
    for subtile in range(params.SUBTILES):
        x = x0 + (subtile & 7) * params.SUBTILE
        y = y0 + (subtile >> 3) * params.SUBTILE
        for k in range(scu.PIXELS):
            live = x + (k & 7) < width and y + (k >> 3) < height
            state[subtile, 0, k] = 1 << f.t_f if live else DEAD_T
            state[subtile, 1:, k] = 0


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def blend(f: Formats, state, u0, v0, a, b, c, opacity, red, green, blue):
    """One Gaussian on one subtile. state int[4, 64]: T, red, green, blue; returns the pixels blended.

    A pixel that is done with T still above t_stop (drop_last) has -T in place of T.

    alpha * T is cut in two, so that no intermediate exceeds 31 bits where formats.narrow holds.
    """
    word = state.dtype.type
    step, fine, code = f.step_f - f.dist_f, 2 * f.dist_f - f.power_f, f.exp_f - f.alpha_f
    narrow, product = f.t_f + f.colour_f - f.acc_f, f.alpha_f - 3
    step_half, fine_half, code_half = word(1 << (step - 1)), word(1 << (fine - 1)), word(1 << (code - 1))
    narrow_half, alpha_half = word(1 << (narrow - 1)), word(1 << (f.alpha_f - 1))
    dist_max, alpha_max = word((1 << f.dist_w) - 1), word(f.alpha_max)
    table, segment_mask, offset_mask = word(f.exp_at), word(f.exp_segments - 1), word((1 << f.offset_w) - 1)
    cut, t_stop, drop_last = word(f.cut), word(f.t_stop), f.drop_last != 0
    opacity = word(opacity << (f.power_f - f.opacity_f))
    u0, v0, a, b, c = word(u0), word(v0), word(a), word(b), word(c)
    count = word(0)
    for k in range(scu.PIXELS):
        j, i = word(k >> 3), word(k & 7)
        u = abs(add(add(u0, mul(i, a)), mul(j, b)))
        v = abs(add(v0, mul(j, c)))
        um = min(floor(add(u, step_half), step), dist_max)
        vm = min(floor(add(v, step_half), step), dist_max)
        p = add(floor(add(add(mul(um, um), mul(vm, vm)), fine_half), fine), opacity)
        t = state[0, k]
        blended = (p <= cut) & (t >= t_stop)
        q = min(p, cut)
        whole = floor(q, f.power_f)
        segment = np.uint32(add(table, floor(q, f.offset_w) & segment_mask))
        y = sub(word(BASE[segment]), floor(mul(word(SLOPE[segment]), word(q & offset_mask)), f.offset_w))
        y = floor(add(floor(shl(y, 1), whole), 1), 1)
        alpha = min(floor(add(y, code_half), code), alpha_max)
        low = floor(add(mul(alpha, word(t & 7)), alpha_half), 3)
        w = min(floor(add(mul(alpha, floor(t, 3)), low), product), sub(t, 1))
        dropped = blended & drop_last & (sub(t, w) < t_stop)
        blended &= not dropped
        w = w if blended else word(0)
        left = sub(t, w)
        state[0, k] = sub(0, left) if dropped else left
        state[1, k] = add(state[1, k], floor(add(mul(w, red), narrow_half), narrow))
        state[2, k] = add(state[2, k], floor(add(mul(w, green), narrow_half), narrow))
        state[3, k] = add(state[3, k], floor(add(mul(w, blue), narrow_half), narrow))
        count = add(count, blended)
    return count


@numba.njit(cache=True)
def all_done(f: Formats, state):
    """Are all pixels of the subtile done?"""
    most = state.dtype.type(0)
    for k in range(scu.PIXELS):
        most = max(most, state[0, k])
    return most < f.t_stop


@numba.njit(cache=True, error_model="numpy")
def blend_subtile(f: Formats, state, subtile, x0, y0, hits, mean, chol, opacity, colour, held, known_done):
    """What one SCU does with its list in a phase: (operations, blends).

    state int[SUBTILES, 4, 64] and what the SCUs know of the tile at (x0, y0): held int64[UNITS] groups or NONE,
    known_done bool[SUBTILES]; all updated. hits int [n] Gaussians, rows of mean, chol, opacity, colour.
    """
    if len(hits) == 0 or known_done[subtile]:
        return 0, 0
    unit = subtile % params.UNITS
    group = subtile // params.UNITS
    if held[unit] != group:
        if held[unit] != NONE:  # an SCU learns that a subtile is done when it puts it out
            out = held[unit] * params.UNITS + unit
            known_done[out] = all_done(f, state[out])
        held[unit] = group
    x = x0 + (subtile & 7) * params.SUBTILE
    y = y0 + (subtile >> 3) * params.SUBTILE
    blends = 0
    for i in range(len(hits)):
        if (i & 7) == 0 and all_done(f, state[subtile]):
            break  # what is left changes nothing
        g = hits[i]
        u0, v0 = setup(f, chol[g, 0], chol[g, 1], chol[g, 2], mean[g, 0], mean[g, 1], x, y)
        blends += blend(
            f, state[subtile], u0, v0, chol[g, 0], chol[g, 1], chol[g, 2], opacity[g],
            colour[g, 0], colour[g, 1], colour[g, 2],
        )  # fmt: skip
    return len(hits), blends


@numba.njit(inline="always", cache=True)
def turn(cycle, unit, origin):
    """First cycle from `cycle` on in which a unit may issue; unit 0 may in cycle `origin`."""
    return cycle + ((unit - (cycle - origin)) & (params.UNITS - 1))


@numba.njit(cache=True)
def phase_end(start, group, counts, held, origin):
    """Last cycle of a phase that starts in cycle `start`: all is issued, every change of a subtile has gone through.

    counts [UNITS] operations; held int64[UNITS]: groups or NONE, updated.
    """
    end = start + 1
    for unit in range(params.UNITS):
        count = np.int64(counts[unit])
        if count > 0:
            issue = turn(start + 1, unit, origin)
            change = held[unit] != group
            held[unit] = group
            end = max(end, issue + params.BEATS * (count + change - 1) + 1)
            if change:
                end = max(end, issue + CHANGE)
    return end


@numba.njit(cache=True)
def store_end(start, held, origin):
    """Last cycle of the store behind a tile's last phase, from cycle `start` on: the pixel buffers are complete."""
    end = start
    for unit in range(params.UNITS):
        if held[unit] != NONE:
            end = max(end, turn(start, unit, origin) + CHANGE)
    return end
