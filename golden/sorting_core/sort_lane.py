"""gs_sort_lane: a job of the sort sequencer on a sorting core, from memory to memory, and how long it takes."""

from __future__ import annotations

import numba
import numpy as np

from golden import dma, params
from golden.formats import Formats
from golden.sorting_core import bitonic_sort_unit
from golden.sorting_core.sort_sequencer import (
    EMPTY,
    FIRST_COMMAND,
    NEXT_COMMAND,
    OUT,
    REGIONS,
    TABLE,
    Command,
    commands,
)
from golden.sorting_core.sorting_core import _timing, sort_chunks

SORT_STEPS = bitonic_sort_unit.steps()


@numba.njit(cache=True)
def run_command(a, b, size, command, at, core, latency, ports, chunk):
    """(cycles from a command to its list being written, the list int64[m]).

    Both readers, the core and the writer are idle and take the command in the cycle in which it is sent, 0. The writer
    takes every beat at once.
    """
    a_at = at[command.a] + command.a_from * size
    b_at = at[command.b] + command.b_from * size
    out_at = at[command.out] + command.out_from * size
    a_arrival = dma.list_arrival(0, len(a), size, a_at, dma.SORT + core, ports, latency)
    b_arrival = dma.list_arrival(0, len(b), size, b_at, dma.INSERT + core, ports, latency)
    words = a if command.merge else sort_chunks(a, command.first, chunk)
    _, first, length, _, _, entries = _timing(
        a_arrival, b_arrival, words, b, command.first, command.merge, SORT_STEPS, -1, chunk
    )
    port = dma.SORTED + core
    ports[port, dma.LAST] = dma.NEVER
    for k in range(len(first)):
        dma.write_block(first[k], length[k], size, out_at, port, ports, latency)
        out_at += length[k] * size
    return dma.written(first[-1] + max(length[-1], 1) - 1, port, ports), entries


@numba.njit(cache=True)
def run_job(table, incoming, size, firsts, at, core, latency, ports, chunk):
    """(cycles from the job to its done, the new table int64[m]); done is later when the last job's done still waits.

    firsts int64[P]: entries of the first chunk of each pass; chunk: of the others. size: bytes of an entry; at
    int64[4]: byte addresses of the regions; core: number of the lane, whose ports are used. Walks the sequencer's
    commands, so that it also shows what each of them reads and writes. The passes in front of the last one leave the
    table where it is (the RTL has none): a chunk has been read before its first entry is written.
    """
    n_in = len(incoming)
    regions = (table.copy(), incoming.copy(), np.zeros(n_in, np.int64), np.zeros(len(table) + n_in, np.int64))
    cycle = FIRST_COMMAND
    n = len(table)
    for first in firsts[:-1]:
        if n:
            repair = Command(False, TABLE, TABLE, TABLE, 0, n, 0, 0, 0, first)
            none = regions[TABLE][:0]
            cycles, entries = run_command(regions[TABLE][:n], none, size, repair, at, core, latency, ports, chunk)
            n = len(entries)
            regions[TABLE][:n] = entries
            cycle += cycles + NEXT_COMMAND
    for command in commands(n, n_in, firsts[-1], chunk):
        a = regions[command.a][command.a_from : command.a_from + command.a_n]
        b = regions[command.b][command.b_from : command.b_from + command.b_n]
        cycles, entries = run_command(a, b, size, command, at, core, latency, ports, chunk)
        n = len(entries)
        regions[command.out][command.out_from : command.out_from + n] = entries
        cycle += cycles + NEXT_COMMAND
    return (cycle if len(table) or n_in else EMPTY), regions[OUT][:n]


def job(
    f: Formats,
    table: np.ndarray,
    incoming: np.ndarray,
    first: int = params.CHUNK,
    latency: dma.Latency = dma.LATENCY,
    chunk: int = params.CHUNK,
) -> tuple[int, np.ndarray]:
    """run_job with one pass of a lane whose regions begin at multiples of BORDER."""
    at = np.zeros(len(REGIONS), np.int64)
    lists = np.ascontiguousarray(table, np.int64), np.ascontiguousarray(incoming, np.int64)
    cycles, words = run_job(*lists, f.entry_bytes, np.array([first]), at, 0, latency, dma.new_ports(), chunk)
    return int(cycles), words
