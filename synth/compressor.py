"""Multiplies and sums of many operands as trees of full adders: a pass over the netlist of Yosys behind `alumacc`.

Each $macc_v2 is a sum of products and addends modulo 2^W. It becomes columns of bits: a product a_i b_j counts 2^(i+j),
equal terms are added up (so a square needs half of them, a sign extension one bit), a negative term enters as its
complement, and all constants are one. Full adders reduce each column to two bits, earliest bits first; one $alu adds
what is left, and Yosys and ABC make of it what the clock asks for. Full adders of the library invert both outputs, so
bits carry a polarity and an adder takes three of one kind: with three inverted inputs its outputs are true. Terms may
have either polarity for the same price.
"""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import dataclass, field

from synth.adders import Adder, adder
from synth.cells import Cell

GATE, INVERT, CARRY, SUM, HALF = 20.0, 28.0, 36.0, 60.0, 35.0  # ps: a term, an inverter, a full adder, a half adder
MACC = "$macc_v2"


@dataclass(eq=False)
class Bit:
    """A bit of a column, ready after `time` ps: a term (one or two nets, maybe complemented) or an adder's output."""

    time: float
    term: tuple = ()
    complement: bool = False
    nets: dict[bool, int | str] = field(default_factory=dict)  # by polarity: False true, True inverted

    def ready(self, inverted: bool) -> float:
        """When the bit is there with a polarity."""
        return self.time + (0 if self.term or inverted in self.nets else INVERT)


@dataclass
class Tree:
    """Gates of one sum."""

    full: Adder
    half: Adder
    fresh: itertools.count
    patience: float  # ps that an adder may wait for bits that need no inverter
    gates: list[dict] = field(default_factory=list)

    def gate(self, kind: str, outputs: tuple[str, ...] = ("Y",), **inputs) -> list[int]:
        """Add a gate; returns the nets of its outputs."""
        nets = [next(self.fresh) for _ in outputs]
        outs = {pin: [net] for pin, net in zip(outputs, nets)}
        self.gates.append(cell(kind, {pin: [bit] for pin, bit in inputs.items()}, outs))
        return nets

    def net(self, bit: Bit, inverted: bool) -> int | str:
        """The net that carries a bit with a polarity, made where it is not there."""
        if inverted not in bit.nets:
            flip = inverted != bit.complement
            if len(bit.term) == 2:
                (made,) = self.gate("$_NAND_" if flip else "$_AND_", A=bit.term[0], B=bit.term[1])
            elif bit.term:
                made = self.gate("$_NOT_", A=bit.term[0])[0] if flip else bit.term[0]
            else:
                (made,) = self.gate("$_NOT_", A=bit.nets[not inverted])
            bit.nets[inverted] = made
        return bit.nets[inverted]

    def add(self, bits: list[Bit], one: bool = False, count: int = 3) -> tuple[Bit, Bit]:
        """Take the earliest three bits out of `bits` (or two, and the constant `one`); returns their carry and sum."""
        count = 2 if one else min(count, len(bits))

        def choice(inverted: bool) -> tuple[float, list[Bit]]:
            taken = sorted(bits, key=lambda bit: bit.ready(inverted))[:count]
            made = sum(bit.ready(inverted) > bit.time for bit in taken)
            return taken[-1].ready(inverted) + self.patience * made, taken

        uses = {False: choice(False), True: choice(True)}
        # a half adder cell adds true bits, and inverted bits with the constant 1
        inverted = one if count == 2 else uses[True][0] <= uses[False][0]
        taken = uses[inverted][1]
        for bit in taken:
            bits.remove(bit)
        nets = [self.net(bit, inverted) for bit in taken]
        shape = self.full if count == 3 else self.half
        carry, total = self.gate(shape.name, (shape.carry, shape.sum), **dict(zip(shape.inputs, nets)))
        time = taken[-1].ready(inverted)
        polarity = shape.inverted != inverted
        after = (CARRY, SUM) if count == 3 else (HALF, HALF)
        return Bit(time + after[0], nets={polarity: carry}), Bit(time + after[1], nets={polarity: total})


