"""gs_sort_lane: a job of the sort sequencer on a sorting core, from memory to memory, and how long it takes."""

from __future__ import annotations

import numpy as np

from golden import dma, params
from golden.sorting_core import sort_sequencer, sorting_core
from golden.sorting_core.sort_sequencer import EMPTY, FIRST_COMMAND, INCOMING, NEXT_COMMAND, OUT, SCRATCH, TABLE


def command_cycles(a: np.ndarray, b: np.ndarray, command: sort_sequencer.Command, latency: dma.Latency):
    """(cycles from a command to its list being written, the list int64[m]).

    Both readers, the core and the writer are idle and take the command in the cycle in which it is sent. The writer
    takes every beat at once.
    """
    times = sorting_core.timing(
        dma.list_arrival(0, len(a), latency.read),
        dma.list_arrival(0, len(b), latency.read),
        a,
        b,
        command.first,
        command.merge,
    )
    n = len(times.entries)
    entry = times.end
    if times.lengths[-1] == 0 and n:
        entry = int(times.blocks[-2] + times.lengths[-2] - 1)
    return int(dma.written(entry, times.end, n, latency.write)), times.entries


def job(
    table: np.ndarray, incoming: np.ndarray, first: int = params.CHUNK, latency: dma.Latency = dma.LATENCY
) -> tuple[int, np.ndarray]:
    """(cycles from the job to its done, the new table int64[m]); done is later when the last job's done still waits.

    Walks the sequencer's commands, so that it also shows what each of them reads and writes.
    """
    regions = {
        TABLE: table,
        INCOMING: incoming.copy(),
        SCRATCH: np.zeros(len(incoming), np.int64),
        OUT: np.zeros(len(table) + len(incoming), np.int64),
    }
    cycle = FIRST_COMMAND
    n = 0
    for command in sort_sequencer.commands(len(table), len(incoming), first):
        a = regions[command.a][command.a_from : command.a_from + command.a_n]
        b = regions[command.b][command.b_from : command.b_from + command.b_n]
        cycles, entries = command_cycles(a, b, command, latency)
        n = len(entries)
        regions[command.out][command.out_from : command.out_from + n] = entries
        cycle += cycles + NEXT_COMMAND
    return (cycle if n or len(table) or len(incoming) else EMPTY), regions[OUT][:n]
