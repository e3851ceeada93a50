"""Area, timing and energy of the memories (gs_ram), which are macros and not part of the cell library.

Area: 351 um2 per KB, the density of the fakeram7 macros of OpenROAD-flow-scripts' ASAP7 platform (256x34: 365 um2); the
CACTI figures at 22 nm scaled by the bit cells (0.092 to 0.027 um2) give 254 to 261. It is linear, so small memories
come out too small, and the second port of a gs_ram is not in it. Timing: the same macros, one figure for all sizes.
Energy: CACTI at 22 nm (2 KB of 96 bits 0.67 pJ a read, 200 KB of 256 bits 25 pJ) follows 0.08 fJ * sqrt(bits) a bit
within a third but for the first; it is not scaled to 7 nm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

AREA_PER_KB = 351.0  # um2
ACCESS = 218.0  # ps from the clock edge to the data
SLEW = 11.0  # ps at the data pins
SETUP = 50.0  # ps
PIN_CAP = 5.0  # fF
ENERGY = 0.08  # fJ a bit and sqrt(bits)


@dataclass(frozen=True, order=True)
class Memory:
    width: int
    depth: int

    @property
    def bits(self) -> int:
        return self.width * self.depth

    @property
    def area(self) -> float:
        """um2."""
        return self.bits / 8192 * AREA_PER_KB

    @property
    def energy(self) -> float:
        """pJ an access, at 22 nm."""
        return ENERGY * math.sqrt(self.bits) * self.width / 1000
