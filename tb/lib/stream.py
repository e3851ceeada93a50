"""Drivers and observers of one stream: `<chan>_valid`, `<chan>_ready`, `<chan>_<field>`.

A beat moves on a rising clock edge where valid and ready are both high and reset is low. All agents sample just before
the edge and drive just behind it. Beats are tuples of unsigned integers in the order of `fields`; a field that is not
fully known in a four-state simulator reads as None, and None in an expected beat means "anything".

    start_clock(dut)
    src, sink = Source(dut, "a", ("entry", "last")), Sink(dut, "out", ("entry", "last"), stall="random")
    await reset(dut)
    src.send([(7, 0), (0, 1)])
    await sink.wait(2)
    assert sink.beats == [(7, 0), (0, 1)] and sink.cycles == [4, 5]
"""

from __future__ import annotations

import os
import random
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import cocotb
from cocotb import Param
from cocotb.clock import Clock
from cocotb.handle import LogicArrayObject
from cocotb.triggers import Event, RisingEdge
from cocotb.utils import get_sim_time

PERIOD = 10  # of the clock, in simulation steps
STALLS = ("none", "three_of_four", "random", "burst")
SEED = int(os.environ.get("SEED", "1"))

Beat = tuple[int | None, ...]


def rng(*names: object) -> random.Random:
    """Generator that depends on SEED and the names only, so that a failing run is replayed with SEED=."""
    return random.Random("/".join(map(str, (SEED, *names))))


def stall_pairs(test: Callable) -> Callable:
    """Run a test under pairs of stalls (STALLS=few: two); sinks last ready only behind a cycle of valid (rule 3)."""
    every = [(a, b) for a in STALLS for b in STALLS] + [("none", "after_valid"), ("random", "after_valid")]
    pairs = [("none", "none"), ("random", "random")] if os.environ.get("STALLS") == "few" else every
    named = [tuple(Param(value=stall, name=stall) for stall in pair) for pair in pairs]
    return cocotb.parametrize((("source_stall", "sink_stall"), named))(test)


def start_clock(dut) -> None:
    """Clock whose rising edge k falls into cycle() k; rst, where there is one, starts high."""
    dut._log.info("SEED=%d", SEED)
    if hasattr(dut, "rst"):
        dut.rst.value = 1
    Clock(dut.clk, PERIOD, unit="step").start(start_high=False)


def cycle() -> int:
    """Number of the clock edge this moment belongs to; differences of cycles are what golden's formulas give."""
    return get_sim_time("step") // PERIOD


async def reset(dut, cycles: int = 3) -> None:
    """Hold rst for some edges. Sources keep their queues (see Source.clear) and offer nothing meanwhile."""
    dut.rst.value = 1
    for _ in range(cycles):
        await RisingEdge(dut.clk)
    dut.rst.value = 0
    await RisingEdge(dut.clk)


def four_state() -> bool:
    """Whether the simulator knows X. Verilator does not."""
    return not cocotb.SIM_NAME.lower().startswith("verilator")


def _go(stall: str, generator: random.Random) -> Iterator[bool]:
    """One value a cycle: may the stream move?"""
    if stall not in STALLS:
        raise ValueError(f"stall {stall!r}: want one of {', '.join(STALLS)}")
    if stall == "none":
        while True:
            yield True
    elif stall == "three_of_four":  # stalled in three cycles of four
        while True:
            yield from (False, False, False, True)
    elif stall == "random":
        while True:
            yield generator.random() < 0.5
    while True:  # burst: long runs of both
        moving = generator.random() < 0.5
        for _ in range(generator.randint(1, 40)):
            yield moving


def _number(bits: str) -> int | None:
    """Unsigned value of a string of bits (much faster than int() of a LogicArray); None when any is unknown."""
    try:
        return int(bits, 2)
    except ValueError:
        return None


