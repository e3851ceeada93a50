"""A memory behind an AXI4 master port `<name>_arvalid`, `<name>_awvalid`, ...: fixed latency, or stalled at random.

    memory = bytearray(1 << 16)
    port = AxiMemory(dut, "m_axi", memory, read=40, write=20)
    port.ar: [(cycle, address, beats)]   port.aw: likewise   port.b: cycles of the responses

Without stalls every address and data beat is taken at once, R beats of the bursts follow one a cycle in order, `read`
cycles behind their AR, and B comes `write` cycles behind the last W beat; with late(channel "r" or "b", number of the
burst) so many cycles later. Fails the test on a burst across a 4 KB border, a wrong burst type or size, a wrong wlast,
and on a valid that falls or a field that changes before its beat.
"""

from __future__ import annotations

from collections import deque

import cocotb
from cocotb.triggers import RisingEdge

from tb.lib.stream import _go, cycle, rng

FIELDS = {"ar": ("addr", "len", "size", "burst"), "aw": ("addr", "len", "size", "burst"), "w": ("data", "strb", "last")}


class Everywhere:
    """A memory of 4 GB: bytes read as numbers of their addresses until they are written."""

    def __init__(self) -> None:
        self.written: dict[int, int] = {}

    def __len__(self) -> int:
        return 1 << 32

    def __getitem__(self, at: slice) -> bytes:
        return bytes(self.written.get(a, a * 0x9E3779B97F4A7C15 >> 32 & 0xFF) for a in range(at.start, at.stop))

    def __setitem__(self, at: int, value: int) -> None:
        self.written[at] = value


class AxiMemory:
    """Serves whichever of the read and the write channels the port has. Stalls as in stream.py, on every handshake."""

    def __init__(
        self, dut, name: str, memory: bytearray, read=40, write=20, stall="none", seed: object = 0, late=lambda *_: 0
    ) -> None:
        self.dut, self.name, self.memory, self.read, self.write, self.late = dut, name, memory, read, write, late
        self.reads, self.writes = (hasattr(dut, f"{name}_{channel}valid") for channel in ("ar", "aw"))
        assert self.reads or self.writes, f"{dut._name} has no port {name}"
        self.after_valid = stall == "after_valid"
        mode = "none" if self.after_valid else stall
        self.go = {c: _go(mode, rng(seed, name, c, stall)) for c in ("ar", "r", "aw", "w", "b")}
        self.width = len(self.signal("rdata" if self.reads else "wdata")) // 8
        self.ar: list[tuple[int, int, int]] = []
        self.aw: list[tuple[int, int, int]] = []
        self.b: list[int] = []
        self.w_cycles: list[int] = []
        self.r_cycles: list[int] = []
        self.answered = 0  # written bursts whose B is known
        self.answer = {"r": 0, "b": 0}  # rresp and bresp of what is answered from now on
        self._r: deque = deque()  # (first cycle, data, last)
        self._w: deque = deque()  # beats that no burst has claimed: (cycle, data, strb, last)
        self._open: deque = deque()  # bursts without all their beats: [cycle, address, beats]
        self._b: deque = deque()
        self._held: dict = {}
        cocotb.start_soon(self._run())

    def signal(self, suffix: str):
        return getattr(self.dut, f"{self.name}_{suffix}")

    def _beat(self, channel: str):
        """Fields of the beat that moves at this edge, or None; checks that an offer holds."""
        held = self._held.pop(channel, None)
        if not int(self.signal(f"{channel}valid").value):
            assert held is None, f"{self.name}_{channel}valid fell in cycle {cycle()}"
            return None
        beat = tuple(int(self.signal(channel + field).value) for field in FIELDS[channel])
        assert held in (None, beat), f"{self.name} {channel} changed from {held} to {beat} in cycle {cycle()}"
        if int(self.signal(f"{channel}ready").value):
            return beat
        self._held[channel] = beat
        return None

    def _ready(self, channel: str) -> None:
        """Drive ready for the next cycle; with after_valid only once an offer has been seen to wait."""
        waits = channel in self._held or not self.after_valid
        self.signal(f"{channel}ready").value = waits and next(self.go[channel])

    def _burst(self, beat) -> tuple[int, int]:
        """(address, beats) of a legal burst."""
        address, length, size, burst = beat
        beats = length + 1
        assert burst == 1 and 1 << size == self.width and address % self.width == 0, f"{self.name}: {beat}"
        assert address // 4096 == (address + beats * self.width - 1) // 4096, f"{self.name} crosses 4 KB: {beat}"
        assert address + beats * self.width <= len(self.memory), f"{self.name} is outside of the memory: {beat}"
        return address, beats

    def _read(self, now: int) -> None:
        if int(self.signal("rvalid").value) and int(self.signal("rready").value):
            self._r.popleft()
            self.r_cycles.append(now)
            self.signal("rvalid").value = 0
            self._offered_r = False
        if (beat := self._beat("ar")) is not None:
            address, beats = self._burst(beat)
            there = now + self.read + self.late("r", len(self.ar))
            self.ar.append((now, address, beats))
            for k in range(beats):
                at = address + k * self.width
                data = int.from_bytes(self.memory[at : at + self.width], "little")
                self._r.append((there, data, k == beats - 1))
        if not self._offered_r and self._r and self._r[0][0] <= now + 1 and next(self.go["r"]):
            self._offered_r = True
            self.signal("rvalid").value = 1
            self.signal("rdata").value = self._r[0][1]
            self.signal("rlast").value = self._r[0][2]
            self.signal("rresp").value = self.answer["r"]
        self._ready("ar")

    def _write(self, now: int) -> None:
        if int(self.signal("bvalid").value) and int(self.signal("bready").value):
            self._b.popleft()
            self.b.append(now)
            self.signal("bvalid").value = 0
            self._offered_b = False
        if (beat := self._beat("aw")) is not None:
            address, beats = self._burst(beat)
            self.aw.append((now, address, beats))
            self._open.append([address, beats])
        if (beat := self._beat("w")) is not None:
            self.w_cycles.append(now)
            self._w.append(beat)
        while self._open and self._w:
            data, strb, last = self._w.popleft()
            address, beats = self._open[0]
            assert last == (beats == 1), f"{self.name}_wlast is {last} with {beats} beats left, cycle {now}"
            for k in range(self.width):
                if strb >> k & 1:
                    self.memory[address + k] = data >> 8 * k & 0xFF
            self._open[0] = [address + self.width, beats - 1]
            if last:
                self._open.popleft()
                self._b.append(now + self.write + self.late("b", self.answered))
                self.answered += 1
        if not self._offered_b and self._b and self._b[0] <= now + 1 and next(self.go["b"]):
            self._offered_b = True
            self.signal("bvalid").value = 1
            self.signal("bresp").value = self.answer["b"]
        self._ready("aw")
        self._ready("w")

    def idle(self) -> bool:
        """Nothing is under way."""
        return not (self._r or self._w or self._open or self._b)

    async def _run(self) -> None:
        edge = RisingEdge(self.dut.clk)
        inputs = (("rvalid", "arready") if self.reads else ()) + (
            ("bvalid", "awready", "wready") if self.writes else ()
        )
        await edge
        while True:
            self._offered_r = self._offered_b = False
            for suffix in inputs:
                self.signal(suffix).value = 0
            for queue in (self._r, self._w, self._open, self._b):
                queue.clear()
            self._held.clear()
            while int(self.dut.rst.value):
                await edge
            while not int(self.dut.rst.value):
                now = cycle()
                if self.reads:
                    self._read(now)
                if self.writes:
                    self._write(now)
                await edge