def cell(kind: str, inputs: dict[str, list], outputs: dict[str, list], **parameters: int) -> dict:
    """A cell as Yosys writes it."""
    sides = dict.fromkeys(inputs, "input") | dict.fromkeys(outputs, "output")
    text = {name: f"{value:032b}" for name, value in parameters.items()}
    return {
        "type": kind,
        "port_directions": sides,
        "connections": inputs | outputs,
        "parameters": text,
    }


def terms(macc: dict, width: int) -> tuple[Counter, int]:
    """{(net,) or (net, net): coefficient} and the constant of a $macc_v2."""
    wires, given = macc["connections"], macc["parameters"]

    def operands(port: str) -> list[list[tuple]]:
        """Of each operand its bits: (net, weight)."""
        at, found = 0, []
        for n in range(int(given["NADDENDS" if port == "C" else "NPRODUCTS"], 2)):
            size = int(given[f"{port}_WIDTHS"], 2) >> 16 * n & 0xFFFF
            signed = int(given[f"{port}_SIGNED"].replace("x", "0"), 2) >> n & 1
            bits = wires[port][at : at + size]
            at += size
            found.append([(bit, -(1 << k) if signed and k == size - 1 else 1 << k) for k, bit in enumerate(bits)])
        return found

    def negated(name: str, n: int) -> int:
        return -1 if int(given[name].replace("x", "0"), 2) >> n & 1 else 1

    found: Counter = Counter()
    for n, (a, b) in enumerate(zip(operands("A"), operands("B"))):
        for (x, weight), (y, other) in itertools.product(a, b):
            found[(x, y)] += weight * other * negated("PRODUCT_NEGATED", n)
    for n, c in enumerate(operands("C")):
        for x, weight in c:
            found[(x,)] += weight * negated("ADDEND_NEGATED", n)
    constant, result = 0, Counter()
    for nets, coefficient in found.items():
        if set(nets) & {"0", "x", "z"}:
            continue
        left = tuple(sorted(set(nets) - {"1"}))
        if left:
            result[left] += coefficient
        else:
            constant += coefficient
    return result, constant


def columns(macc: dict, width: int) -> tuple[list[list[Bit]], int]:
    """Bits of each column 0..width-1, and the constant."""
    found, constant = terms(macc, width)
    result: list[list[Bit]] = [[] for _ in range(width)]
    for nets, coefficient in sorted(found.items()):
        rest = (coefficient + (1 << width - 1)) % (1 << width) - (1 << width - 1)
        for k in range(width):  # digits -1, 0, 1, no two of them neighbours
            if rest & 1:
                digit = 2 - rest % 4 if k < width - 1 else 1
                rest -= digit
                result[k].append(Bit(GATE if len(nets) == 2 else 0.0, nets, digit < 0))
                constant -= (1 << k) if digit < 0 else 0
            rest //= 2
    return result, constant % (1 << width)


def depth(bits: list[list[Bit]]) -> float:
    """ps that full adders side by side take to bring all columns down to two bits (Dadda's heights)."""
    levels, height = 0, 2
    while height < max(map(len, bits)):
        levels, height = levels + 1, height * 3 // 2
    return GATE + SUM * levels


def reduce(tree: Tree, bits: list[list[Bit]], constant: int, ripple: float) -> tuple[list[Bit], list[list[Bit]]]:
    """Reduce all columns; returns the finished low bits and the two rows (and a carry into them) above.

    Low columns are finished bit by bit as long as that takes no longer than all columns do, and `ripple` ps more.
    """
    limit = depth(bits) + ripple
    done: list[Bit] = []
    rows: list[list[Bit]] = []
    for k in range(len(bits)):
        column = bits[k]
        one = bool(constant >> k & 1)
        above = bits[k + 1] if k + 1 < len(bits) else []

        def add(one: bool = False, count: int = 3, column=column, above=above) -> None:
            carry, total = tree.add(column, one, count)
            above.append(carry)
            column.append(total)

        if one and len(column) >= 2:
            add(one=True)
        elif one:
            column.append(Bit(0.0, nets={False: "1", True: "0"}))
        chain = not rows
        while len(column) > (3 if chain else 2):
            late = len(column) == 3 and max(bit.time for bit in column) + CARRY > limit
            add(count=2 if late else 3)  # a late carry stays, or it would run through all columns above
        if chain and len(column) > 1 and max(bit.time for bit in column) + SUM <= limit:
            add()
        if chain and len(column) == 1:
            done.append(column[0])
        elif chain and len(column) == 0:
            done.append(Bit(0.0, nets={False: "0"}))
        else:
            rows.append(column)
    return done, rows


