"""What surrounds gs_queue_blender in its bench: tester, features and resolver, and golden's answer."""

from collections import deque

import numpy as np
from cocotb.triggers import RisingEdge

from golden import params
from golden.formats import BUILD, narrow
from golden.raster_core import queue_blender as golden
from golden.raster_core import subtile_blender
from golden.raster_core import subtile_compute_unit as scu
from golden.raster_core.hit_queue import MARK_DELAY
from tb.lib.stream import cycle, rng
from tb.raster_core import pixel_buffers
from tb.raster_core.scenes import record_words

FEATURE_W = BUILD.geometry_w + 3 * BUILD.colour_w
UNITS = params.UNITS
BANKS = 3


class Tile:
    """What to blend. batches: (Gaussians of the slots, hits [GROUPS] of (slot, units)); the last one may be empty."""

    def __init__(self, x0: int, y0: int, batches: list) -> None:
        self.x0, self.y0, self.batches = x0, y0, batches
        self.hits: list = []  # of each batch: [GROUPS, UNITS] hits
        self.operations: list = []
        self.blends = 0
        self.state = np.empty((params.SUBTILES, 4, scu.PIXELS), np.int32 if narrow(BUILD) else np.int64)

    def blend(self, features, size) -> None:
        """Everything that does not depend on time."""
        subtile_blender.fresh_tile(BUILD, self.state, self.x0, self.y0, *size)
        held = np.full(UNITS, subtile_blender.NONE, np.int64)
        known_done = np.zeros(params.SUBTILES, np.bool_)
        columns = features.mean, features.chol, features.opacity, features.colour
        for slots, groups in self.batches:
            hits, operations = np.zeros((2, params.GROUPS, UNITS), np.int64)
            for group, pushes in enumerate(groups):
                for unit in range(UNITS):
                    listed = np.array([slots[slot] for slot, units in pushes if units >> unit & 1], np.int64)
                    hits[group, unit] = len(listed)
                    operations[group, unit], blends = subtile_blender.blend_subtile(
                        BUILD, self.state, group * UNITS + unit, self.x0, self.y0, listed, *columns, held, known_done
                    )
                    self.blends += blends
            self.hits.append(hits)
            self.operations.append(operations)