class Channel:
    """The signals of one stream of a DUT, and the loop that looks at them once a cycle."""

    def __init__(self, dut, name: str, fields: Sequence[str]) -> None:
        self.dut, self.name, self.fields = dut, name, tuple(fields)
        self.valid = self._signal("valid")
        self.ready = self._signal("ready")
        self.data = [self._signal(field) for field in self.fields]
        self.rst = dut.rst
        self.edge = RisingEdge(dut.clk)

    def _signal(self, suffix: str):
        try:
            return getattr(self.dut, f"{self.name}_{suffix}")
        except AttributeError:
            raise AttributeError(
                f"{self.dut._name} has no signal {self.name}_{suffix} for a stream's {suffix}"
            ) from None

    def read(self) -> Beat:
        """The fields as they stand; None where not fully known."""
        return tuple(_number(str(signal.value)) for signal in self.data)

    def in_reset(self) -> bool:
        return str(self.rst.value) != "0"

    def high(self, signal) -> bool:
        """Value of a handshake signal, which must never be unknown once reset is over."""
        value = str(signal.value)
        if value not in "01":
            raise AssertionError(f"cycle {cycle()}: {signal._name} is {value}")
        return value == "1"


class Source(Channel):
    """Sends a queue of beats. While it offers nothing the fields are X (random on a two-state simulator)."""

    def __init__(
        self, dut, name: str, fields: Sequence[str] = ("data",), stall: str = "none", seed: object = 0
    ) -> None:
        super().__init__(dut, name, fields)
        self.random = rng(seed, name, "source", stall)
        self.go = _go(stall, self.random)
        self.four_state = four_state()
        self.queue: deque[Beat] = deque()
        self.cycles: list[int] = []  # when each beat moved
        self._offered: Beat | None = None
        self._idle = Event()
        self._work = Event()
        self._drive(None)
        cocotb.start_soon(self._run())

    def send(self, beats: Iterable[Sequence[int | None] | Mapping[str, int | None]]) -> None:
        """Queue beats: tuples in the order of the fields, or dicts. None sends an unknown field."""
        for beat in beats:
            values = tuple(beat[f] for f in self.fields) if isinstance(beat, Mapping) else tuple(beat)
            if len(values) != len(self.fields) or len(beat) != len(values):
                raise ValueError(f"beat {beat} on {self.name}: want the fields {', '.join(self.fields)}")
            self.queue.append(values)
        self._idle.clear()
        self._work.set()

    def clear(self) -> None:
        """Withdraw everything that has not moved; call it under reset, or the offered beat breaks rule 2."""
        self.queue.clear()
        self._offered = None
        self._drive(None)

    async def drained(self) -> None:
        """Wait until every queued beat has moved."""
        while self.queue or self._offered is not None:
            await self._idle.wait()

    def _bits(self, signal, value: int | None) -> int | str:
        """What to write: a value in the range of the signal's sign, or something unknown."""
        width = len(signal)
        if value is None:
            return "X" * width if self.four_state else f"{self.random.getrandbits(width):0{width}b}"
        if not -(1 << width - 1) <= value < 1 << width:
            raise ValueError(f"{value} does not fit the {width} bits of {signal._name}")
        value %= 1 << width
        signed = isinstance(signal, LogicArrayObject) and signal.is_signed
        return value - (1 << width) if signed and value >> width - 1 else value

    def _drive(self, beat: Beat | None) -> None:
        self.valid.value = beat is not None
        for signal, value in zip(self.data, beat or [None] * len(self.data), strict=True):
            signal.value = self._bits(signal, value)

    async def _run(self) -> None:
        while True:
            was_offered = self._offered is not None
            if was_offered or self.queue:
                await self.edge
                if self._offered is not None:
                    if self.in_reset():
                        self.queue.appendleft(self._offered)
                    elif self.high(self.ready):
                        self.cycles.append(cycle())
                    else:
                        continue
            else:  # a beat queued just behind an edge is offered there: the next edge may take it
                self._idle.set()
                self._work.clear()
                await self._work.wait()
            self._offered = self.queue.popleft() if self.queue and not self.in_reset() and next(self.go) else None
            if was_offered or self._offered is not None:
                self._drive(self._offered)


