"""gs_subtile_blender: what four SCUs do with a group's lists, and when.

The arithmetic is that of subtile_compute_unit.py in 32 bits, which the compiler can vectorise. Cycles as in timing.py.
"""

from __future__ import annotations

import numba
import numpy as np

from golden import params
from golden.raster_core import subtile_compute_unit as scu
from golden.raster_core.ellipse_setup import setup
from golden.raster_core.exp2_unit import OFFSET_W, SLOPE_SHIFT, table

OP_DELAY = 2  # issue of an operation to the cycle in which its SCU takes it
CHANGE = OP_DELAY + scu.LATENCY + 1  # issue of a change of the subtile to the cycle that sees it through
NONE = -1  # no group is held
DEAD_T = 0  # here: transmittance of a pixel outside the picture, so that it counts as done

_BASE = np.array([row[0] for row in table()], np.int32)
_SLOPE = np.array([row[1] for row in table()], np.int32)
_I = np.int32
_DIST_SHIFT = params.STEP_F - params.DIST_F
_DIST_MAX = (1 << params.DIST_W) - 1
_POWER_SHIFT = 2 * params.DIST_F - params.POWER_F
_COLOUR_SHIFT = params.T_F + params.COLOUR_F - params.ACC_F


@numba.njit(cache=True)
def fresh_tile(state, x0, y0, width, height):
    """Sets state int32[SUBTILES, 4, 64] (T, red, green, blue) to that of the tile at (x0, y0) without a Gaussian."""
    for subtile in range(params.SUBTILES):
        x = x0 + (subtile & 7) * params.SUBTILE
        y = y0 + (subtile >> 3) * params.SUBTILE
        for k in range(scu.PIXELS):
            live = x + (k & 7) < width and y + (k >> 3) < height
            state[subtile, 0, k] = scu.T_ONE if live else DEAD_T
            state[subtile, 1:, k] = 0


@numba.njit(cache=True, error_model="numpy")
def blend(state, u0, v0, a, b, c, opacity, red, green, blue):
    """One Gaussian on one subtile. state int32[4, 64]: T, red, green, blue; returns the pixels blended.

    No intermediate exceeds 31 bits: alpha * T is cut in two, everything else fits as it is.
    """
    count = 0
    for k in range(scu.PIXELS):
        j = _I(k >> 3)
        i = _I(k & 7)
        u = abs(_I(_I(u0) + _I(i * _I(a)) + _I(j * _I(b))))
        v = abs(_I(_I(v0) + _I(j * _I(c))))
        um = min(_I(_I(u + _I(1 << (_DIST_SHIFT - 1))) >> _I(_DIST_SHIFT)), _I(_DIST_MAX))
        vm = min(_I(_I(v + _I(1 << (_DIST_SHIFT - 1))) >> _I(_DIST_SHIFT)), _I(_DIST_MAX))
        e = _I(_I(um * um) + _I(vm * vm))
        e = _I(_I(e + _I(1 << (_POWER_SHIFT - 1))) >> _I(_POWER_SHIFT))
        p = _I(e + _I(opacity << (params.POWER_F - params.OPACITY_F)))
        t = state[0, k]
        blended = (p <= _I(params.CUT)) & (t >= _I(params.T_STOP))
        q = min(p, _I(params.CUT))
        whole = _I(q >> _I(params.POWER_F))
        segment = _I(q >> _I(OFFSET_W)) & _I(params.EXP_SEGMENTS - 1)
        offset = q & _I((1 << OFFSET_W) - 1)
        y = _I(_BASE[segment] - _I(_I(_SLOPE[segment] * offset) >> _I(SLOPE_SHIFT)))
        y = _I(_I(_I(y << _I(1)) + _I(_I(1) << whole)) >> _I(whole + _I(1)))
        narrow = params.EXP_F - params.ALPHA_F
        alpha = min(_I(_I(y + _I(1 << (narrow - 1))) >> _I(narrow)), _I(params.ALPHA_MAX))
        low = _I(_I(_I(alpha * _I(t & _I(7))) + _I(1 << (params.ALPHA_F - 1))) >> _I(3))
        w = _I(_I(_I(alpha * _I(t >> _I(3))) + low) >> _I(params.ALPHA_F - 3))
        w = min(w, _I(t - _I(1)))
        w = w if blended else _I(0)
        half = _I(1 << (_COLOUR_SHIFT - 1))
        state[0, k] = _I(t - w)
        state[1, k] += _I(_I(_I(w * _I(red)) + half) >> _I(_COLOUR_SHIFT))
        state[2, k] += _I(_I(_I(w * _I(green)) + half) >> _I(_COLOUR_SHIFT))
        state[3, k] += _I(_I(_I(w * _I(blue)) + half) >> _I(_COLOUR_SHIFT))
        count += _I(blended)
    return count


@numba.njit(cache=True)
def all_done(state):
    """Are all pixels of the subtile done?"""
    most = _I(0)
    for k in range(scu.PIXELS):
        most = max(most, state[0, k])
    return most < params.T_STOP


@numba.njit(cache=True, error_model="numpy")
def blend_subtile(state, subtile, x0, y0, hits, mean, chol, opacity, colour, held, known_done):
    """What one SCU does with its list in a phase: (operations, blends).

    state int32[SUBTILES, 4, 64] and what the SCUs know of the tile at (x0, y0): held int64[UNITS] groups or NONE,
    known_done bool[SUBTILES]; all updated. hits int [n] Gaussians, rows of mean, chol, opacity, colour.
    """
    if len(hits) == 0 or known_done[subtile]:
        return 0, 0
    unit = subtile % params.UNITS
    group = subtile // params.UNITS
    if held[unit] != group:
        if held[unit] != NONE:  # an SCU learns that a subtile is done when it puts it out
            out = held[unit] * params.UNITS + unit
            known_done[out] = all_done(state[out])
        held[unit] = group
    x = x0 + (subtile & 7) * params.SUBTILE
    y = y0 + (subtile >> 3) * params.SUBTILE
    blends = 0
    for i in range(len(hits)):
        if (i & 7) == 0 and all_done(state[subtile]):
            break  # what is left changes nothing
        g = hits[i]
        u0, v0 = setup(chol[g, 0], chol[g, 1], chol[g, 2], mean[g, 0], mean[g, 1], x, y)
        blends += blend(
            state[subtile], u0, v0, chol[g, 0], chol[g, 1], chol[g, 2], opacity[g],
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
