"""gs_ram against a dictionary."""

import cocotb
from cocotb.triggers import RisingEdge

from tb.lib.stream import rng, start_clock

TOP = "gs_ram"
PARAMETERS = [{"WIDTH": 1, "DEPTH": 2}, {"WIDTH": 48, "DEPTH": 20}]


def depth() -> int:
    return int(cocotb.top.DEPTH.value)


@cocotb.test()
async def test_a_read_gives_the_word_written_before_that_cycle(dut):
    start_clock(dut)
    generator = rng("ram")
    memory: dict[int, int] = {}
    expected = None  # word on rd_data; None before the first read of a written word
    clashes = 0
    dut.rd_en.value = 0
    dut.wr_en.value = 0
    await RisingEdge(dut.clk)
    for step in range(2000):
        write = step < depth() or generator.random() < 0.5
        read = generator.random() < 0.7
        wr_addr = step if step < depth() else generator.randrange(depth())
        rd_addr = wr_addr if generator.random() < 0.2 else generator.randrange(depth())
        data = generator.getrandbits(len(dut.wr_data))
        dut.wr_en.value, dut.wr_addr.value, dut.wr_data.value = write, wr_addr, data
        dut.rd_en.value, dut.rd_addr.value = read, rd_addr
        await RisingEdge(dut.clk)
        if expected is not None:
            assert int(dut.rd_data.value) == expected, f"step {step}"
        if read:
            expected = memory.get(rd_addr)
            clashes += write and rd_addr == wr_addr
        if write:
            memory[wr_addr] = data
    assert clashes > 100