class Sink(Channel):
    """Takes beats and keeps them: `beats`, and the cycle each moved in, `cycles`."""

    def __init__(
        self,
        dut,
        name: str,
        fields: Sequence[str] = ("data",),
        stall: str = "none",
        seed: object = 0,
        after_valid: bool = False,
    ) -> None:
        super().__init__(dut, name, fields)
        self.after_valid = after_valid or stall == "after_valid"
        self.go = _go("none" if stall == "after_valid" else stall, rng(seed, name, "sink", stall))
        self.beats: list[Beat] = []
        self.cycles: list[int] = []
        self._beat = Event()
        self.ready.value = 0
        cocotb.start_soon(self._run())

    async def wait(self, n: int, timeout_cycles: int = 100_000) -> None:
        """Return at the edge on which beat n (counted from the start) moves."""
        end = cycle() + timeout_cycles
        while len(self.beats) < n:
            if cycle() > end:
                raise AssertionError(f"{self.name}: {len(self.beats)} of {n} beats after {timeout_cycles} cycles")
            await self.edge

    def clear(self) -> None:
        """Forget the beats taken so far."""
        self.beats.clear()
        self.cycles.clear()

    async def _run(self) -> None:
        ready = False
        while True:
            await self.edge
            if self.in_reset():
                ready = False
                self.ready.value = 0
                continue
            valid = self.high(self.valid)
            if valid and ready:
                self.beats.append(self.read())
                self.cycles.append(cycle())
            allowed = not self.after_valid or (valid and not ready)
            want = allowed and next(self.go)
            if want != ready:
                ready = want
                self.ready.value = want


class Monitor(Channel):
    """Drives nothing and fails the test on a broken rule: valid and fields hold until the beat; no valid in reset."""

    def __init__(self, dut, name: str, fields: Sequence[str] = ("data",)) -> None:
        super().__init__(dut, name, fields)
        self.beats: list[Beat] = []
        self.cycles: list[int] = []
        cocotb.start_soon(self._run())

    async def _run(self) -> None:
        held: Beat | None = None
        was_reset = False
        while True:
            await self.edge
            if self.in_reset():
                if was_reset:
                    assert not self.high(self.valid), f"cycle {cycle()}: {self.name}_valid under reset"
                held, was_reset = None, True
                continue
            was_reset = False
            if not self.high(self.valid):
                assert held is None, f"cycle {cycle()}: {self.name}_valid fell before its beat moved"
                continue
            beat = self.read()
            assert held is None or beat == held, f"cycle {cycle()}: {self.name} changed from {held} to {beat}"
            held = beat
            if self.high(self.ready):
                self.beats.append(beat)
                self.cycles.append(cycle())
                held = None


class Scoreboard:
    """Beats in order, exact, and none left at the end; None in an expected beat fits anything."""

    def __init__(self, sink: Sink | Monitor) -> None:
        self.sink = sink
        self.expected: list[Beat] = []

    def expect(self, beats: Iterable[Sequence[int | None]]) -> None:
        self.expected.extend(tuple(beat) for beat in beats)

    async def finish(self, timeout_cycles: int = 100_000, quiet_cycles: int = 20) -> None:
        """Wait for the expected beats and some cycles more, then compare."""
        end = cycle() + timeout_cycles
        while len(self.sink.beats) < len(self.expected) and cycle() <= end:
            await self.sink.edge
        for _ in range(quiet_cycles):
            await self.sink.edge
        for at, (got, want) in enumerate(zip(self.sink.beats, self.expected, strict=False)):
            fits = len(got) == len(want) and all(w is None or g == w for g, w in zip(got, want, strict=True))
            assert fits, f"{self.sink.name} beat {at}: got {got}, want {want}"
        assert len(self.sink.beats) == len(self.expected), (
            f"{self.sink.name}: {len(self.sink.beats)} beats, want {len(self.expected)}"
        )
