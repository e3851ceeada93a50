"""What holds of any scene, camera, table and setting: each property takes what a strategy of stimulus.py makes.

No exception but InputError, no warning, no NaN; complete, unique, conserving; golden codes within half a unit of the
real values, pictures within a bound derived from them; two runs equal.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import replace

import numpy as np
from hypothesis import strategies as st

from golden import formats, oracle, params, records
from golden import settings as known_settings
from golden.errors import InputError
from golden.frame import Frame, Renderer
from golden.preprocess import Projection
from golden.preprocess.encode import opacity_none
from golden.records import indices_of
from tests.fuzz import stimulus
from tests.hard_cases.test_tables import check_invariants

LOG2E = math.log2(math.e)
SORTINGS = ["reuse"] * 4 + ["full", "hierarchical", "periodic:2", "background:1", "shuffled:3"]
PIXELS = 150  # of a picture whose error is bounded
EXP_ERROR = 2.0**-10.7  # of exp2, relative, at the reference formats


def frames(scene, path, pairs, sorting, late) -> None:
    """Any sequence of frames under any settings, twice."""
    try:
        chosen = known_settings.parse(pairs)
        runs = [Renderer(scene, chosen, sorting, late) for _ in range(2)]
    except InputError as error:
        assert "\n" not in str(error)
        return
    for camera, cut in path:
        with warnings.catch_warnings(action="error"):
            one, two = (renderer.frame(camera, cut) for renderer in runs)
        assert np.array_equal(one.order.words, two.order.words) and np.array_equal(one.raster.value, two.raster.value)
        assert one.counters == two.counters
        check_frame(one, len(scene))


def check_frame(frame: Frame, n: int) -> None:
    """Invariants of a frame of n Gaussians, whatever the settings."""
    c, raster, f = frame.counters, frame.raster, frame.formats
    assert all(isinstance(value, int) and value >= 0 for value in c.values()), c
    culled = sum(c[f"culled_{why}"] for why in ("near", "nonfinite", "alpha", "offscreen"))
    assert c["visible"] + culled == n and c["culled_range"] <= c["visible"]
    assert np.isfinite(frame.image).all()
    assert raster.value.min(initial=0) >= 0 and raster.value.max(initial=0) < 8 << f.acc_f
    assert raster.transmittance.min(initial=0) >= 0 and raster.transmittance.max(initial=0) <= 1 << f.t_f
    assert c["damaged_tiles"] == 0 and c["blends"] <= 64 * c["pairs"] <= 64 * 64 * c["entries"]
    assert (frame.order.lengths <= 1 << 20).all() and indices_of(frame.order.words).max(initial=-1) < n
    if frame.sorting not in ("frozen", "background"):
        if c["overflow"]:
            tiles = range(len(frame.order.lengths))
            assert all(np.unique(part := indices_of(frame.order.tile(t))).size == part.size for t in tiles)
        else:
            check_invariants(frame)


def accuracy(scene, camera) -> None:
    """The codes against the real values, the picture against the oracle with the same order and decisions."""
    with warnings.catch_warnings(action="error"):
        frame = Renderer(scene, known_settings.Settings()).frame(camera)
    check_codes(frame)
    assert np.isfinite(oracle.render(frame.projection, camera)).all()
    tables = frame.order.offsets, indices_of(frame.order.words), params.TILE
    limited = replace(frame.projection, colour=np.minimum(frame.projection.colour, formats.COLOUR_LIMIT))  # counted
    truth = oracle.render_injected(frame.formats, frame.features, limited, tables, camera.width, camera.height)
    assert np.isfinite(truth).all()
    rng = np.random.default_rng(len(scene))
    x, y = rng.integers(0, camera.width, PIXELS), rng.integers(0, camera.height, PIXELS)
    error = np.abs(frame.image.astype(np.float64) - truth)[y, x].max(axis=1)
    bound = bound_of(frame, limited, x, y)
    worst = int(np.argmax(error - bound))
    assert (error <= bound).all(), f"pixel {x[worst]}, {y[worst]}: off by {error[worst]}, bound {bound[worst]}"


def check_codes(frame: Frame) -> None:
    """Every field of a visible record is its real value, rounded, or at a limit that is counted."""
    f, p, bits = frame.features, frame.projection, frame.formats
    seen = f.visible
    half = 0.5 + 1e-6
    assert (np.abs(f.mean - np.ldexp(p.mean2d, bits.mean_f))[seen] <= half).all()
    a, b, c, _ = oracle._ellipses(p)
    real = np.ldexp(np.stack([a, b, c], 1)[seen] * math.sqrt(LOG2E / 2), bits.chol_f)
    assert (np.abs(f.chol[seen] - real) <= half).all()
    assert (np.abs(f.opacity[seen] + np.ldexp(np.log2(p.opacity[seen]), bits.opacity_f)) <= half).all()
    limited = np.minimum(p.colour[seen], formats.COLOUR_LIMIT)
    assert (np.abs(f.colour[seen] - np.ldexp(limited, bits.colour_f)) <= half).all()
    assert (
        np.count_nonzero((p.colour[seen] > formats.COLOUR_LIMIT + 2.0**-bits.colour_f).any(1))
        <= (frame.counters["clamped_colour"])
    )
    assert (f.opacity[~seen] == opacity_none(bits)).all()
    for name, (_, width) in formats.record_offsets(bits).items():
        code = records.columns(bits, f)[name]
        low, high = (-(1 << (width - 1)), 1 << (width - 1)) if code.min(initial=0) < 0 else (0, 1 << width)
        assert low <= code.min(initial=0) and code.max(initial=0) < high, name


def bound_of(frame: Frame, p: Projection, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Largest possible error of pixels [n], from the codes (as they are) and the roundings of the arithmetic.

    A colour is linear in each layer's alpha, with a slope of at most the range of colours R. So it is off by at most
    R times the sum of the alphas' errors, plus the largest error of a colour, plus the roundings of w and the sum.
    """
    f, bits = frame.features, frame.formats
    seen = np.flatnonzero(f.visible)
    if not len(seen):
        return np.full(len(x), 2.0**-bits.acc_f)
    px, py = x[:, None] + 0.5, y[:, None] + 0.5
    a, b, c, _ = (part[seen] for part in oracle._ellipses(p))
    dx, dy = px - p.mean2d[seen, 0], py - p.mean2d[seen, 1]
    q = (a * dx + b * dy) ** 2 + (c * dy) ** 2
    real = np.minimum(oracle.ALPHA_MAX, p.opacity[seen] * np.exp(-q / 2))
    ca, cb, cc = np.ldexp(f.chol[seen].T.astype(float), -bits.chol_f)
    mx, my = np.ldexp(f.mean[seen].T.astype(float), -bits.mean_f)
    u, v = ca * (px - mx) + cb * (py - my), cc * (py - my)
    power = u**2 + v**2 + np.ldexp(f.opacity[seen].astype(float), -bits.opacity_f)
    code = np.minimum(bits.alpha_max * 2.0**-bits.alpha_f, 2**-power)
    step = 2.0 ** -(bits.step_f + 1) + 2.0 ** -(bits.dist_f + 1)  # set-up, and what the square is of
    rounding = 2 * (np.abs(u) + np.abs(v)) * step + 2 * step**2 + 2.0 ** -(bits.power_f + 1)
    alpha = np.abs(real - code) + code * (math.log(2) * rounding + EXP_ERROR) + 2.0 ** -(bits.alpha_f + 1)
    alpha[power > bits.cut * 2.0**-bits.power_f + 2 * rounding] = 0
    layers = np.count_nonzero(alpha, axis=1)
    colour = np.ldexp(f.colour[seen].astype(float), -bits.colour_f)
    top = max(float(p.colour[seen].max()), float(colour.max()))
    off = np.abs(p.colour[seen] - colour).max()
    weights = layers * (2 * top * 2.0**-bits.t_f + 2.0 ** -(bits.acc_f + 1))
    return top * alpha.sum(axis=1) + off + weights + 2.0**-bits.acc_f + top * 2.0**-23


TARGETS = {
    "scenes": (
        frames,
        dict(
            scene=stimulus.scenes(), path=stimulus.paths(), pairs=st.just([]), sorting=st.just("reuse"),
            late=st.booleans(),
        ),
    ),
    "settings": (
        frames,
        dict(
            scene=stimulus.scenes(), path=stimulus.paths(100), pairs=stimulus.settings(),
            sorting=st.sampled_from(SORTINGS), late=st.booleans(),
        ),
    ),
    "cameras-oracle": (accuracy, dict(scene=stimulus.scenes(), camera=stimulus.cameras())),
}  # fmt: skip
