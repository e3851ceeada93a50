"""Which cells of a library are full and half adders."""

from __future__ import annotations

import re
from dataclasses import dataclass

from synth.cells import Cell


@dataclass(frozen=True)
class Adder:
    """A full or half adder cell: pins, and whether its outputs are inverted."""

    name: str
    inputs: tuple[str, ...]
    carry: str
    sum: str
    inverted: tuple[bool, bool]


def truth(function: str, pins: list[str]) -> tuple[bool, ...]:
    """Values of a Liberty function for all inputs, the first pin counting 1."""
    text = re.sub(r"\*", " and ", re.sub(r"\+", " or ", re.sub(r"!", " not ", function))).strip()
    values = [[bool(at >> n & 1) for n in range(len(pins))] for at in range(1 << len(pins))]
    return tuple(bool(eval(text, {}, dict(zip(pins, row)))) for row in values)


def adder(cells: dict[str, Cell], inputs: int) -> Adder | None:
    """The smallest cell with `inputs` inputs that gives their sum and carry, both inverted or both true."""
    count = [bin(at).count("1") for at in range(1 << inputs)]
    found = []
    for cell in cells.values():
        pins = list(cell.caps)
        if cell.sequential or cell.clock_gate or len(pins) != inputs or len(cell.functions) != 2:
            continue
        tables = {truth(function, pins): pin for pin, function in cell.functions.items()}
        for invert in (False, True):
            carry, total = (tuple((c >> bit & 1 == 1) != invert for c in count) for bit in (1, 0))
            if carry in tables and total in tables:
                order = sorted(pins, key=lambda pin: -cell.caps[pin])  # the lightest pin for the latest bit
                found.append((cell.area, Adder(cell.name, tuple(order), tables[carry], tables[total], invert)))
    return min(found, key=lambda pair: pair[0])[1] if found else None
