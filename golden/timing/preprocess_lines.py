"""What blocks of 256 Gaussians read and write, line by line: the loops of preprocess_engine.py."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from golden.timing.address_map import (
    BLOCK,
    COLOUR_BYTES,
    HEAD_BYTES,
    LINE,
    MEMBER_BYTES,
    MEMBER_TILES,
    SPHERE_BYTES,
    START_BYTES,
    Formats,
)
from golden.timing.combine import append, flush, new_buffer

CULL_CYCLES = 1  # of a block that is culled whole
KINDS = ("positions", "rest", "harmonics", "colours", "membership", "clusters", "records", "incoming")
_POSITIONS, _REST, _HARMONICS, _COLOURS, _MEMBERS, _CLUSTERS, _RECORDS, _INCOMING = range(len(KINDS))


class Blocks(NamedTuple):
    """B blocks in order; those that are culled whole have CULL_CYCLES cycles and next to no lines."""

    cycles: np.ndarray  # int64[B]
    read_at: np.ndarray  # int64[B + 1]
    read: np.ndarray  # int64[..] lines
    write_at: np.ndarray  # int64[B + 1]
    write: np.ndarray  # int64[..] lines


class Who(NamedTuple):
    order: np.ndarray  # int64[N] Gaussian at each place
    alive: np.ndarray  # bool[B] blocks that are not culled whole
    rest: np.ndarray  # bool[N], by Gaussian: parameters beside the position are read
    visible: np.ndarray  # bool[N]
    fresh: np.ndarray  # bool[N] colour is evaluated
    old: np.ndarray  # bool[N] colour is that of the last frame
    record: np.ndarray  # bool[N] a record is written: of the visible, and of who was, one that no test hits
    tested: np.ndarray  # int64[N] tiles tested


class Steps(NamedTuple):
    """Formats as numbers, bytes unless said otherwise."""

    position: int
    rest_step: int
    rest: int
    harmonics: int
    split: bool
    membership: bool
    clusters: bool
    record: int
    record_size: int
    entry: int
    artifact: bool
    combine: int  # lines
    colour: int  # cycles
    units: int


class Bases(NamedTuple):
    """Regions with the generation that is read (in) and written (out)."""

    positions: int
    rest: int
    harmonics: int
    colours: int
    clusters: int
    starts_in: int
    starts_out: int
    members_in: int
    members_out: int
    features: int


def room(formats: Formats, n: int, blocks: int, entries: int, extra: int) -> Blocks:
    """Blocks with more room than their lines can need."""
    f = formats
    members = blocks * 6 + ((HEAD_BYTES + LINE) * blocks + MEMBER_BYTES * n + extra) // LINE
    read = n * (f.position_stride + f.rest_step + f.harmonics_bytes + COLOUR_BYTES) // LINE + 8 * (blocks + n)
    write = n * (f.record_stride + COLOUR_BYTES) // LINE + 4 * n + 3 * entries + f.combine_lines
    at = np.zeros((2, blocks + 1), np.int64)
    lines = np.empty(read + members, np.int64), np.empty(write + members, np.int64)
    return Blocks(np.zeros(blocks, np.int64), at[0], lines[0], at[1], lines[1])


@numba.vectorize(cache=True)
def extra_bytes(tiles):
    """Bytes of membership data beyond MEMBER_BYTES of a Gaussian whose rectangle holds so many tiles."""
    return max(tiles - MEMBER_TILES + 7, 0) // 8


@numba.njit(cache=True)
def _range(out, at, begin, end, after):
    """Appends the lines of bytes begin .. end - 1 that lie behind line `after`; (next place, last line of all)."""
    for line in range(max(begin // LINE, after + 1), -(-end // LINE)):
        out[at] = line
        at += 1
        after = line
    return at, after


@numba.njit(cache=True)
def _chosen(out, at, base, step, size, order, chosen, first, end):
    """Appends the lines of `size` bytes at base + place * step of the chosen Gaussians at places first .. end - 1."""
    after = -1
    for p in range(first, end):
        if chosen[order[p]]:
            at, after = _range(out, at, base + p * step, base + p * step + size, after)
    return at


@numba.njit(cache=True)
def _read(b, who, steps, bases, last, out, at, after, lines):
    """Lines that block b reads, from place `at` of `out` on; after: last line read of the membership data."""
    n = len(who.order)
    first, end = b * BLOCK, min((b + 1) * BLOCK, n)
    begin = at
    if steps.clusters and b % (LINE // SPHERE_BYTES) == 0:
        at, _ = _range(out, at, bases.clusters + SPHERE_BYTES * b, bases.clusters + SPHERE_BYTES * b + 1, -1)
    if steps.membership and b % (LINE // START_BYTES) == 0:
        at, _ = _range(out, at, bases.starts_in + START_BYTES * b, bases.starts_in + START_BYTES * b + 1, -1)
    lines[_CLUSTERS, 0] += at - begin
    if who.alive[b]:
        begin = at
        step = steps.position
        at, _ = _range(out, at, bases.positions + first * step, bases.positions + end * step, -1)
        lines[_POSITIONS, 0] += at - begin
        begin = at
        at = _chosen(out, at, bases.rest, steps.rest_step, steps.rest, who.order, who.rest, first, end)
        lines[_REST, 0] += at - begin
        if steps.split:
            begin = at
            size = steps.harmonics
            at = _chosen(out, at, bases.harmonics, size, size, who.order, who.fresh, first, end)
            lines[_HARMONICS, 0] += at - begin
            begin = at
            at = _chosen(out, at, bases.colours, COLOUR_BYTES, COLOUR_BYTES, who.order, who.old, first, end)
            lines[_COLOURS, 0] += at - begin
    if steps.membership and last[1][b] > last[0][b]:
        begin = at
        stop = last[1][b] if who.alive[b] else last[0][b] + HEAD_BYTES
        at, after = _range(out, at, bases.members_in + last[0][b], bases.members_in + stop, after)
        lines[_MEMBERS, 0] += at - begin
    return at, after


@numba.njit(cache=True)
def _write(b, who, steps, bases, by_place, buffer, list_at, members, cursor, out, at, lines):
    """Lines that block b writes, from place `at` of `out` on; cursor: bytes of membership data so far."""
    n = len(who.order)
    first, end = b * BLOCK, min((b + 1) * BLOCK, n)
    final = end == n
    begin = at
    at = _chosen(out, at, bases.features, steps.record, steps.record_size, who.order, who.record, first, end)
    lines[_RECORDS, 1] += at - begin
    if steps.split:
        begin = at
        at = _chosen(out, at, bases.colours, COLOUR_BYTES, COLOUR_BYTES, who.order, who.fresh, first, end)
        lines[_COLOURS, 1] += at - begin
    size = 0
    for p in range(first, end):
        if who.visible[who.order[p]]:
            size += MEMBER_BYTES + extra_bytes(who.tested[who.order[p]])
    members[0][b] = members[1][b] = cursor
    if steps.membership:
        begin = at
        opened = cursor // LINE * LINE  # the line that the blocks before have not filled
        if size:
            cursor += HEAD_BYTES + size
            members[1][b] = cursor
        closed = (cursor + LINE - 1 if final else cursor) // LINE * LINE
        at, _ = _range(out, at, bases.members_out + opened, bases.members_out + closed, -1)
        lines[_MEMBERS, 1] += at - begin
        begin = at
        if final or (b + 1) % (LINE // START_BYTES) == 0:
            at, _ = _range(out, at, bases.starts_out + START_BYTES * b, bases.starts_out + START_BYTES * b + 1, -1)
        lines[_CLUSTERS, 1] += at - begin
    begin = at
    for k in range(by_place[0][first], by_place[0][end]):
        at = append(buffer, out, at, by_place[1][k], list_at, steps.entry, steps.artifact)
    if final and not steps.artifact:
        at = flush(buffer, out, at, list_at)
    lines[_INCOMING, 1] += at - begin
    return at, cursor


@numba.njit(cache=True)
def _cycles(b, who, steps):
    """Three kinds of units work on different blocks at a time, so the slowest kind counts.

    A projection unit takes a Gaussian a cycle, a colour unit one in steps.colour cycles, a duplication unit tests a
    tile a cycle, all tiles of one Gaussian in the same unit.
    """
    first, end = b * BLOCK, min((b + 1) * BLOCK, len(who.order))
    if not who.alive[b]:
        return CULL_CYCLES
    tests = longest = coloured = 0
    for g in who.order[first:end]:
        if who.visible[g]:
            tests += who.tested[g]
            longest = max(longest, who.tested[g])
            coloured += who.fresh[g]
    units = steps.units
    projected, coloured = -(-(end - first) // units), -(-coloured * steps.colour // units)
    return max(max(projected, coloured), max(-(-tests // units), longest))


@numba.njit(cache=True)
def fill(who, steps, bases, last, by_place, list_at, members, out, lines):
    """Fills members, out and lines."""
    buffer = new_buffer(len(list_at) - 1, steps.combine)
    read = written = cursor = 0
    after = -1
    for b in range(len(who.alive)):
        read, after = _read(b, who, steps, bases, last, out.read, read, after, lines)
        written, cursor = _write(
            b, who, steps, bases, by_place, buffer, list_at, members, cursor, out.write, written, lines
        )
        out.cycles[b] = _cycles(b, who, steps)
        out.read_at[b + 1] = read
        out.write_at[b + 1] = written
