"""Drives a pipeline that never stalls: `in_valid` and fields in, `out_valid` and fields a fixed time behind.

A beat that is taken on clock edge k of a run leaves with the edge k + latency, so that a run gives the cycle of each
result next to its value. Fields are X while in_valid is low (random on a two-state simulator).
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence

from cocotb.triggers import RisingEdge
from cocotb.types import LogicArray

from tb.lib.stream import four_state


def code(value: int, signal) -> int:
    """Two's complement of a signed value in the width of the signal."""
    return int(value) & ((1 << len(signal)) - 1)


def unknown(signal, generator: random.Random):
    """What an idle input shows."""
    if not four_state():
        return generator.getrandbits(len(signal))
    return LogicArray("X" * len(signal)) if len(signal) > 1 else "X"


async def run(
    dut,
    fields: Sequence[str],
    beats: Iterable[Sequence[int] | None],
    results: Sequence[str],
    drain: int,
    generator: random.Random,
) -> list[tuple[int, tuple[int, ...]]]:
    """Offer one beat (values of in_<field>) or a gap (None) per cycle: [(cycle, values of out_<result>)] by out_valid.

    Cycle 0 is the edge that takes the first beat; `drain` idle cycles follow the last one.
    """
    inputs = [getattr(dut, f"in_{field}") for field in fields]
    outputs = [getattr(dut, f"out_{result}") for result in results]
    edge = RisingEdge(dut.clk)
    found = []
    was_idle = False
    for cycle, beat in enumerate([*beats, *[None] * drain]):
        dut.in_valid.value = beat is not None
        if beat is not None:
            for signal, value in zip(inputs, beat, strict=True):
                signal.value = code(value, signal)
        elif not was_idle:
            for signal in inputs:
                signal.value = unknown(signal, generator)
        was_idle = beat is None
        await edge
        assert dut.out_valid.value.is_resolvable, f"cycle {cycle}: out_valid is {dut.out_valid.value}"
        if dut.out_valid.value:
            found.append((cycle, tuple(int(signal.value) for signal in outputs)))
    return found


async def reset_full(dut, cycles: int = 10) -> None:
    """Reset for one cycle a pipeline that is full of beats: from then on nothing comes out."""
    edge = RisingEdge(dut.clk)
    dut.in_valid.value, dut.rst.value = 0, 1
    await edge
    dut.rst.value = 0
    for cycle in range(cycles):
        await edge
        assert dut.out_valid.value == 0, f"a beat {cycle + 1} cycles behind the reset"