class Bench:
    """What surrounds the blender, and what it was seen to do."""

    def __init__(self, dut, features, size, gaps: float) -> None:
        self.dut, self.features, self.edge = dut, features, RisingEdge(dut.clk)
        self.words = [word & (1 << FEATURE_W) - 1 for word in record_words(features)]
        self.size, self.gaps, self.random = size, gaps, rng("push", gaps)
        self.banks: list = [[]] * BANKS
        self.open: deque = deque()  # origins of the batches that are not blended
        self.closes: list[int] = []
        self.blended: list[int] = []
        self.stored: list[int] = []
        self.resolved: list[int] = []
        self.reads: list[list] = [[] for _ in range(UNITS)]  # (cycle of the issue, bank, slot)
        self.pushed = [0] * UNITS
        self.blends = 0
        for name in ("push_valid", "close", "resolve_done", "pixel_en"):
            getattr(dut, name).value = 0

    def used(self, name: str) -> list[int]:
        """slot_used or mark_used, by units."""
        signal = getattr(self.dut, name)
        width, value = len(signal) // UNITS, int(signal.value)
        return [value >> unit * width & (1 << width) - 1 for unit in range(UNITS)]

    async def observe(self, origin: int) -> None:
        """Features one cycle behind their addresses, the blended batches, the cycles of everything."""
        dut = self.dut
        while True:
            dut.blend_x.value, dut.blend_y.value = self.open[0] if self.open else (self.random.getrandbits(13), 77)
            await self.edge
            if dut.feature_en.value:
                bank, slot = int(dut.feature_bank.value), int(dut.feature_slot.value)
                self.reads[(cycle() - 1 - origin) % UNITS].append((cycle() - 1, bank, slot))
                dut.feature.value = self.words[self.banks[bank][slot]]
            else:
                dut.feature.value = self.random.getrandbits(FEATURE_W)
            if dut.blend_done.value:
                self.blended.append(cycle())
                self.open.popleft()
            if dut.resolve_start.value:
                self.stored.append(cycle())
            for used, pushed, reads in zip(self.used("slot_used"), self.pushed, self.reads, strict=True):
                assert used <= pushed - len(reads) + 1, "more than there can be"
            valid = int(dut.trace_valid.value)
            lanes = int(dut.trace_blend.value) if valid else 0
            for unit in range(UNITS):
                if valid >> unit & 1:
                    self.blends += (lanes >> unit * params.LANES & (1 << params.LANES) - 1).bit_count()

    async def step(self, **values) -> None:
        """A cycle with these inputs of the tester."""
        for name in ("push_valid", "close", "close_end", "close_void"):
            getattr(self.dut, name).value = values.get(name, 0)
        self.dut.push_slot.value = values.get("push_slot", self.random.getrandbits(8))
        await self.edge
        self.dut.push_valid.value = self.dut.close.value = 0

    async def idle(self) -> None:
        while self.random.random() < self.gaps:
            await self.edge

    def room(self, n: int) -> bool:
        """Is there room for a list of n slots, if those that left in the last cycle still count?"""
        return max(self.used("slot_used")) <= params.QUEUE - n and max(self.used("mark_used")) < params.MARKS

    async def push(self, tiles: list[Tile]) -> None:
        """Hits as the tester gives them: a group once all queues have room for it, a batch once there is a bank."""
        at = 0
        for tile in tiles:
            for k, (slots, groups) in enumerate(tile.batches):
                while len(self.open) == BANKS:
                    await self.edge
                self.banks[at % BANKS] = slots
                self.open.append((tile.x0, tile.y0))
                at += 1
                last = k == len(tile.batches) - 1
                for group, pushes in enumerate(groups if slots else [[]]):
                    await self.edge  # the list before counts now
                    while not self.room(len(pushes)):
                        await self.edge
                    for slot, valid in pushes:
                        await self.idle()
                        await self.step(push_valid=valid, push_slot=slot)
                        self.pushed = [n + (valid >> unit & 1) for unit, n in enumerate(self.pushed)]
                    await self.idle()
                    end = last and (not slots or group == params.GROUPS - 1)
                    await self.step(close=1, close_end=int(end), close_void=int(not slots))
                    self.closes.append(cycle())

    async def resolve(self, tile: Tile) -> None:
        """Reads the pixel buffers of a tile as the resolver does, and frees them."""
        dut, state = self.dut, tile.state
        while not dut.resolve_start.value:
            await self.edge
        assert (int(dut.resolve_x.value), int(dut.resolve_y.value)) == (tile.x0, tile.y0)
        assert self.blends == tile.blends
        self.blends = 0
        await pixel_buffers.compare(dut, state)
        self.resolved.append(cycle())

    def compare(self, tiles: list[Tile], origin: int) -> None:
        """The cycles seen are those of golden; every unit read its lists, bank by bank."""
        units = golden.new_units(origin)
        reads: list[list] = [[] for _ in range(UNITS)]
        marks = iter(close + MARK_DELAY for close in self.closes)
        blended, stored, batch = [], [], 0
        for at, tile in enumerate(tiles):
            for (slots, groups), hits, operations in zip(tile.batches, tile.hits, tile.operations, strict=True):
                ends = []
                for group, pushes in enumerate(groups if slots else [[]]):
                    mark = next(marks)
                    ends = []
                    for unit in range(UNITS):
                        n, worked = int(hits[group, unit]), int(operations[group, unit])
                        ends.append(golden.blend_list(units, unit, group, n, worked, mark, origin))
                        listed = [slot for slot, valid in pushes if valid >> unit & 1] if worked else []
                        for k, slot in enumerate(listed):
                            number = units[unit, golden.SLOTS] - n + k + 1
                            reads[unit].append((golden.left(units, unit, number), batch % BANKS, slot))
                blended.append(max(ends) + 1)
                batch += 1
            stored.append(golden.store_end(units, origin))
            golden.next_tile(units, stored[-1], self.resolved[at] - stored[-1] - golden.RELEASE + 1)
        assert self.stored == stored
        assert self.blended == blended
        assert self.reads == reads
