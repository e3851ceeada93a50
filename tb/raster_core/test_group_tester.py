"""gs_group_tester: hits of every entry with every group, and the lists, in the cycles that golden names."""

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden import params
from golden.formats import BUILD
from golden.raster_core import group_tester
from tb.lib.stream import cycle, reset, rng, start_clock
from tb.raster_core.scenes import on_edges, record_words, scene, walls

TOP = "gs_group_tester"
SLOW = True
SIZE = (130, 70)
SLOT_W = (params.CHUNK - 1).bit_length()


def bitmaps(features, slots, x0: int, y0: int, size: tuple[int, int]) -> np.ndarray:
    """[n] uint64"""
    found = [
        group_tester.tile_bits(BUILD, *features.chol[g], *features.mean[g], features.opacity[g], x0, y0, *size)
        for g in slots
    ]
    return np.array(found, np.uint64)


class Blender:
    """Takes the lists: reads every slot of them, and frees them after a random time, or at once."""

    def __init__(self, dut, patience: int) -> None:
        self.dut, self.patience, self.random = dut, patience, rng("blender", patience)
        self.lists: list = []
        self.done: list[int] = []  # cycle of each list_done
        self.shown: list[int] = []  # first cycle of each list_valid
        dut.list_done.value = 0
        dut.list_en.value = 0
        cocotb.start_soon(self.run())

    def counts(self) -> list[int]:
        word = int(self.dut.list_count.value)
        return [word >> s * (SLOT_W + 1) & 2 * params.CHUNK - 1 for s in range(4)]

    async def run(self) -> None:
        dut, edge = self.dut, RisingEdge(self.dut.clk)
        while True:
            await edge
            if dut.rst.value or not dut.list_valid.value:
                continue
            self.shown.append(cycle())
            counts = self.counts()
            lists: list = [[] for _ in range(4)]
            if self.patience:
                for pos in range(max(counts, default=0)):
                    dut.list_en.value = sum((pos < counts[s]) << s for s in range(4))
                    dut.list_pos.value = sum(pos << s * SLOT_W for s in range(4))
                    await edge
                    dut.list_en.value = 0
                    await edge
                    slots = dut.list_slot.value
                    for s in range(4):
                        if pos < counts[s]:
                            lists[s].append(int(slots[s * SLOT_W + SLOT_W - 1 : s * SLOT_W]))
                for _ in range(self.random.randrange(self.patience)):
                    await edge
                    assert dut.list_valid.value == 1
                assert counts == self.counts()
                self.lists.append(lists)
            dut.list_done.value = 1
            await edge
            self.done.append(cycle())
            dut.list_done.value = 0


async def run(dut, lengths: list[int], patience: int, check_cycles: bool, far=(0, 0), features=None) -> None:
    """Batches of these lengths, offered back to back; the scene lies `far` pixels from the origin."""
    size = (SIZE[0] + far[0], SIZE[1] + far[1])
    features = features or scene(sum(lengths), *SIZE, seed=patience, sigma=6.0)
    features.mean += np.array(far) << BUILD.mean_f
    geometry = [word & (1 << BUILD.geometry_w) - 1 for word in record_words(features)]
    start_clock(dut)
    dut.cfg_width.value, dut.cfg_height.value = size
    dut.test_valid.value = 0
    blender = Blender(dut, patience)
    await reset(dut)
    edge = RisingEdge(dut.clk)
    origins = [(0, 0), (128, 64), (64, 0), (128, 0), (0, 64)]
    batches, first = [], 0
    for at, n in enumerate(lengths):
        x0, y0 = origins[at % len(origins)]
        batches.append((range(first, first + n), x0 + far[0], y0 + far[1]))
        first += n
    hits, reads, wanted, at = [], [], [], 0
    offered = False
    idle = 0
    while idle < 40:
        if not offered and at < len(batches):
            slots, x0, y0 = batches[at]
            dut.test_valid.value, dut.test_n.value = 1, len(slots)
            dut.test_x.value, dut.test_y.value = x0, y0
            offered = True
        await edge
        word = None
        if dut.geometry_en.value:
            reads.append(cycle())
            word = geometry[slots[int(dut.geometry_slot.value)]]
        if dut.hit_valid.value:
            outputs = (dut.hit_group, dut.hit_slot, dut.hit_units, dut.hit_first, dut.hit_last)
            hits.append((cycle(), *(int(signal.value) for signal in outputs)))
        if offered and dut.test_issued.value:
            found = group_tester.group_hits(bitmaps(features, slots, x0, y0, size))
            wanted += [(found[g], len(slots)) for g in range(params.GROUPS) if len(slots)]
            at, offered = at + 1, False
            dut.test_valid.value = 0
        if word is not None:
            dut.geometry.value = word
        idle = idle + 1 if at == len(batches) and len(blender.done) == len(wanted) else 0

    expected = []
    for number, (group_hits, n) in enumerate(wanted):
        group = number % params.GROUPS
        for slot in range(n):
            last = int(group == params.GROUPS - 1 and slot == n - 1)
            expected.append((group, slot, int(group_hits[slot]), int(group == 0), last))
    assert [hit[1:] for hit in hits] == expected
    assert [hit[0] for hit in hits] == [c + group_tester.LATENCY for c in reads]
    if patience:
        assert blender.lists == [group_tester.lists(group_hits) for group_hits, _ in wanted]
    if check_cycles:
        free, shown, read = reads[0] - 1, 0, 0
        for number, (_, n) in enumerate(wanted):
            if number >= 2:
                free = max(free, blender.done[number - 2] + 1)
            end = group_tester.group_end(free, n)
            assert reads[read : read + n] == list(range(end - n + 1, end + 1)), f"group {number}"
            shown = max(end + group_tester.LATENCY + 1, blender.done[number - 1] + 1 if number else 0)
            assert blender.shown[number] == shown, f"lists of group {number}"
            free, read = end + 1, read + n


@cocotb.test()
@cocotb.parametrize(patience=[20, 300])
async def test_hits_and_lists(dut, patience):
    await run(dut, [40, 0, 1, 1, 25], patience=patience, check_cycles=False)


@cocotb.test()
async def test_a_full_batch_of_large_ones_in_the_far_corner(dut):
    """Lists of up to 256; positions up to the end of their range."""
    large = scene(params.CHUNK + 3, *SIZE, seed=1, sigma=60.0)
    await run(dut, [params.CHUNK, 3], patience=1, check_cycles=False, far=(8000, 8000), features=large)


@cocotb.test()
async def test_lists_as_long_as_they_get(dut):
    await run(dut, [params.CHUNK], patience=3, check_cycles=False, features=walls(params.CHUNK))


@cocotb.test()
async def test_where_one_code_changes_the_hits(dut):
    await run(dut, [params.CHUNK], patience=1, check_cycles=False, features=on_edges(params.CHUNK, *SIZE, (0, 0)))


@cocotb.test()
@cocotb.parametrize(n=[1, 2, 9, 40])
async def test_groups_follow_each_other_one_cycle_apart(dut, n):
    """Lists are freed at once, so that only short groups wait for a set of lists."""
    await run(dut, [n, n], patience=0, check_cycles=True)
