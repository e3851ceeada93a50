"""Cycles of the DMA units of rtl/common (gs_axi_*.v) on a memory of fixed latency.

The memory takes an address, and a beat of written data, in every cycle. `read` cycles behind the AR its first R beat
is there, the following ones one a cycle, bursts in order; `write` cycles behind a burst's last W beat its B is there.
Times are absolute cycles; a function takes the cycle of the beat that starts it.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from golden import params

BORDER = 4096  # bytes: no burst crosses a multiple of it
RECORD_CYCLES = 4  # gs_axi_record_reader: index taken to record offered, beside the memory's read latency
BEAT = 8  # bytes on a table's or the feature port
PIXEL_BEAT = 16  # bytes on the pixel port


class Latency(NamedTuple):
    """Of the memory, in cycles."""

    read: int = 40  # AR accepted to first R beat
    write: int = 20  # last W beat of a burst to its B


LATENCY = Latency()


def beats(n: int) -> int:
    """64-bit beats of a table of n entries."""
    return -(-n * params.ENTRY_BYTES // BEAT)


@numba.njit(cache=True)
def list_arrival(cmd, n, read):
    """int64[n + 1]: first cycle in which gs_axi_list_reader offers each beat of a list, end beat included.

    The command sets the AR registers (1), the first R beat follows the first AR by `read`, and is on the list a cycle
    later (1). An AR goes out in every cycle, so no burst waits for its AR; every fourth entry needs no beat, so the
    memory is never behind. A list without entries has its end beat two cycles behind the command.
    """
    return np.arange(n + 1) + cmd + 2 + (read if n else 0)


@numba.njit(cache=True)
def list_next(end):
    """First cycle in which gs_axi_list_reader takes another command; its end beat is taken in cycle `end`."""
    return end + 1


@numba.njit(cache=True)
def record_split(index, base=0):
    """Whether a record lies across a border, so that it needs two bursts; index int64[...]."""
    at = (base + index * params.RECORD_BYTES) % BORDER
    return at > BORDER - params.RECORD_BYTES


@numba.njit(cache=True)
def written(entry, end, n, write):
    """Cycle in which gs_axi_block_writer offers done for a list of n entries.

    It takes the last entry in cycle `entry` and the list's last beat, that entry's or that of a block of length 0, in
    cycle `end`. The last W beat follows the entry by a cycle, or by two when the end fills no group of four; its B is
    there `write` cycles later, and done a cycle after it, but not before the list's end has passed through the queue of
    lists (2).
    """
    answered = entry + (1 if n % 4 == 0 else 2) + write + 1
    return end + 2 if n == 0 else max(end + 2, answered)


@numba.njit(cache=True)
def pixels_written(last, write):
    """Cycle in which gs_axi_pixel_writer offers done for a tile whose last px beat it takes in `last`."""
    return last + 1 + write + 1
