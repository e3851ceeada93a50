"""The preprocessing engine: cycles and memory lines of each block of 256 Gaussians (docs/traffic.md).

A block in memory order is read, projected, coloured and listed before it is written; lines that neighbours share are
read and written once. What the units compute: golden/preprocess.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numba
import numpy as np

from golden.preprocess.projection import ALPHA_CUT
from golden.timing.address_map import Formats, Regions
from golden.timing.clusters import Store, seen
from golden.timing.preprocess_lines import KINDS, Bases, Blocks, Steps, Who, extra_bytes, fill, room

if TYPE_CHECKING:
    from golden.frame import Frame


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
    units: int,
) -> Preprocessed:
    """One frame.

    last: of the frame before; None when there is none or its tables are not used. number: the frame's, chooses between
    two generations of a region. lists: (starts int64[T + 1] byte addresses (address_map.list_starts), offsets
    int64[T + 1], index [E]): the Gaussians that preprocessing lists for each tile, in any order.
    """
    n, blocks, this = len(stored.order), stored.blocks, number & 1
    f = formats
    visible = frame.features.visible
    before = np.zeros(n, np.bool_) if last is None else last.visible
    who = Who(
        order=stored.order,
        alive=seen(frame.camera, stored.centre, stored.spread, stored.block_reach)
        if f.clusters
        else np.ones(blocks, np.bool_),
        rest=seen(frame.camera, stored.means, np.zeros(n), stored.reach) if f.reach else visible,
        visible=visible,
        fresh=frame.coloured,
        old=visible & ~frame.coloured,
        record=visible | before if f.membership else visible,
        tested=tiles_in_box(frame, f.tile),
    )
    steps = Steps(
        f.position_stride, f.rest_step, f.rest_bytes, f.harmonics_bytes, f.split, f.membership, f.clusters,
        f.record_stride, f.record_bytes, f.incoming_bytes, f.incoming_lines == "artifact", f.combine_lines,
        colour_cycles(f.degree), units,
    )  # fmt: skip
    bases = Bases(
        at.positions, at.rest, at.harmonics, at.colours, at.clusters, at.blocks[1 - this], at.blocks[this],
        at.members[1 - this], at.members[this], at.features[this],
    )  # fmt: skip
    starts, offsets, index = lists
    out = room(f, n, blocks, len(index), int(extra_bytes(who.tested).sum()))
    none = np.zeros(blocks, np.int64)
    members = Members(visible, np.zeros(blocks, np.int64), np.zeros(blocks, np.int64))
    lines = np.zeros((len(KINDS), 2), np.int64)
    fill(
        who, steps, bases, (none, none) if last is None else (last.begin, last.end),
        _by_place(offsets, np.ascontiguousarray(index, np.int64), stored.place, n), np.asarray(starts, np.int64),
        (members.begin, members.end), out, lines,
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
