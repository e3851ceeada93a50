"""The trace ports of a core, or of a lane around it, and what golden says of them."""

from __future__ import annotations

from itertools import pairwise

import cocotb
from cocotb.triggers import RisingEdge

from golden import params
from golden.formats import BUILD
from golden.raster_core import batch_buffer, group_tester, pixel_resolver


def known(value) -> int:
    """An unknown bit, as of a pixel outside the picture, reads as 0."""
    return int(value) if value.is_resolvable else int("".join(c if c in "01" else "0" for c in str(value)), 2)


class Trace:
    """Tests (group, slot, hits), the beats of pixels (rgb, last of a tile), and the number of pixels blended."""

    def __init__(self, dut) -> None:
        self.dut = dut
        self.tests: list[tuple[int, int, int]] = []
        self.beats: list[tuple[int, int]] = []
        self.blends = 0
        cocotb.start_soon(self.watch())

    def moves(self) -> bool:
        """Does a beat of pixels move?"""
        dut = self.dut
        if hasattr(dut, "trace_px_valid"):
            return bool(dut.trace_px_valid.value)
        return bool(dut.px_valid.value and dut.px_ready.value)

    async def watch(self) -> None:
        dut, edge = self.dut, RisingEdge(self.dut.clk)
        while True:
            await edge
            if dut.rst.value:
                continue
            if dut.trace_itu_valid.value:
                test = dut.trace_itu_group, dut.trace_itu_slot, dut.trace_itu_hits
                self.tests.append(tuple(int(signal.value) for signal in test))
            if self.moves():
                self.beats.append((known(dut.trace_px_rgb.value), int(dut.trace_tile_done.value)))
            else:
                assert not dut.trace_tile_done.value
            valid = int(dut.trace_blend_valid.value)
            if valid:
                lanes = dut.trace_blend.value
                for unit in range(params.UNITS):
                    if valid >> unit & 1:
                        low = unit * params.LANES
                        self.blends += int(lanes[low + params.LANES - 1 : low]).bit_count()


def expected_tests(result, offsets) -> list:
    """Every (group, slot, hits) in the order of the tests."""
    out = []
    for begin, end in pairwise(offsets):
        for first, n in batch_buffer.batches(end - begin):
            hits = group_tester.group_hits(result.bitmaps[begin + first : begin + first + n])
            out += [(group, slot, int(hits[group, slot])) for group in range(params.GROUPS) for slot in range(n)]
    return out


def expected_pixels(result, tile_xy, width, height) -> list:
    """Every (data, strb, last, rgb) of the pixel stream, dead pixels 0."""
    out = []
    for x0, y0 in tile_xy:
        where = slice(y0, min(y0 + 64, height)), slice(x0, min(x0 + 64, width))
        out += pixel_resolver.beats(BUILD, result.value[where], result.rgb8[where])
    return out
