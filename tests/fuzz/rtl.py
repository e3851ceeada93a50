"""The RTL's slice beside the golden model on random scenes, cameras and memory timings."""

from __future__ import annotations

from golden.cosim.model import STEP, CosimError

CYCLES = 20_000_000  # of a run; the largest here takes 2 million


class Bound:
    """Where Cosim reports its progress, every STEP cycles of a frame: ends a run that goes on for ever."""

    def __init__(self, cycles: int = CYCLES):
        self.left = cycles

    def add_task(self, name: str, total: int) -> int:
        return 0

    def update(self, task: int, completed: float) -> None:
        self.left -= STEP
        if self.left < 0:
            raise CosimError("the frames take more cycles than they may")
