"""Area of the whole machine at the settings of the number formats that were mapped, for the rows of a study.

area.json is written by `python -m synth --settings`: um2 of each core with its memories (docs/synthesis.md says what
that leaves out). A slice is SORT_CORES sorting cores and a raster core; the paper's COUNT of each unit are four slices.
"""

from __future__ import annotations

import json
import math
from functools import cache
from pathlib import Path

from golden.params import SORT_CORES, UNITS
from golden.report.reproduce.paper import COUNT

KEPT = Path(__file__).with_name("area.json")
SLICES = COUNT // UNITS
RASTER = {"neo": "gs_raster_core", "splatcore": "gs_late_core"}  # by hardware
FREE = (  # keys that change what the cores do, not the cores; the preprocessing engine is not part of the sum
    "setting", "entry_bytes", "record_stride", "depth", "passes", "cut_share", "refresh", "sh_degree", "colour_every",
    "channels", "slices", "stop_threshold", "key_kind",
)  # fmt: skip


@cache
def kept() -> dict:
    return json.loads(KEPT.read_text())


def mm2(hardware: str, words: tuple[str, ...]) -> float:
    """Of the sorting and raster cores of a machine with KEY=VALUE `words` set; nan where that was not mapped."""
    given = dict(word.split("=", 1) for word in words)
    cores = kept().get(given.get("setting", "reference"))
    if hardware not in RASTER or set(given) - set(FREE) or cores is None:
        return math.nan
    each = SORT_CORES * cores["gs_sorting_core"] + cores[RASTER[hardware]]
    return int(given.get("slices", SLICES)) * each / 1e6
