"""The pixel buffers of a blender, read as the resolver does."""

from __future__ import annotations

import numpy as np
from cocotb.triggers import RisingEdge

from golden import params
from golden.formats import BUILD
from golden.raster_core import subtile_blender
from golden.raster_core import subtile_compute_unit as scu

WORD_W = params.LANES * scu.state_w(BUILD)


async def compare(dut, state) -> None:
    """Compare them with golden's state of the tile [SUBTILES, 4, PIXELS], and free them."""
    edge = RisingEdge(dut.clk)
    touched = int(dut.touched.value)
    dead = state[:, 0] == subtile_blender.DEAD_T
    for word_at in range(params.GROUPS * params.BEATS):
        group, beat = divmod(word_at, params.BEATS)
        dut.pixel_en.value, dut.pixel_addr.value = 1, word_at
        await edge
        dut.pixel_en.value = 0
        await edge
        words = dut.pixel_words.value
        for unit in range(params.UNITS):
            subtile = group * params.UNITS + unit
            lanes = slice(beat * params.LANES, (beat + 1) * params.LANES)
            if touched >> unit * params.GROUPS + group & 1:
                word = int(words[unit * WORD_W + WORD_W - 1 : unit * WORD_W])
                t, acc, done = (field[..., : params.LANES] for field in scu.unpack(BUILD, [word] * params.BEATS))
                live = ~dead[subtile, lanes]
                np.testing.assert_array_equal(t[live], state[subtile, 0, lanes][live])
                np.testing.assert_array_equal(acc[:, live], state[subtile, 1:, lanes][:, live])
                stopped = state[subtile, 0, lanes] < BUILD.t_stop
                np.testing.assert_array_equal(done.astype(bool), stopped)
            else:
                assert (state[subtile, 1:, lanes] == 0).all()
    dut.resolve_done.value = 1
    await edge
    dut.resolve_done.value = 0
