"""Trees of full adders against plain arithmetic: gates evaluated here, operands drawn at random."""

import itertools
import random

import pytest

from synth import adders, cells, compressor

TABLE = cells.load()
KINDS = {"$_AND_": lambda a, b: a & b, "$_NAND_": lambda a, b: 1 - (a & b)}


def macc(products, addends, width: int, read: range | None = None) -> tuple[dict, list[list[int]]]:
    """A module with one $macc_v2 and the nets of its operands; an operand is (bits, signed), of a product a pair.

    `read`: bits of the sum that something reads.
    """
    fresh = itertools.count(2)
    operands: list[list[int]] = []

    def nets(size: int) -> list[int]:
        operands.append([next(fresh) for _ in range(size)])
        return operands[-1]

    wires = {"A": [], "B": [], "C": []}
    for (a, _), (b, _), _, square in products:
        wires["A"] += nets(a)
        wires["B"] += operands[-1] if square else nets(b)
    for (size, _), _ in addends:
        wires["C"] += nets(size)

    def flags(values) -> str:
        return "".join("1" if value else "0" for value in values)[::-1] or "x"

    def widths(values) -> str:
        return "".join(f"{value:016b}" for value in reversed(list(values))) or "0" * 16

    y = [next(fresh) for _ in range(width)]
    parameters = {
        "NPRODUCTS": f"{len(products):032b}", "NADDENDS": f"{len(addends):032b}",
        "A_WIDTHS": widths(a for (a, _), *_ in products), "A_SIGNED": flags(s for (_, s), *_ in products),
        "B_WIDTHS": widths(b for _, (b, _), *_ in products), "B_SIGNED": flags(s for _, (_, s), *_ in products),
        "C_WIDTHS": widths(c for (c, _), _ in addends), "C_SIGNED": flags(s for (_, s), _ in addends),
        "PRODUCT_NEGATED": flags(n for _, _, n, _ in products), "ADDEND_NEGATED": flags(n for _, n in addends),
    }  # fmt: skip
    sides = dict.fromkeys("ABC", "input") | {"Y": "output"}
    one = {"type": "$macc_v2", "parameters": parameters, "port_directions": sides, "connections": wires | {"Y": y}}
    inputs = {"direction": "input", "bits": [*itertools.chain(*operands)]}
    outputs = {"direction": "output", "bits": [y[k] for k in read or range(width)]}
    return {"ports": {"in": inputs, "out": outputs}, "cells": {"sum": one}, "netnames": {}}, operands


def evaluate(module: dict, values: dict) -> list[int]:
    """Bits of the port `out`; gates stand in any order."""
    values = {"0": 0, "1": 1, **values}
    waiting = list(module["cells"].values())
    while waiting:
        ready = []
        for gate in waiting:
            wires, sides = gate["connections"], gate["port_directions"]
            given = {p: [values.get(net) for net in nets] for p, nets in wires.items() if sides[p] == "input"}
            if not any(value is None for bits in given.values() for value in bits):
                ready.append((gate, given))
        assert ready, "a loop, or a net that nothing drives"
        for gate, given in ready:
            waiting.remove(gate)
            wires, kind = gate["connections"], gate["type"]
            if kind == "$alu":
                a, b = (sum(bit << k for k, bit in enumerate(given[pin])) for pin in "AB")
                total = a + b + given["CI"][0]
                values |= {net: total >> k & 1 for k, net in enumerate(wires["Y"])}
            elif kind == "$_NOT_":
                values[wires["Y"][0]] = 1 - given["A"][0]
            elif kind in KINDS:
                values[wires["Y"][0]] = KINDS[kind](given["A"][0], given["B"][0])
            else:
                pins = list(TABLE[kind].caps)
                row = sum(given[pin][0] << k for k, pin in enumerate(pins))
                for pin, function in TABLE[kind].functions.items():
                    if pin in wires:
                        values[wires[pin][0]] = int(adders.truth(function, pins)[row])
    return [values[net] for net in module["ports"]["out"]["bits"]]


def number(bits: list[int], signed: bool) -> int:
    value = sum(bit << k for k, bit in enumerate(bits))
    return value - (1 << len(bits)) if signed and bits and bits[-1] else value


UNSIGNED, SIGNED = False, True
CASES = {
    "product": ([((5, UNSIGNED), (7, UNSIGNED), False, False)], [], 12, None),
    "signed-product": ([((6, SIGNED), (5, SIGNED), False, False)], [], 14, None),
    "square": ([((7, UNSIGNED), (7, UNSIGNED), False, True)], [], 14, None),
    "signed-square": ([((6, SIGNED), (6, SIGNED), True, True)], [((4, SIGNED), False)], 13, None),
    "many-addends": (
        [],
        [((6, UNSIGNED), False), ((5, SIGNED), True), ((7, UNSIGNED), True), ((3, SIGNED), False)],
        10,
        None,
    ),
    "carry-in": ([], [((9, UNSIGNED), False), ((9, UNSIGNED), True), ((1, UNSIGNED), False)], 11, None),
    "multiply-add": (
        [((6, SIGNED), (6, SIGNED), True, False)],
        [((12, SIGNED), False), ((9, UNSIGNED), True)],
        15,
        None,
    ),
    "two-products": (
        [((4, SIGNED), (6, SIGNED), True, False), ((5, UNSIGNED), (4, UNSIGNED), False, False)],
        [],
        12,
        None,
    ),
    "truncated": ([((9, SIGNED), (8, SIGNED), False, False)], [((6, UNSIGNED), False)], 9, None),
    "upper-half": ([((8, UNSIGNED), (8, UNSIGNED), False, False)], [((7, UNSIGNED), False)], 16, range(7, 14)),
}


@pytest.mark.parametrize("constant", ["", "011"])
@pytest.mark.parametrize("ripple", [0.0, 1000.0], ids=["", "ripple"])
@pytest.mark.parametrize("case", CASES)
def test_a_tree_is_the_sum(case, ripple, constant):
    """`constant`: what the first bits of the last operand always are."""
    products, addends, width, read = CASES[case]
    module, operands = macc(products, addends, width, read)
    known = dict(zip(operands[-1][:-1], constant))
    wires = module["cells"]["sum"]["connections"]
    wires |= {pin: [known.get(net, net) for net in wires[pin]] for pin in "ABC"}
    assert compressor.compress(module, TABLE, ripple=ripple) == 1
    assert any(cells.short(gate["type"]) == "FAx1" for gate in module["cells"].values())
    draw = random.Random(1)
    for trial in range(30):
        bits = [[draw.randrange(2) if trial > 3 else trial & 1 for _ in nets] for nets in operands]
        bits[-1] = [int(known.get(net, bit)) for net, bit in zip(operands[-1], bits[-1])]
        left = iter(zip(bits, operands))
        expected = 0
        for (_, a), (_, b), negated, square in products:
            x = next(left)[0]
            product = number(x, a) * number(x if square else next(left)[0], b)
            expected += -product if negated else product
        for (_, signed), negated in addends:
            value = number(next(left)[0], signed)
            expected += -value if negated else value
        values = {net: bit for row, nets in zip(bits, operands) for bit, net in zip(row, nets)}
        assert evaluate(module, values) == [expected >> k & 1 for k in read or range(width)]
