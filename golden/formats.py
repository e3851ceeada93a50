"""Number formats as values: what the golden model is called with and what the RTL's header is written from.

UQm.n is unsigned with m integer and n fraction bits, SQm.n is two's complement with one sign bit more. `make` derives
every width from a few primary values (docs/formats.md says why); PRESETS are the three complete settings.
"""

from __future__ import annotations

import math
import os
from bisect import bisect_left
from functools import cache
from itertools import pairwise
from typing import NamedTuple

from golden import params
from golden.errors import InputError

VARIABLE = "SPLATCORE_SETTING"  # environment: the preset that benches and rtl/gs_params.vh are made for
COLOUR_LIMIT = 7.5  # larger ones are clamped: the accumulator (below 8) keeps head-room for its roundings
KEY_E = 5  # exponent bits of a depth key that is a float
KEY_BIAS = 3  # the smallest key is 2**-KEY_BIAS, below the near plane
ALPHA_LIMIT = 0.99
EXP_BITS = range(8, 25)
EXP_SEGMENTS = tuple(1 << k for k in range(1, 9))
_POWER_LEAST = 8  # fraction bits of p: what gs_group_finder compares
KEY_KINDS = ("float", "log", "linear", "half")  # records.depth_key
BOUNDS = ("exact", "box", "oriented", "circle")  # golden/raster_core/bounds.py
STOP_RULES = ("blend-last", "drop-last")
HALF_BITS = 16
# Fields that the RTL has no use for
GOLDEN_ONLY = ("key_kind", "key_bits", "colour_max", "exp_at", "bound", "drop_last")


class Formats(NamedTuple):
    """Codes and bits; all but those of GOLDEN_ONLY are in rtl/gs_params.vh."""

    key_kind: int  # place in KEY_KINDS
    key_bits: int  # of a depth key
    key_w: int  # bits that hold it: what an entry of whole bytes leaves
    entry_w: int  # {invalid, key, index}: sorts as an unsigned number, invalid last
    entry_bytes: int
    mean_f: int  # SQ13.mean_f, pixels
    mean_w: int
    chol_f: int  # footprint u = a*dx + b*dy, v = c*dy in sqrt(log2) units; UQ1, SQ1, UQ1
    chol_w: int  # a and c; b has a sign bit more
    opacity_f: int  # -log2(opacity): folded into the exponent, no multiply
    opacity_w: int
    colour_f: int  # UQ3.colour_f
    colour_w: int
    colour_max: int  # the largest colour
    record_w: int  # bits of a feature record; those above its last field are zero
    record_bytes: int
    geometry_w: int  # what an ITU reads
    step_f: int  # u and v while stepped over a subtile: SQ9, set up saturated to SQ8
    step_w: int  # of SQ8 with its sign
    dist_f: int  # |u|, |v| in front of the squares, UQ2.dist_f, saturated
    dist_w: int
    power_f: int  # e = u^2 + v^2 and p = e + opacity: alpha = 2^-p
    power_w: int  # of p when all above the cut's integer bits is one bit
    cut: int  # p <= cut is kept
    itu_f: int  # |v| and the reach of a row in the intersection test, UQ2.itu_f
    edge_f: int  # u and v there, before they are narrowed
    itu_margin: int  # .power_f: no false negative
    exp_segments: int
    exp_f: int  # fraction bits of 2^-p behind the shift
    exp_at: int  # of the first segment in exp2_unit's tables
    offset_w: int  # bits of p below the segment number
    alpha_f: int  # UQ0, rounded
    alpha_max: int
    t_f: int  # transmittance UQ1; w = round(alpha*T), T -= w
    t_stop: int  # a pixel is done when T < t_stop behind a blend
    drop_last: int  # 1: the layer that would bring T below t_stop is not blended, and the pixel is done
    bound: int  # place in BOUNDS
    acc_f: int  # colour accumulator
    acc_w: int


