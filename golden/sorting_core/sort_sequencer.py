"""gs_sort_sequencer: one tile's sort as a list of commands to a sorting core, each making one list in memory.

The incoming entries are sorted in chunks, the sorted runs merged two by two, to and fro between their region and a
scratch region, until one run is left; the table is then sorted chunk by chunk and merged with it. Without a table the
last command of the incoming entries writes the result.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from golden import params
from golden.sorting_core import sorting_core

TABLE, INCOMING, SCRATCH, OUT = REGIONS = range(4)
FIRST_COMMAND = 2  # cycles from the job to its first command
NEXT_COMMAND = 2  # from a command's list being written to the next command, or to done
EMPTY = 2  # from a job without entries to its done


class Command(NamedTuple):
    """Lists a and b are regions from an entry on; the result goes to a region from an entry on."""

    merge: bool
    a: int
    b: int
    out: int
    a_from: int
    a_n: int
    b_from: int
    b_n: int
    out_from: int
    first: int  # entries of list a's first chunk


@numba.njit(cache=True)
def commands(table_n, in_n, first=params.CHUNK, chunk=params.CHUNK):
    """The commands of a job, a list of Command."""
    result = []
    runs, other = INCOMING, SCRATCH
    if in_n:
        out = OUT if in_n <= chunk and not table_n else other
        result.append(Command(False, runs, runs, out, 0, in_n, 0, 0, 0, chunk))
        runs, other = other, runs
        run = chunk
        while run < in_n:
            out = OUT if in_n <= 2 * run and not table_n else other
            for at in range(0, in_n, 2 * run):
                middle, end = min(at + run, in_n), min(at + 2 * run, in_n)
                result.append(Command(True, runs, runs, out, at, middle - at, at + run, end - middle, at, chunk))
            runs, other = other, runs
            run *= 2
    if table_n:
        result.append(Command(False, TABLE, runs, OUT, 0, table_n, 0, in_n, 0, first))
    return result


def sort(table: np.ndarray, incoming: np.ndarray, first: int = params.CHUNK) -> np.ndarray:
    """int64[m] the new table: table repaired chunk by chunk, merged with the sorted incoming, none invalid."""
    return sorting_core.sort(table, np.sort(incoming), first)