def sum_of(tree: Tree, macc: dict, used: set[int], ripple: float) -> dict[int, int | str] | None:
    """Gates of a $macc_v2 whose bits in `used` are read: {bit of Y: net}; None where no column is higher than two."""
    y = macc["connections"]["Y"]
    width = max((k + 1 for k, net in enumerate(y) if net in used), default=0)
    if not width or max(map(len, columns(macc, width)[0])) < 3:
        return None
    done, rows = reduce(tree, *columns(macc, width), ripple=ripple)
    made = {y[k]: tree.net(bit, False) for k, bit in enumerate(done) if y[k] in used}
    if rows:
        pad = Bit(0.0, nets={False: "0"})
        full = [[*column, pad, pad, pad][:3] for column in rows]
        a, b = ([tree.net(column[side], False) for column in full] for side in (0, 1))
        size = len(rows)
        inputs = {"A": a, "B": b, "CI": [tree.net(full[0][2], False)], "BI": ["0"]}
        outs = {"Y": y[len(done) : width], **{pin: [next(tree.fresh) for _ in rows] for pin in ("X", "CO")}}
        widths = {"A_WIDTH": size, "B_WIDTH": size, "Y_WIDTH": size, "A_SIGNED": 0, "B_SIGNED": 0}
        tree.gates.append(cell("$alu", inputs, outs, **widths))
    return made


def prune(tree: Tree, used: set[int]) -> list[dict]:
    """The gates whose outputs are read."""
    kept: list[dict] = []
    used = set(used)
    for gate in reversed(tree.gates):
        wires, sides = gate["connections"], gate["port_directions"]
        outs = {pin for pin in wires if sides[pin] == "output" and set(wires[pin]) & used}
        if not outs:
            continue
        kept.append(gate)
        used |= {net for pin in wires if sides[pin] == "input" for net in wires[pin]}
    return kept[::-1]


def compress(module: dict, cells: dict[str, Cell], patience: float = 15.0, ripple: float = 0.0) -> int:
    """Replace the sums of a module by trees, in place; returns how many."""
    full, half = adder(cells, 3), adder(cells, 2)
    maccs = {name: found for name, found in module["cells"].items() if found["type"] == MACC}
    if not (full and half and maccs):
        return 0
    bits = [bit for found in module["cells"].values() for wires in found["connections"].values() for bit in wires]
    bits += [bit for port in module["ports"].values() for bit in port["bits"]]
    bits += [bit for name in module["netnames"].values() for bit in name["bits"]]
    fresh = itertools.count(max(bit for bit in bits if isinstance(bit, int)) + 1)
    used = {bit for port in module["ports"].values() if port["direction"] == "output" for bit in port["bits"]}
    for found in module["cells"].values():
        for pin, wires in found["connections"].items():
            if found["port_directions"].get(pin) != "output":
                used |= set(wires)
    same: dict = {}
    trees = 0
    for name, macc in maccs.items():
        tree = Tree(full, half, fresh, patience)
        made = sum_of(tree, macc, used, ripple)
        if made is None:
            continue
        same |= made
        del module["cells"][name]
        gates = prune(tree, used | set(made.values()))
        module["cells"] |= {f"tree{trees}_{n}": gate for n, gate in enumerate(gates)}
        trees += 1
    for found in module["cells"].values():
        found["connections"] = {
            pin: [same.get(bit, bit) for bit in wires] for pin, wires in found["connections"].items()
        }
    for port in (*module["ports"].values(), *module["netnames"].values()):
        port["bits"] = [same.get(bit, bit) for bit in port["bits"]]
    return trees
