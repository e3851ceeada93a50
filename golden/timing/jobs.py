"""What the sorting cores read and write for each tile, in the order and the pieces in which they do.

A job is a list of passes over lists in memory; a pass goes chunk by chunk: it reads the chunk and what of a second list
is merged with it, and writes as much. A piece is a run of 64-byte lines. Pieces carry their share of the job's cycles.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from golden import dma, params
from golden.formats import REFERENCE
from golden.timing.dram import LINE

REUSE, SCRATCH, HIERARCHICAL, NONE = range(4)
PAPER_RUN = 16  # entries that the sort unit of the paper and of GSCore sorts at once; ours: params.SORT_N
ROUND_TRIP = 2 * dma.LATENCY.read + dma.LATENCY.write  # entries, their records, entries written


class Keys(NamedTuple):
    """Records that are read for this frame's keys of all entries of all tables; empty: tables keep their keys."""

    entry_at: np.ndarray  # int64[T + 1] entries of each table
    line_at: np.ndarray  # int64[E + 1] lines that an entry reads
    line: np.ndarray  # int64[..]


NO_KEYS = Keys(*np.zeros((3, 0), np.int64))


class Jobs(NamedTuple):
    """Pieces of T jobs; those of tile t are piece_at[t] .. piece_at[t + 1] - 1."""

    cycles: np.ndarray  # int64[T] of the job on a memory of the nominal latency
    piece_at: np.ndarray  # int64[T + 1]
    line: np.ndarray  # int64[P] first line; -1 - k: the lines are apart[k], apart[k + 1] ..
    lines: np.ndarray  # int64[P] how many
    write: np.ndarray  # bool[P]
    weight: np.ndarray  # int64[P] entries: the piece's share of the job's time; 0: it runs beside the one before it
    apart: np.ndarray  # int64[..] lines of records


@numba.njit(cache=True)
def _piece(out, at, begin, end, write, weight):
    """Writes one piece of bytes begin .. end - 1 when out is long enough; returns the next place."""
    if end > begin or weight:
        if at < len(out.line):
            out.line[at] = begin // LINE
            out.lines[at] = (end - 1) // LINE - begin // LINE + 1 if end > begin else 0
            out.write[at] = write
            out.weight[at] = weight
        return at + 1
    return at


@numba.njit(cache=True)
def _apart(out, at, begin, end):
    """Writes one piece that reads the lines apart[begin:end]; returns the next place."""
    if end > begin:
        if at < len(out.line):
            out.line[at] = -1 - begin
            out.lines[at] = end - begin
            out.write[at] = False
            out.weight[at] = 0
        return at + 1
    return at


@numba.njit(cache=True)
def _pass(out, at, a, a_n, b, b_n, to, size, chunk):
    """A pass over a_n entries at byte a and b_n at byte b, of `size` bytes each, written to byte `to`.

    A chunk is written behind the read of the next one, which is asked for while it is sorted.
    """
    steps = (a_n + b_n + chunk - 1) // chunk
    for k in range(steps + 1 if steps else 0):
        a0, b0 = a_n * k // steps, b_n * k // steps
        if k < steps:
            a1, b1 = a_n * (k + 1) // steps, b_n * (k + 1) // steps
            at = _piece(out, at, a + a0 * size, a + a1 * size, False, a1 - a0)
            at = _piece(out, at, b + b0 * size, b + b1 * size, False, b1 - b0)
        if k:
            begin = a_n * (k - 1) // steps + b_n * (k - 1) // steps
            at = _piece(out, at, to + begin * size, to + (a0 + b0) * size, True, 0)
    return at


@numba.njit(cache=True)
def _renew(out, at, keys, tile, table, size, chunk):
    """A pass that gives every entry of a table the key of its record: chunk by chunk entries, records, entries."""
    first, last = keys.entry_at[tile], keys.entry_at[tile + 1]
    for begin in range(first, last, chunk):
        end = min(begin + chunk, last)
        at = _piece(out, at, table + (begin - first) * size, table + (end - first) * size, False, end - begin)
        at = _apart(out, at, keys.line_at[begin], keys.line_at[end])
        at = _piece(out, at, table + (begin - first) * size, table + (end - first) * size, True, 0)
    return at


