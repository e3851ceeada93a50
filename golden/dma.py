"""Cycles of the DMA units of rtl/common (gs_axi_*.v) and of the memory behind them.

The memory takes an address, and a beat of written data, in every cycle. `read` cycles behind an AR its first R beat is
there, the following ones one a cycle, bursts in order; `write` cycles behind a burst's last W beat its B is there, one
a cycle. With jitter each burst's first R beat or B comes later by a number of its own (`late`). Times are absolute
cycles; a function takes the cycle of the beat that starts it.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from golden import params

BORDER = 4096  # bytes: no burst crosses a multiple of it
LIST_BORDER = 2048  # bytes: nor does gs_axi_list_reader cross a multiple of this
BEAT = 8  # bytes on a table's or the feature port
PIXEL_BEAT = 16  # bytes on the pixel port

_CORES = range(params.SORT_CORES)
READ_PORTS = (*(f"{name}{core}" for name in ("sort", "insert") for core in _CORES), "table", "feature")
WRITE_PORTS = (*(f"sort{core}" for core in _CORES), "table", "pixel")
SORT, INSERT = 0, params.SORT_CORES  # numbers of the ports: of core 0
TABLE, FEATURE = len(READ_PORTS) - 2, len(READ_PORTS) - 1
SORTED = len(READ_PORTS)
DRAWN_TABLE, PIXEL = SORTED + len(WRITE_PORTS) - 2, SORTED + len(WRITE_PORTS) - 1
PORTS = len(READ_PORTS) + len(WRITE_PORTS)
BURSTS, LAST = 0, 1  # of a port: bursts so far; cycle of the last R beat or B
NEVER = -1 << 40


class Latency(NamedTuple):
    """Of the memory, in cycles."""

    read: int = 40  # AR accepted to first R beat
    write: int = 20  # last W beat of a burst to its B
    jitter: int = 0  # what comes on top, for each burst, is 0..jitter
    seed: int = 0


LATENCY = Latency()


@numba.njit(cache=True)
def new_ports():
    """int64[PORTS, 2] before the first burst."""
    ports = np.zeros((PORTS, 2), np.int64)
    ports[:, LAST] = NEVER
    return ports


@numba.njit(cache=True)
def late(latency, port, burst):
    """Cycles, 0..jitter, by which burst number `burst` of a port is answered later; few are near jitter.

    golden/cosim/harness.cpp draws the same numbers.
    """
    if latency.jitter == 0:
        return np.int64(0)
    half = np.uint64(32)
    x = (np.uint64(latency.seed) << np.uint64(40)) ^ (np.uint64(port) << half) ^ np.uint64(burst)
    for _ in range(3):
        x = (x ^ (x >> half)) * np.uint64(0xD6E8FEB86659FD93)
    return np.int64((x >> half) % np.uint64(latency.jitter + 1)) >> np.int64(x >> np.uint64(29) & np.uint64(7))


@numba.njit(cache=True)
def read_burst(asked, port, ports, latency):
    """First cycle in which the first R beat of the port's next burst can move; its AR moves in cycle `asked`."""
    extra = late(latency, port, ports[port, BURSTS])
    ports[port, BURSTS] += 1
    return max(asked + latency.read + extra, ports[port, LAST] + 1)


@numba.njit(cache=True)
def write_burst(sent, port, ports, latency):
    """The port's next burst, its last W beat moves in cycle `sent`: its B is then the port's LAST."""
    extra = late(latency, port, ports[port, BURSTS])
    ports[port, BURSTS] += 1
    ports[port, LAST] = max(sent + latency.write + extra, ports[port, LAST] + 1)


@numba.njit(cache=True)
def beats(n, size):
    """64-bit beats of a table of n entries of `size` bytes."""
    return (n * size + BEAT - 1) // BEAT


