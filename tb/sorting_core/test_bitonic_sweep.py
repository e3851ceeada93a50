"""gs_bitonic_sort_unit: sorts every group of zeros and ones, so it sorts every group (zero-one principle)."""

import cocotb
from cocotb.triggers import RisingEdge

from golden.sorting_core import bitonic_sort_unit as golden
from tb.lib.stream import cycle, reset, start_clock

TOP = "gs_bitonic_sweep"
SLOW = True
PARAMETERS = [{"SORT_N": n, "NETWORK": k, "ENTRY_W": 2} for n in (8, 16) for k in (golden.RING, golden.BITONIC)]
SIMULATORS = ("verilator",)


@cocotb.test()
async def test_every_group_of_zeros_and_ones_is_sorted(dut):
    start_clock(dut)
    await reset(dut)
    start = cycle()
    await RisingEdge(dut.done)
    n = int(dut.SORT_N.value)
    groups = (1 << n) // int(dut.UNITS.value)
    assert dut.groups.value == groups and dut.fault.value == 0
    last_entry = golden.cycles(n * groups, int(dut.NETWORK.value), n) - 2  # in front of the end beat
    assert cycle() - start == last_entry
