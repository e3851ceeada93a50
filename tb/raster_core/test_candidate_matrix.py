"""gs_candidate_matrix: the words of every group of three batches, masks in any rhythm, and the cycle of done."""

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from golden import params
from golden.raster_core.candidate_matrix import BLOCK, done_cycle, words
from tb.lib.pipe import unknown
from tb.lib.stream import STALLS, _go, cycle, reset, rng, start_clock

TOP = "gs_candidate_matrix"
MASK = ("mask_bits", "mask_bank", "mask_last")
CAND = ("cand_bank", "cand_group", "cand_block")
BANKS = 3


def batch(n: int, seed: int) -> np.ndarray:
    """[n] masks, full and empty ones among them."""
    r = np.random.default_rng([seed, n])
    return np.where(r.random(n) < 0.2, r.choice([0, 0xFFFF], n), r.integers(0, 1 << params.GROUPS, n))


def drive(dut, names, values, generator) -> None:
    """Values of some inputs; None for unknown ones."""
    for name, value in zip(names, values or [None] * len(names), strict=True):
        signal = getattr(dut, name)
        signal.value = unknown(signal, generator) if value is None else int(value)


class Reader:
    """Reads the words of finished batches in a shuffled order, in any rhythm, and compares them."""

    def __init__(self, dut, stall: str) -> None:
        self.dut, self.random = dut, rng("reader", stall)
        self.go = _go(stall, self.random)
        self.todo: list[tuple] = []  # (bank, group, block, word, first cycle)
        self.read = 0
        cocotb.start_soon(self.run())

    def add(self, bank: int, masks: np.ndarray, first: int) -> None:
        """A batch that can be read from cycle `first` on."""
        part = [(bank, g, b, int(word), first) for g, row in enumerate(words(masks)) for b, word in enumerate(row)]
        self.random.shuffle(part)
        self.todo = part + self.todo

    async def run(self) -> None:
        dut, edge = self.dut, RisingEdge(self.dut.clk)
        held = None
        while True:
            ready = self.todo and cycle() + 1 >= self.todo[-1][4] and next(self.go)
            taken = self.todo.pop() if ready else None
            dut.cand_en.value = taken is not None
            drive(dut, CAND, taken and taken[:3], self.random)
            await edge
            if held is not None:
                assert str(dut.cand_bits.value) == f"{held[3]:0{BLOCK}b}", f"cycle {cycle()}: {held}"
            self.read += taken is not None
            held = taken or held


async def run(dut, lengths: list[int], mask_stall: str, read_stall: str) -> None:
    """Batches of these lengths into banks 0, 1, 2, 0, ..., each read before its bank is used again."""
    start_clock(dut)
    dut.mask_valid.value = 0
    reader = Reader(dut, read_stall)
    await reset(dut)
    edge, generator = RisingEdge(dut.clk), rng("masks", mask_stall)
    go = _go(mask_stall, generator)
    want_done, wanted = None, [0]  # words up to each batch
    for number, n in enumerate(lengths):
        masks, bank, at = batch(n, number), number % BANKS, 0
        while reader.read < wanted[max(number - BANKS + 1, 0)]:
            dut.mask_valid.value = 0
            drive(dut, MASK, None, generator)
            await edge
            assert bool(dut.done.value) == (cycle() == want_done)
        while at < n:
            moves = next(go)
            dut.mask_valid.value = moves
            drive(dut, MASK, (masks[at], bank, at == n - 1) if moves else None, generator)
            at += moves
            if at == n:
                reader.add(bank, masks, done_cycle(cycle() + 1))
            await edge
            assert bool(dut.done.value) == (cycle() == want_done), f"cycle {cycle()}, batch {number}"
        want_done = done_cycle(cycle())
        wanted.append(wanted[-1] + words(masks).size)
    dut.mask_valid.value = 0
    while reader.read < wanted[-1]:
        await edge
        assert bool(dut.done.value) == (cycle() == want_done)
    await edge
    await edge


@cocotb.test()
@cocotb.parametrize(stall=STALLS)
async def test_words_of_every_batch(dut, stall):
    await run(dut, [256, 1, 15, 16, 17, 40, 2, 255, 32, 1, 1, 1, 129], stall, "none")


@cocotb.test()
async def test_reads_in_any_rhythm(dut):
    await run(dut, [33, 7, 256, 90, 16], "none", "random")


@cocotb.test()
async def test_a_short_batch_hides_a_longer_one_in_its_bank(dut):
    """What a batch does not fill of its last word reads as 0, whatever was there before; it ends at each position."""
    lengths = [length for n in range(1, 17, 3) for length in (32, 32, 32, n, n + 1, n + 2)]
    await run(dut, [64, 64, 64, 3, 18, 33, *lengths], "none", "none")


@cocotb.test()
async def test_reset_begins_a_new_batch(dut):
    start_clock(dut)
    generator = rng("reset")
    dut.cand_en.value = 0
    await reset(dut)
    for _ in range(5):
        dut.mask_valid.value = 1
        drive(dut, MASK, (0xFFFF, 0, 0), generator)
        await RisingEdge(dut.clk)
    dut.rst.value = 1
    drive(dut, MASK, (0xFFFF, 0, 1), generator)
    for _ in range(2):
        await RisingEdge(dut.clk)
    assert not dut.done.value, "a last mask under reset ends no batch"
    dut.mask_valid.value = 0
    await run(dut, [3, 20], "none", "none")
