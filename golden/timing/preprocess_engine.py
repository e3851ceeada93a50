"""The preprocessing engine: cycles and memory lines of each block of 256 Gaussians (docs/traffic.md).

A block in memory order is read, projected, coloured and listed before it is written; lines that neighbours share are
read and written once. What the units compute: golden/preprocess.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numba
import numpy as np

from golden import params
from golden.preprocess.projection import ALPHA_CUT
from golden.timing.address_map import BLOCK, LINE, Formats, Regions
from golden.timing.clusters import Store, seen
from golden.timing.combine import append, flush, new_buffer

if TYPE_CHECKING:
    from golden.frame import Frame

UNITS = 4  # projection, colour and duplication units each (Neo, Table 1)
CULL_CYCLES = 1  # a block that is culled whole
KINDS = ("positions", "rest", "harmonics", "old colours", "membership", "clusters", "records", "incoming")
_POSITIONS, _REST, _HARMONICS, _OLD, _MEMBERS, _CLUSTERS, _RECORDS, _INCOMING = range(len(KINDS))
HEAD_BYTES = 32  # of a block's membership data: one bit a Gaussian, visible or not
MEMBER_BYTES = 8  # of a visible Gaussian: the rectangle of its tiles in 24 bits, then one bit a tile
MEMBER_TILES = 40  # that fit into those


class Blocks(NamedTuple):
    """B blocks in order; those that are culled whole have CULL_CYCLES cycles and next to no lines."""

    cycles: np.ndarray  # int64[B]
    read_at: np.ndarray  # int64[B + 1]
    read: np.ndarray  # int64[..] lines
    write_at: np.ndarray  # int64[B + 1]
    write: np.ndarray  # int64[..] lines


@dataclass(frozen=True)
class Members:
    """What the membership data of a frame say, for the next frame."""

    visible: np.ndarray  # [N] bool, by Gaussian
    begin: np.ndarray  # int64[B] bytes of each block's data from the start of the region
    end: np.ndarray  # int64[B]; begin where nothing of the block is visible


@dataclass(frozen=True)
class Preprocessed:
    blocks: Blocks
    members: Members
    lines: np.ndarray  # int64[len(KINDS), 2] lines read and written of each kind


def preprocess(
    stored: Store,
    formats: Formats,
    at: Regions,
    frame: Frame,
    last: Members | None,
    number: int,
    lists: tuple[np.ndarray, np.ndarray, np.ndarray],
    units: int = UNITS,
) -> Preprocessed:
    """One frame.

    last: of the frame before; None when there is none or its tables are not used. number: the frame's, chooses between
    two generations of a region. lists: (starts int64[T + 1] byte addresses (address_map.list_starts), offsets
    int64[T + 1], index [E]): the Gaussians that preprocessing lists for each tile, in any order.
    """
    n = len(stored.order)
    visible = frame.features.visible
    before = np.zeros(n, np.bool_) if last is None else last.visible
    blocks = stored.blocks
    none = np.zeros(blocks, np.int64)
    every = formats.colour_every
    fresh = visible & ((np.arange(n) % every == number % every) | ~before)
    if formats.clusters:
        alive = seen(frame.camera, stored.centre, stored.spread, stored.block_reach)
    else:
        alive = np.ones(blocks, np.bool_)
    needs_rest = seen(frame.camera, stored.means, np.zeros(n), stored.reach) if formats.reach else visible
    tiles_tested = tiles_in_box(frame, formats.tile)
    by_place = _by_place(lists[1], lists[2], stored.place, n)
    this = number & 1
    entries = len(lists[2])
    extra = int(_extra(tiles_tested).sum())
    size = _bound(formats, n, blocks, entries, extra)
    out = Blocks(
        np.zeros(blocks, np.int64), np.zeros(blocks + 1, np.int64), np.empty(size[0], np.int64),
        np.zeros(blocks + 1, np.int64), np.empty(size[1], np.int64),
    )  # fmt: skip
    members = Members(visible, np.zeros(blocks, np.int64), np.zeros(blocks, np.int64))
    lines = np.zeros((len(KINDS), 2), np.int64)
    numbers = np.array(
        [formats.position_stride, formats.rest_step, formats.rest_bytes, formats.harmonics_bytes, formats.split,
         formats.membership, formats.clusters, formats.record_stride, formats.incoming_bytes,
         formats.incoming_lines == "artifact", formats.combine_lines, colour_cycles(formats.degree), units]
    )  # fmt: skip
    bases = np.array(
        [at.positions, at.rest, at.harmonics, at.features[1 - this], at.members[1 - this], at.members[this],
         at.blocks[1 - this], at.blocks[this], at.clusters, at.features[this]]
    )  # fmt: skip
    _blocks(
        stored.order, visible, before, fresh, needs_rest, alive, tiles_tested, by_place,
        none if last is None else last.begin, none if last is None else last.end, np.asarray(lists[0], np.int64),
        numbers, bases, members.begin, members.end, out, lines,
    )  # fmt: skip
    read, write = out.read[: out.read_at[-1]], out.write[: out.write_at[-1]]
    return Preprocessed(out._replace(read=read, write=write), members, lines)


def colour_cycles(degree: int) -> int:
    """Cycles of a colour unit for one Gaussian: a coefficient of three channels in a cycle."""
    return (degree + 1) ** 2


def tiles_in_box(frame: Frame, tile: int) -> np.ndarray:
    """[N] int64 tiles of the bounding box of the pixels above the alpha cut: the duplication unit tests each once."""
    out = np.zeros(len(frame.features.visible), np.int64)
    p, camera = frame.projection, frame.camera
    _boxes(p.mean2d, p.cov2d, p.opacity, frame.features.visible, camera.width, camera.height, tile, out)
    return out


@numba.njit(parallel=True, cache=True)
def _boxes(mean, cov, opacity, visible, width, height, tile, out):
    columns, rows = (width + tile - 1) // tile, (height + tile - 1) // tile
    for i in numba.prange(len(out)):
        if visible[i]:
            reach = 2 * np.log(opacity[i] / ALPHA_CUT)
            half_x, half_y = np.sqrt(reach * cov[i, 0]), np.sqrt(reach * cov[i, 2])
            left = max(np.floor((mean[i, 0] - half_x) / tile), 0.0)
            right = min(np.floor((mean[i, 0] + half_x) / tile) + 1, float(columns))
            top = max(np.floor((mean[i, 1] - half_y) / tile), 0.0)
            bottom = min(np.floor((mean[i, 1] + half_y) / tile) + 1, float(rows))
            out[i] = int(max(right - left, 0.0)) * int(max(bottom - top, 0.0))


@numba.njit(cache=True)
def _by_place(offsets, index, place, n):
    """(start int64[N + 1], tile int32[E]): the tiles, ascending, that list the Gaussian at each place."""
    start = np.zeros(n + 1, np.int64)
    for g in index:
        start[place[g] + 1] += 1
    start = np.cumsum(start)
    cursor = start[:-1].copy()
    tile = np.empty(len(index), np.int32)
    for t in range(len(offsets) - 1):
        for k in range(offsets[t], offsets[t + 1]):
            p = place[index[k]]
            tile[cursor[p]] = t
            cursor[p] += 1
    return start, tile


def _bound(formats: Formats, n: int, blocks: int, entries: int, extra: int) -> tuple[int, int]:
    """More lines than can be read and written."""
    members = blocks * 6 + ((HEAD_BYTES + LINE) * blocks + MEMBER_BYTES * n + extra) // LINE
    strides = formats.position_stride + formats.rest_step + formats.harmonics_bytes + 2 * formats.record_stride
    return n * strides // LINE + 8 * blocks + 2 * n + members, n + 2 * members + 3 * entries + n * formats.record_stride


@numba.vectorize(cache=True)
def _extra(tiles):
    """Bytes of membership data beyond MEMBER_BYTES of a Gaussian whose rectangle holds so many tiles."""
    return max(tiles - MEMBER_TILES + 7, 0) // 8


@numba.njit(cache=True)
def _range(out, at, begin, end, after):
    """Appends the lines of bytes begin .. end - 1 that lie behind line `after`; (next place, last line of all)."""
    for line in range(max(begin // LINE, after + 1), (end + LINE - 1) // LINE):
        out[at] = line
        at += 1
        after = line
    return at, after


@numba.njit(cache=True)
def _blocks(
    order, visible, before, fresh, needs_rest, alive, tested, by_place, last_begin, last_end, list_at, numbers, bases,
    member_begin, member_end, out, lines,
):  # fmt: skip
    """Fills member_begin, member_end, out and lines. numbers, bases: in the order in which they are named first."""
    (position_step, rest_step, rest_bytes, harmonics_bytes, split, membership, clusters, record_step, entry_bytes,
     artifact, combine_lines, colour, units) = numbers  # fmt: skip
    (positions, rest, harmonics, old, last_members, members, last_blocks, this_blocks, sphere, records) = bases
    list_start, list_tile = by_place
    n = len(order)
    buffer = new_buffer(len(list_at) - 1, combine_lines)
    nr = nw = 0
    last_line = -1  # of the membership data of the last frame that was read
    cursor = 0  # bytes of membership data written
    for b in range(len(alive)):
        first, end = b * BLOCK, min((b + 1) * BLOCK, n)
        # Read
        mark = nr
        if clusters and b % (LINE // 32) == 0:
            nr, _ = _range(out.read, nr, sphere + 32 * b, sphere + 32 * b + 1, -1)
        if membership and b % (LINE // 8) == 0:
            nr, _ = _range(out.read, nr, last_blocks + 8 * b, last_blocks + 8 * b + 1, -1)
        lines[_CLUSTERS, 0] += nr - mark
        if alive[b]:
            mark = nr
            nr, _ = _range(out.read, nr, positions + first * position_step, positions + end * position_step, -1)
            lines[_POSITIONS, 0] += nr - mark
            mark, seen_line = nr, -1
            for p in range(first, end):
                if needs_rest[order[p]]:
                    begin = rest + p * rest_step
                    nr, seen_line = _range(out.read, nr, begin, begin + rest_bytes, seen_line)
            lines[_REST, 0] += nr - mark
            if split:
                mark, seen_line = nr, -1
                for p in range(first, end):
                    if fresh[order[p]]:
                        begin = harmonics + p * harmonics_bytes
                        nr, seen_line = _range(out.read, nr, begin, begin + harmonics_bytes, seen_line)
                lines[_HARMONICS, 0] += nr - mark
                mark, seen_line = nr, -1
                for p in range(first, end):
                    if visible[order[p]] and not fresh[order[p]]:
                        begin = old + p * record_step
                        nr, seen_line = _range(out.read, nr, begin, begin + params.RECORD_BYTES, seen_line)
                lines[_OLD, 0] += nr - mark
        if membership and last_end[b] > last_begin[b]:
            mark = nr
            stop = last_end[b] if alive[b] else last_begin[b] + HEAD_BYTES
            nr, last_line = _range(out.read, nr, last_members + last_begin[b], last_members + stop, last_line)
            lines[_MEMBERS, 0] += nr - mark
        out.read_at[b + 1] = nr

        # Write
        mark, seen_line = nw, -1
        tests = longest = coloured = size = 0
        for p in range(first, end):
            g = order[p]
            if visible[g] or (membership and before[g]):  # who left gets a record that no test hits
                begin = records + p * record_step
                nw, seen_line = _range(out.write, nw, begin, begin + params.RECORD_BYTES, seen_line)
            if visible[g]:
                tests += tested[g]
                longest = max(longest, tested[g])
                coloured += fresh[g]
                size += MEMBER_BYTES + _extra(tested[g])
        lines[_RECORDS, 1] += nw - mark
        mark = nw
        member_begin[b] = member_end[b] = cursor
        if membership and size:
            cursor += HEAD_BYTES + size
            member_end[b] = cursor
        final = b == len(alive) - 1
        done = -(-cursor // LINE) * LINE if final else cursor // LINE * LINE  # the last line may not be full
        nw, _ = _range(out.write, nw, members + member_begin[b] // LINE * LINE, members + done, -1)
        lines[_MEMBERS, 1] += nw - mark
        mark = nw
        if membership and (final or b % (LINE // 8) == LINE // 8 - 1):
            nw, _ = _range(out.write, nw, this_blocks + 8 * b, this_blocks + 8 * b + 1, -1)
        lines[_CLUSTERS, 1] += nw - mark
        mark = nw
        for k in range(list_start[first], list_start[end]):
            nw = append(buffer, out.write, nw, list_tile[k], list_at, entry_bytes, artifact)
        if final and not artifact:
            nw = flush(buffer, out.write, nw, list_at)
        lines[_INCOMING, 1] += nw - mark
        out.write_at[b + 1] = nw

        # Compute: three kinds of units, one behind the other, on different blocks at a time
        busy = max(-(-(end - first) // units), -(-coloured * colour // units))
        busy = max(busy, max(-(-tests // units), longest))
        out.cycles[b] = busy if alive[b] else CULL_CYCLES