@numba.njit(cache=True)
def list_arrival(cmd, n, size, address, port, ports, latency):
    """int64[n + 1]: first cycle in which gs_axi_list_reader offers each beat of a list of entries of `size` bytes
    and its end beat.

    The command sets the AR registers (1), an AR goes out in every cycle from then on. An R beat's entry is on the list
    a cycle later (1); one that ends in the same beat as the entry before it needs none. A list without entries has its
    end beat two cycles behind the command. The list before has been taken, so no R beat is left over from it.
    """
    out = np.empty(n + 1, np.int64)
    asked = cmd + 1
    begin = address // BEAT
    at = begin  # of the next R beat
    end = begin + beats(n, size)
    border = begin
    there = cmd + 1
    for k in range(n):
        if begin + beats(k + 1, size) > at:
            if at == border:
                border = min(end, (at * BEAT // LIST_BORDER + 1) * LIST_BORDER // BEAT)
                there = max(there, read_burst(asked, port, ports, latency))
                asked += 1
            at += 1
        there += 1
        out[k] = there
    out[n] = there + 1
    return out


@numba.njit(cache=True)
def list_next(end):
    """First cycle in which gs_axi_list_reader takes another command; its end beat is taken in cycle `end`."""
    return end + 1


@numba.njit(cache=True)
def record_head(index, size, base=0):
    """R beats of the first burst of a record of `size` bytes: fewer than all when a border cuts it into two."""
    room = BORDER - (base + index * size) % BORDER
    return min(room, size) // BEAT


@numba.njit(cache=True)
def record_heads(indices, size, base=0):
    """int64[m]: record_head of each."""
    out = np.empty(len(indices), np.int64)
    for k in range(len(indices)):
        out[k] = record_head(indices[k], size, base)
    return out


@numba.njit(cache=True)
def record_arrivals(asked, heads, whole, port, ports, latency):
    """int64[m]: cycles in which gs_axi_record_reader offers records, each taken at once.

    asked int64[m]: their first ARs, the second one of a record follows in the next cycle; heads int64[m]: record_head;
    whole: beats of a record.
    A record is there a cycle behind its last R beat.
    """
    out = np.empty(len(asked), np.int64)
    for k in range(len(asked)):
        ports[port, LAST] = read_burst(asked[k], port, ports, latency) + heads[k] - 1
        if heads[k] < whole:
            ports[port, LAST] = read_burst(asked[k] + 1, port, ports, latency) + whole - heads[k] - 1
        out[k] = ports[port, LAST] + 1
    return out


@numba.njit(cache=True)
def _filled(beat, n, size):
    """Which of a block's n entries fills its W beat number `beat`; n: none of them, it goes out behind them."""
    return min(n, ((beat + 1) * BEAT - 1) // size)


@numba.njit(cache=True)
def write_block(first, n, size, address, port, ports, latency):
    """gs_axi_block_writer sends a block of n entries of `size` bytes; it takes the first one in cycle `first`.

    A beat moves a cycle behind the entry that fills it; in place of an entry behind the list's last one comes a cycle.
    """
    end = beats(n, size)
    room = (BORDER - address % BORDER) // BEAT
    if room < end:
        write_burst(first + _filled(room - 1, n, size) + 1, port, ports, latency)
    if end > 0:
        write_burst(first + _filled(end - 1, n, size) + 1, port, ports, latency)


@numba.njit(cache=True)
def write_pixels(first, rows, columns, address, stride, port, ports, latency):
    """gs_axi_pixel_writer sends rows of `columns` beats, one beat a cycle; it takes the first one in cycle `first`.

    address: byte address of the tile's first pixel; stride: bytes from row to row. A W beat follows its beat by one.
    """
    for row in range(rows):
        room = (BORDER - (address + row * stride) % BORDER) // PIXEL_BEAT
        sent = first + row * columns
        if room < columns:
            write_burst(sent + room, port, ports, latency)
        write_burst(sent + columns, port, ports, latency)


@numba.njit(cache=True)
def written(end, port, ports):
    """Cycle in which a writer offers done for a list or a tile whose last beat it takes in cycle `end`.

    It is there a cycle behind the last B, but not before the end has passed through the queue of lists (2).
    """
    return max(end + 2, ports[port, LAST] + 1)
