"""Simulates a mapped netlist cycle by cycle, with delays, and adds up the energy of its toggles.

A pulse shorter than a gate's delay does not pass it; all others do, so that a net may toggle several times in a cycle:
what exceeds its change from one cycle to the next is glitches. Ports change when a flip-flop would. Registers and
memories start at 0, as in the Verilated RTL. Behind a clock gate a register takes its data, and its clock its energy,
only in enabled cycles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from synth.circuit import INPUTS, Circuit
from synth.netlist import CONSTANTS

CLOCK, LOGIC, GLITCH = range(3)  # columns of Activity.energy
SETTLE = 8192  # ps in which every net has its value
ROOM = 32  # changes of a net in a cycle, in the mean


@dataclass(frozen=True)
class Activity:
    """energy float64[cycles, 3] fJ: of the clock, of changes from cycle to cycle, of glitches; differ bool[cycles]:
    outputs unlike those expected; accesses int64[R, 2] of the memories: reads, writes."""

    energy: np.ndarray
    differ: np.ndarray
    accesses: np.ndarray


def run(c: Circuit, in_nets: np.ndarray, given: np.ndarray, out_nets: np.ndarray, expected: np.ndarray) -> Activity:
    """Simulate; given uint8[cycles, inputs], expected uint8[cycles, outputs]: values in front of each clock edge."""
    sides = in_nets.astype(np.int32), given, out_nets.astype(np.int32), expected
    logic = c.tables, c.sources, c.targets, c.delays, c.toggle
    flops = c.flop_in, c.flop_out, c.flop_inverts, c.flop_clock, c.clock_enable, c.tick
    return Activity(*_run(*sides, *logic, *flops, c.ram_nets, c.ram_at, c.ram_words))


@numba.njit(cache=True)
def _number(value, nets):
    found = 0
    for i in range(len(nets)):
        found |= np.int64(value[nets[i]]) << i
    return found


@numba.njit(cache=True)
def _output(value, table, s):
    """What a gate makes of the values at its inputs."""
    k = np.uint64(0)
    for i in range(INPUTS):
        k |= np.uint64(value[s[i]]) << np.uint64(i)
    return np.uint8(table >> k & np.uint64(1))


@numba.njit(cache=True)
def _readers(sources, nets):
    """Gates that read each net: (first [nets + 1], gates)."""
    first = np.zeros(nets + 1, np.int64)
    for s in sources:
        for net in s:
            first[net + 1] += net >= CONSTANTS
    first = np.cumsum(first)
    at, gates = first.copy(), np.zeros(first[-1], np.int32)
    for g in range(len(sources)):
        for net in sources[g]:
            if net >= CONSTANTS:
                gates[at[net]] = g
                at[net] += 1
    return first, gates


@numba.njit(cache=True)
def _push(net, when, due, head, event, count, last):
    """Let a net change at a time; returns the number of events and the last one's time."""
    if when >= len(head) or count >= len(event):
        raise RuntimeError("a net does not come to rest")
    due[net] = when
    event[count, 0], event[count, 1] = net, head[when]
    head[when] = count
    return count + 1, max(last, when)


@numba.njit(cache=True)
def _run(
    in_nets, given, out_nets, expected, tables, sources, targets, delays, toggle,
    flop_in, flop_out, flop_inverts, flop_clock, clock_enable, tick, ram_nets, ram_at, ram_words,
):  # fmt: skip
    nets, cycles = len(toggle), len(given)
    value = np.zeros(nets, np.uint8)
    value[1] = 1
    for g in range(len(targets)):
        value[targets[g]] = _output(value, tables[g], sources[g])
    first, readers = _readers(sources, nets)
    energy = np.zeros((cycles, 3))
    differ = np.zeros(cycles, np.bool_)
    held = flop_inverts.copy()  # the RTL's registers start at 0
    memory = np.zeros(ram_words[-1], np.uint8)
    read = np.zeros(len(ram_nets), np.uint8)
    accesses = np.zeros((len(ram_at), 2), np.int64)
    # Events: lists of nets by the time at which they change. A net has one to come, at `due`, or none (0); an entry
    # of a list whose time is not due any more is passed over.
    due = np.zeros(nets, np.int32)
    head = np.full(SETTLE, -1, np.int64)
    event = np.zeros((ROOM * nets, 2), np.int64)  # net, the next one in the list
    was = np.zeros(nets, np.uint8)
    seen = np.full(nets, -1, np.int64)  # the cycle in which it changed last
    touched = np.zeros(nets, np.int64)
    for t in range(cycles):
        count, last, many = 0, 0, 0
        for i in range(len(in_nets)):
            if value[in_nets[i]] != given[t, i]:
                count, last = _push(in_nets[i], delays[in_nets[i]], due, head, event, count, last)
        for f in range(len(flop_out)):
            if value[flop_out[f]] != held[f]:
                count, last = _push(flop_out[f], delays[flop_out[f]], due, head, event, count, last)
        for r in range(len(ram_at)):
            for i in range(ram_at[r, 5], ram_at[r, 6]):
                if value[ram_nets[i]] != read[i]:
                    count, last = _push(ram_nets[i], delays[ram_nets[i]], due, head, event, count, last)
        spent, now = 0.0, 0
        while now <= last:
            e = head[now]
            head[now] = -1
            while e >= 0:
                net, e = event[e]
                if due[net] != now:
                    continue
                due[net] = 0
                if seen[net] != t:
                    seen[net], was[net] = t, value[net]
                    touched[many] = net
                    many += 1
                value[net] ^= 1
                spent += toggle[net]
                for g in readers[first[net] : first[net + 1]]:
                    out = targets[g]
                    if _output(value, tables[g], sources[g]) == value[out]:
                        due[out] = 0  # a pulse that is too short
                    elif due[out] == 0:
                        count, last = _push(out, now + delays[out], due, head, event, count, last)
            now += 1
        for net in touched[:many]:
            if value[net] != was[net]:
                energy[t, LOGIC] += toggle[net]
        energy[t, GLITCH] = spent - energy[t, LOGIC]
        for i in range(len(out_nets)):
            if value[out_nets[i]] != expected[t, i]:
                differ[t] = True
        for d in range(len(tick)):
            if value[clock_enable[d]]:
                energy[t, CLOCK] += tick[d]
        for f in range(len(flop_in)):
            if value[clock_enable[flop_clock[f]]]:
                held[f] = value[flop_in[f]] ^ flop_inverts[f]
        for r in range(len(ram_at)):
            at = ram_at[r]
            width = at[3] - at[2]
            if value[ram_nets[at[3]]]:
                accesses[r, 0] += 1
                word = ram_words[r] + width * _number(value, ram_nets[at[4] : at[5]])
                for i in range(width):
                    read[at[5] + i] = memory[word + i]
            if value[ram_nets[at[0]]]:
                accesses[r, 1] += 1
                word = ram_words[r] + width * _number(value, ram_nets[at[1] : at[2]])
                for i in range(width):
                    memory[word + i] = value[ram_nets[at[2] + i]]
    return energy, differ, accesses
