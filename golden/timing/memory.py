"""What the agents ask: a memory of fixed latency, or the DRAM model behind a fabric."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from golden import dma
from golden.timing import dram

NEVER = 1 << 60  # a cycle
PREPROCESS, SORTING, RASTER = range(3)
STAGES = ("preprocess", "sorting", "raster")
OUTSTANDING = 32  # reads that a master has on their way at once
FABRIC = 8  # cycles from a master to the memory controller and as many back: assumed


class Memory(NamedTuple):
    """A memory and what has gone through it."""

    fixed: bool
    read: int  # nominal latency, cycles
    write: int
    dram: dram.DramState
    lines: np.ndarray  # int64[3, 2] lines of each stage, read and written
    waits: np.ndarray  # int64[3, 2] cycles that they took, in all


def fixed(latency: dma.Latency = dma.LATENCY) -> Memory:
    """A memory that takes a request in every cycle."""
    return Memory(True, latency.read, latency.write, dram.new_state(), *np.zeros((2, 3, 2), np.int64))


def lpddr4(channels: int) -> Memory:
    """LPDDR4-3200 of that many channels; the nominal latencies are those that the jobs' cycles count with."""
    return Memory(False, dma.LATENCY.read, dma.LATENCY.write, dram.new_state(channels), *np.zeros((2, 3, 2), np.int64))


@numba.njit(cache=True)
def answer(memory, cycle, line, write, stage):
    """Cycle in which a line asked for in `cycle` is there, or a written one taken."""
    way = 1 if write else 0
    if memory.fixed:
        there = cycle + (memory.write if write else memory.read)
    else:
        there = dram.serve(memory.dram, cycle + FABRIC, line, write) + FABRIC
    memory.lines[stage, way] += 1
    memory.waits[stage, way] += there - cycle
    return there
