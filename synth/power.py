"""`make power`: what units draw at 1 GHz while the slice draws real tiles: toggles of their gates x library energy.

python -m synth.power [UNIT | all | frames] [--scene fox|room] [--page]

Each unit's ports are recorded in the RTL (activity.py) and replayed on its gates (gatesim.py), whose outputs must be
those of the RTL; a toggle costs its driver's energy and that of the pins on the net. Then energy.py follows: frames.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import sys
import time

import numpy as np

from golden.errors import InputError
from synth import activity, cells, circuit, energy, gatesim, joint, results
from synth.__main__ import own_library
from synth.flow import Library, Module
from synth.page import PAGE
from synth.units import named
from tests import builds

RESULTS = results.FOLDER / "power.json"
MARK = re.compile(r"(<!-- power -->\n).*(<!-- end of power -->)", re.DOTALL)
WIRES = (0.0, 2.5)  # um for each pin of a net
WINDOW = 1024  # cycles, of which the busiest are reported
QUIET = 64  # cycles, of which the least busy are called idle
RESET = 4  # cycles of the reset in which outputs may differ
FJ = 1e-3  # mW of a fJ a cycle at 1 GHz


LIST = (
    "gs_bitonic_sort_unit", "gs_merge_sort_unit", "gs_chunk_sorter", "gs_sorting_core", "gs_group_test_unit",
    "gs_exp2_unit", "gs_power_unit", "gs_subtile_compute_unit",
)  # fmt: skip


def digest(module: str) -> str:
    """Of the RTL of a module, the recipe and the whole cell table."""
    return hashlib.sha256((results.digest(module) + cells.TABLE.read_text()).encode()).hexdigest()[:16]


def stretches(values: np.ndarray, length: int) -> np.ndarray:
    """Sums over each stretch of `length` cycles."""
    total = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
    return total[length:] - total[:-length]


def figures(spent: np.ndarray, leakage: float) -> dict:
    """mW from fJ [cycles, 3], gatesim.Activity.energy."""
    power = spent * FJ
    busy = stretches(power, WINDOW) / WINDOW
    at = int(np.argmax(busy.sum(axis=1)))
    idle = stretches(power.sum(axis=1), QUIET).min() / QUIET
    return {
        "busy_mw": round(float(busy[at].sum() + leakage), 4),
        "clock_mw": round(float(busy[at, gatesim.CLOCK]), 4),
        "glitch_mw": round(float(busy[at, gatesim.GLITCH]), 4),
        "idle_mw": round(float(idle + leakage), 4),
        "leakage_mw": round(leakage, 5),
    }


def measure(module: str, library: Library, scene: str) -> dict:
    """Power of a unit on its recording."""
    design = joint.joined(Module(module), library)
    (source,) = (path for path in builds.sources(module) if path.stem == module)
    given = activity.stimulus(module, {port: len(nets) for port, nets in design.ports.items()}, source)
    sides = []
    for side in ("input", "output"):
        named = [design.ports[name] for name, (direction, _) in given.ports.items() if direction == side]
        sides += [np.concatenate(named), given.side(side)]
    found = {"made_from": digest(module), "scene": scene, "cycles": len(given.bits)}
    for wire in WIRES:
        gates = circuit.build(design, library, wire)
        ran = gatesim.run(gates, *sides)
        wrong = RESET + np.flatnonzero(ran.differ[RESET:])
        if len(wrong):
            raise RuntimeError(f"{module}: gates unlike the RTL in {len(wrong)} cycles, first {wrong[0]}")
        found[f"{wire:g}"] = figures(ran.energy, gates.leakage)
    joules = sum(memory.energy * int(used.sum()) for (memory, _), used in zip(design.rams, ran.accesses, strict=True))
    return found | {"memory_mw": round(joules / len(given.bits), 4)}  # pJ a cycle at 1 GHz


def load() -> dict[str, dict]:
    """The committed results, by module."""
    return json.loads(RESULTS.read_text()) if RESULTS.exists() else {}


def table(found: dict[str, dict]) -> str:
    """Markdown."""
    head = ["module", "busy mW", "of it clock", "of it glitches", "busy, 2.5 um", "idle", "memories"]
    lines = [f"| {' | '.join([*head, 'the paper, mW'])} |", "|" + "---|" * (len(head) + 1)]
    for module in LIST:
        if module in found:
            one = found[module]
            bare = one["0"]
            numbers = [*(bare[k] for k in ("busy_mw", "clock_mw", "glitch_mw")), one["2.5"]["busy_mw"]]
            numbers += [bare["idle_mw"], one["memory_mw"] or None]
            row = [f"`{module}`", *("" if number is None else f"{number:.3g}" for number in numbers)]
            theirs = named(module)[0].theirs(1)
            row.append(f"{theirs:.2f} (x {bare['busy_mw'] / theirs:.2f})" if theirs else "")
            lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines) + "\n"


def text() -> str:
    """What stands between the marks of docs/synthesis.md."""
    frames = energy.load()
    return table(load()) + (f"\n{energy.table(frames)}" if frames else "")


def write_page() -> None:
    page = PAGE.read_text()
    if not MARK.search(page):
        raise RuntimeError(f"{PAGE.name} has lost its marks <!-- power --> and <!-- end of power -->")
    PAGE.write_text(MARK.sub(lambda match: match[1] + text() + match[2], page))


def run(chosen: list[str], where: activity.Scene) -> None:
    """Record, measure and keep."""
    start = time.monotonic()
    activity.record(chosen, where)
    print(f"recorded {where.name} in {time.monotonic() - start:.0f} s", flush=True)
    library = own_library()
    for module in chosen:
        start = time.monotonic()
        kept = load() | {module: measure(module, library, where.name)}
        RESULTS.write_text(json.dumps({name: kept[name] for name in LIST if name in kept}, indent=1) + "\n")
        print(f"{module}: {time.monotonic() - start:.0f} s", flush=True)


def main() -> int:
    names = ", ".join(LIST)
    parser = argparse.ArgumentParser(prog="python -m synth.power", description="Power of the units.")
    parser.add_argument("unit", nargs="?", default="all", help=f"all, frames, {names}")
    parser.add_argument(
        "--scene", choices=activity.SCENES, help="what the slice draws (default: fox where it is present)"
    )
    parser.add_argument(
        "--page", action="store_true", help="write the tables of docs/synthesis.md from the kept results"
    )
    args = parser.parse_args()
    try:
        chosen = [module for module in LIST if args.unit in ("all", module)]
        if not chosen and args.unit != "frames":
            raise InputError(f"UNIT={args.unit}: wants all, frames, {names}")
        if chosen and not args.page:
            run(chosen, activity.scene(args.scene))
        if not args.page and {part.module for part in energy.PARTS} <= set(load()):
            energy.save(energy.measure(load()))
        write_page()
        print(text())
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    except RuntimeError as error:  # Yosys failed, or gates unlike the RTL
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
