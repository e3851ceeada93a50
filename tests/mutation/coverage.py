"""Line and toggle coverage of rtl/ by the benches: Verilator's points, summed over the first build of each bench."""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

from tests import builds
from tests.builds import ROOT
from tests.mutation.netlist import Unit

POINT = re.compile(r"^C '(.*)' (\d+)$")


def build(unit: Unit) -> builds.Bench:
    return replace(unit.bench, coverage=True, few=True)


def measure(unit: Unit) -> int:
    """Run the unit's bench with coverage: the number of its tests."""
    return builds.run(build(unit))


def points(path: Path) -> dict[tuple[str, str, int, int, str], int]:
    """(module, kind, line, column, what) -> how often, of one coverage.dat; kind is line, branch or toggle.

    `what` of a toggle is a bit and a direction. Instances and sizes of a module count together.
    """
    found: dict[tuple[str, str, int, int, str], int] = defaultdict(int)
    for line in path.read_text().splitlines():
        if match := POINT.match(line):
            field = dict(part.split("\x02", 1) for part in match[1].split("\x01") if part)
            found[Path(field["f"]).stem, field["t"], int(field["l"]), int(field["n"]), field["o"]] += int(match[2])
    return found


def collect(units: list[Unit]) -> dict[str, dict]:
    """Of each module that these units' benches hold: points reached and all, by kind, and the branches never taken."""
    total: dict[tuple[str, str, int, int, str], int] = defaultdict(int)
    for unit in units:
        for key, count in points(build(unit).folder("verilator") / "coverage.dat").items():
            total[key] += count
    modules = {name: path for name, path in builds.modules().items() if ROOT / "rtl" in path.parents}
    result: dict[str, dict] = {}
    for (module, kind, line, _, what), count in sorted(total.items()):
        if module in modules:
            one = result.setdefault(module, {"branch": [0, 0], "toggle": [0, 0], "missed": []})
            pair = one["toggle" if kind == "toggle" else "branch"]
            pair[0] += count > 0
            pair[1] += 1
            if kind != "toggle" and not count:
                one["missed"].append([line, what, modules[module].read_text().splitlines()[line - 1].strip()])
    return result