@cache
def make(
    mean_bits: int = 10,
    footprint_bits: int = 20,
    opacity_bits: int = 13,
    colour_bits: int = 10,
    key_bits: int = 23,
    alpha_bits: int = 16,
    transmittance_bits: int = 18,
    accumulator_bits: int = 20,
    exp_segments: int = 16,
    exp_bits: int = 18,
    alpha_cut: float = 255.0,
    stop_threshold: float = 1e-4,
    key_kind: str = "float",
    stop_rule: str = "blend-last",
    bound: str = "exact",
) -> Formats:
    """Formats from primary values: fraction bits, bits of a key, 1 / the alpha cut, the transmittance that stops.

    InputError where they do not go together.
    """
    right = key_kind != "half" or key_bits == HALF_BITS
    _check(right, f"key_kind=half with key_bits={key_bits}", f"key_bits={HALF_BITS}")
    _check(exp_bits > alpha_bits, f"alpha_bits={alpha_bits} with exp_bits={exp_bits}", "exp_bits above alpha_bits")
    _check(
        accumulator_bits < transmittance_bits + colour_bits,
        f"accumulator_bits={accumulator_bits}",
        f"less than transmittance_bits + colour_bits, {transmittance_bits + colour_bits}",
    )
    entry_bytes = -(-(1 + key_bits + params.INDEX_W) // 8)
    key_w = 8 * entry_bytes - 1 - params.INDEX_W
    power_f = max(exp_bits - 4, opacity_bits, _POWER_LEAST)
    offset_w = power_f - (exp_segments.bit_length() - 1)
    _check(offset_w > 0, f"exp_segments={exp_segments}", f"fewer than {1 << power_f}, one for each power")
    dist_f = min(power_f, footprint_bits) - 1
    cut = round(math.log2(alpha_cut) * 2**opacity_bits) << (power_f - opacity_bits)
    cut_i = max(3, (cut >> power_f).bit_length())
    itu_f = min(7, footprint_bits - 7)
    edge_f = itu_f + 4
    margin = _margin(alpha_cut, dist_f, edge_f, power_f)
    opacity_w = opacity_bits + cut_i
    while ((1 << opacity_w) - 1) << (power_f - opacity_bits) <= cut + margin:
        opacity_w += 1  # the largest code is that of a Gaussian that is not there
    mean_w, chol_w, colour_w = 14 + mean_bits, 1 + footprint_bits, 3 + colour_bits
    geometry_w = 2 * mean_w + 3 * chol_w + 1 + opacity_w
    record_bytes = 8 * -(-(geometry_w + 3 * colour_w + key_w) // 64)
    return Formats(
        key_kind=KEY_KINDS.index(key_kind),
        key_bits=key_bits,
        key_w=key_w,
        entry_w=8 * entry_bytes,
        entry_bytes=entry_bytes,
        mean_f=mean_bits,
        mean_w=mean_w,
        chol_f=footprint_bits,
        chol_w=chol_w,
        opacity_f=opacity_bits,
        opacity_w=opacity_w,
        colour_f=colour_bits,
        colour_w=colour_w,
        colour_max=int(COLOUR_LIMIT * (1 << colour_bits)),
        record_w=8 * record_bytes,
        record_bytes=record_bytes,
        geometry_w=geometry_w,
        step_f=footprint_bits,
        step_w=footprint_bits + 9,
        dist_f=dist_f,
        dist_w=dist_f + 2,
        power_f=power_f,
        power_w=power_f + cut_i + 1,
        cut=cut,
        itu_f=itu_f,
        edge_f=edge_f,
        itu_margin=margin,
        exp_segments=exp_segments,
        exp_f=exp_bits,
        exp_at=(exp_bits - EXP_BITS[0]) * (2 * EXP_SEGMENTS[-1] - 2) + exp_segments - 2,
        offset_w=offset_w,
        alpha_f=alpha_bits,
        alpha_max=round(ALPHA_LIMIT * 2**alpha_bits),
        t_f=transmittance_bits,
        t_stop=math.floor(stop_threshold * 2**transmittance_bits) + 1,
        drop_last=STOP_RULES.index(stop_rule),
        bound=BOUNDS.index(bound),
        acc_f=accumulator_bits,
        acc_w=accumulator_bits + (3 if accumulator_bits >= transmittance_bits else 4),
    )


def _check(good: bool, given: str, wants: str) -> None:
    if not good:
        raise InputError(f"--set {given}: wants {wants}")


def _margin(alpha_cut: float, dist_f: int, edge_f: int, power_f: int) -> int:
    """ITU_MARGIN, .power_f: how much more u^2 + v^2 of a pixel that passes the cut may be than is seen.

    The SCU narrows |u| and |v| by up to h = 2^-(dist_f + 1), and the sum by half a code. With u^2 + v^2 up to R^2 that
    is 2 sqrt(2) R h + 2 h^2 + half a code. The test takes |v| for up to e = 0.6875 codes of edge_f too large
    (docs/raster_core/row_reach.md): 2 R e + e^2.
    """
    radius, half, edge = math.sqrt(math.log2(alpha_cut)), 2.0 ** -(dist_f + 1), 0.6875 * 2.0**-edge_f
    seen = 2 * math.sqrt(2) * radius * half + 2 * half**2 + 2.0 ** -(power_f + 1)
    return math.ceil((seen + 2 * radius * edge + edge**2) * 2**power_f) + 1


def exp_table(segments: int, fraction: int) -> list[tuple[int, int]]:
    """[segments] of (base UQ1.fraction, drop over the segment UQ0.fraction) of 2^-f, f in [0, 1): exp2_unit.py."""
    lowered = 1 - (math.log(2) / segments) ** 2 / 16
    ends = [round(lowered * 2.0 ** (fraction - i / segments)) for i in range(segments + 1)]
    return [(a, a - b) for a, b in pairwise(ends)]


def exp_clamp(f: Formats) -> int:
    """The smallest p, .power_f, with 2^-p at alpha_max or below when rounded to alpha_f: 2^-p never rises."""
    table, drop = exp_table(f.exp_segments, f.exp_f), f.exp_f - f.alpha_f

    def clear(p: int) -> bool:
        base, slope = table[p >> f.offset_w]
        line = base - (slope * (p & ((1 << f.offset_w) - 1)) >> f.offset_w)
        return (line + (1 << (drop - 1))) >> drop <= f.alpha_max

    return bisect_left(range(1 << f.power_f), True, key=clear)


PRESETS = {
    "small": {
        "mean_bits": 8,
        "footprint_bits": 14,
        "opacity_bits": 10,
        "colour_bits": 8,
        "key_bits": 15,
        "alpha_bits": 12,
        "transmittance_bits": 14,
        "accumulator_bits": 14,
        "exp_segments": 8,
        "exp_bits": 14,
    },
    "reference": {
        "mean_bits": 10,
        "footprint_bits": 20,
        "opacity_bits": 13,
        "colour_bits": 10,
        "key_bits": 23,
        "alpha_bits": 16,
        "transmittance_bits": 18,
        "accumulator_bits": 20,
        "exp_segments": 16,
        "exp_bits": 18,
    },
    "wide": {
        "mean_bits": 12,
        "footprint_bits": 24,
        "opacity_bits": 16,
        "colour_bits": 12,
        "key_bits": 31,
        "alpha_bits": 18,
        "transmittance_bits": 22,
        "accumulator_bits": 24,
        "exp_segments": 64,
        "exp_bits": 22,
    },
}
REFERENCE = make(**PRESETS["reference"])


def record_fields(f: Formats) -> tuple[tuple[str, int], ...]:
    """(name, bits) of the feature record, lowest first."""
    return (
        ("mean_x", f.mean_w),
        ("mean_y", f.mean_w),
        ("chol_a", f.chol_w),
        ("chol_b", f.chol_w + 1),
        ("chol_c", f.chol_w),
        ("opacity", f.opacity_w),
        ("red", f.colour_w),
        ("green", f.colour_w),
        ("blue", f.colour_w),
        ("key", f.key_w),
    )


def record_offsets(f: Formats) -> dict[str, tuple[int, int]]:
    """Field name -> (lowest bit, width) in the feature record."""
    offsets, at = {}, 0
    for name, width in record_fields(f):
        offsets[name] = (at, width)
        at += width
    return offsets


def narrow(f: Formats) -> bool:
    """Does every value of gs_subtile_compute_unit fit 31 bits and a sign, but for alpha * T, which is cut in two?"""
    return (
        f.step_w <= 29
        and 2 * f.dist_w <= 30
        and f.exp_f + f.offset_w - f.exp_segments.bit_length() < 30
        and f.alpha_f + f.t_f <= 34
        and f.t_f + f.colour_w <= 31
        and f.acc_w <= 31
    )


def from_environment() -> Formats:
    """The preset that the environment names; reference if it names none."""
    name = os.environ.get(VARIABLE, "reference")
    if name not in PRESETS:
        raise InputError(f"{VARIABLE}={name}: wants {', '.join(PRESETS)}")
    return make(**PRESETS[name])


BUILD = from_environment()