@numba.njit(cache=True)
def _tile(out, at, kind, table_n, in_n, table, incoming, scratch, to, size, chunk, passes):
    """Pieces of one job, as sort_lane.run_job orders them; HIERARCHICAL reads and writes the whole list twice."""
    runs, other = incoming, scratch
    if kind == NONE:
        return at
    for _ in range(passes - 1):
        at = _pass(out, at, table, table_n, 0, 0, table, size, chunk)
    if kind == HIERARCHICAL:
        n = table_n + in_n
        at = _pass(out, at, table, table_n, incoming, in_n, scratch, size, chunk)  # coarse: into buckets
        return _pass(out, at, scratch, n, 0, 0, to, size, chunk)  # fine: each bucket on chip
    if in_n:
        target = to if in_n <= chunk and not table_n else other
        at = _pass(out, at, runs, in_n, 0, 0, target, size, chunk)
        runs, other = other, runs
        run = chunk
        while run < in_n:
            target = to if in_n <= 2 * run and not table_n else other
            at = _pass(out, at, runs, in_n, 0, 0, target, size, chunk)
            runs, other = other, runs
            run *= 2
    if table_n:
        at = _pass(out, at, table, table_n, runs, in_n, to, size, chunk)
    return at


@numba.njit(cache=True)
def _all(out, piece_at, kind, table_n, in_n, table, incoming, scratch, to, size, chunk, passes, keys):
    at = 0
    for t in range(len(table_n)):
        piece_at[t] = at
        if len(keys.entry_at):
            at = _renew(out, at, keys, t, table[t], size, chunk)
        at = _tile(out, at, kind, table_n[t], in_n[t], table[t], incoming[t], scratch[t], to[t], size, chunk, passes)
    piece_at[len(table_n)] = at
    return at


def jobs(
    kind: int, cycles, table_n, in_n, table, incoming, scratch, to, size: int = REFERENCE.entry_bytes,
    chunk: int = params.CHUNK, passes: int = 1, keys: Keys = NO_KEYS,
) -> Jobs:  # fmt: skip
    """Jobs of T tiles.

    cycles, table_n, in_n int64[T]: nominal cycles, entries of the table and of the incoming list; table, incoming,
    scratch, to int64[T]: byte addresses; size: bytes of an entry. chunk: entries sorted on chip at once; passes: over a
    table, the last one merges. keys: what a pass in front of them reads (renew_cycles).
    """
    lists = [np.ascontiguousarray(x, np.int64) for x in (table_n, in_n, table, incoming, scratch, to)]
    piece_at = np.zeros(len(lists[0]) + 1, np.int64)
    count = 0
    out = None
    for _ in range(2):  # once to count, once to fill
        out = Jobs(
            np.asarray(cycles, np.int64), piece_at, np.zeros(count, np.int64), np.zeros(count, np.int64),
            np.zeros(count, np.bool_), np.zeros(count, np.int64), keys.line,
        )  # fmt: skip
        count = _all(out, piece_at, kind, *lists, size, chunk, passes, keys)
    return out


def renew_cycles(n: np.ndarray) -> np.ndarray:
    """Cycles in which a sorting core gives n entries of a table new keys: one a cycle, and the memory's answers."""
    return np.where(n > 0, n + ROUND_TRIP, 0)


def chunk_sort_cycles(n: np.ndarray, chunk: int = params.CHUNK) -> np.ndarray:
    """Cycles in which a sorting core of GSCore's kind sorts n entries on chip: n for each doubling of a PAPER_RUN.

    The paper's simulator charges ceil(log2(n / 16)) * n cycles for a chunk, n below 16.
    """
    n = np.asarray(n, np.int64)
    whole, rest = n // chunk, n % chunk
    levels = np.ceil(np.log2(np.maximum(rest, 1) / PAPER_RUN)).clip(1).astype(np.int64)
    return whole * chunk * int(np.log2(chunk / PAPER_RUN)) + levels * rest
