"""Energy of whole frames: power of the units (power.py) x their busy share in the timing model, and the memory's bytes.

A unit draws its idle power all the time and the rest of its busy power in its busy share of the frame. What has no RTL
here, preprocessing, counts with the paper's power. Memory: every byte that `splatcore simulate` moves.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

from golden.report.reproduce.figures import silicon
from golden.report.reproduce.paper import TABLE4
from golden.timing import simulate
from golden.timing.simulate import CLOCK
from synth import results

RESULTS = results.FOLDER / "energy.json"
HARDWARE = ("neo", "splatcore")
SCENE, SIZE, FRAMES = "builtin:room?n=20000", "640x384", 4
DRAM = 8.0  # pJ a bit of LPDDR4, interface included: what hwcomponents-cacti charges after Malladi et al., ISCA '12


@dataclass(frozen=True)
class Part:
    """Units of a kind, busy as the share `busy` of the timing model says."""

    what: str
    module: str
    busy: str


PARTS = (
    Part("sorting cores", "gs_sorting_core", "sorting cores"),
    Part("tests", "gs_group_test_unit", "intersection test units"),
    Part("SCUs", "gs_subtile_compute_unit", "subtile compute units"),
)
COUNTS = {part.module: part.count for part in silicon.PARTS.values()}


def frame(run: dict, power: dict[str, dict], size: tuple[int, int]) -> dict:
    """mJ of a mean steady frame of a run of `splatcore simulate`, by part, and what follows from it."""
    steady = run["per_frame"][1:] or run["per_frame"]
    seconds = sum(record["cycles"] for record in steady) / len(steady) / CLOCK
    moved = sum(sum(part.values()) for record in steady for part in record["dram_bytes"].values()) / len(steady)
    found = {}
    for part in PARTS:
        unit = power[part.module]
        idle, busy = unit["0"]["idle_mw"], unit["0"]["busy_mw"]
        share = run["utilisation"][part.busy]
        found[part.what] = COUNTS[part.module] * (idle + share * (busy - idle) + share * unit["memory_mw"]) * seconds
    found["preprocessing"] = TABLE4["Preprocessing Engine"][1] * run["utilisation"]["preprocessing units"] * seconds
    found["DRAM"] = moved * 8 * DRAM * 1e-9
    total = sum(found.values())
    return {
        "mj": {what: round(mj, 5) for what, mj in found.items()},
        "frames_s": round(1 / seconds, 1),
        "total_mj": round(total, 5),
        "mean_w": round(total * 1e-3 / seconds, 4),
        "mpx_per_j": round(size[0] * size[1] * 1e-6 / (total * 1e-3), 1),
    }


def measure(power: dict[str, dict]) -> dict:
    """Frames of SCENE on each hardware."""
    runs = simulate.compare(SCENE, SIZE, FRAMES, [(name, None, {}) for name in HARDWARE])
    size = tuple(map(int, SIZE.split("x")))
    return {"scene": f"{SCENE}, {SIZE}, {FRAMES} frames", **{r["hardware"]: frame(r, power, size) for r in runs}}


def load() -> dict:
    return json.loads(RESULTS.read_text()) if RESULTS.exists() else {}


def save(found: dict) -> None:
    RESULTS.write_text(json.dumps(found, indent=1) + "\n")


def table(found: dict) -> str:
    """Markdown."""
    parts = [*(part.what for part in PARTS), "preprocessing", "DRAM"]
    lines = [
        f"| mJ a frame | {' | '.join(parts)} | all | frames/s | W | megapixels/J |",
        "|" + "---|" * (len(parts) + 5),
    ]
    for name in HARDWARE:
        if name in found:
            one = found[name]
            cells = [f"{one['mj'][part]:.3f}" for part in parts]
            cells += [
                f"{one['total_mj']:.3f}",
                f"{one['frames_s']:,.0f}",
                f"{one['mean_w']:.2f}",
                f"{one['mpx_per_j']:,.0f}",
            ]
            lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"
