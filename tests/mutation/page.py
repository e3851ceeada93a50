"""Writes docs/mutation.md from docs/mutation.json: the last results of every unit, which the runs keep up to date.

python -m tests.mutation.page
"""

from __future__ import annotations

import json
from collections import Counter

from tests.builds import ROOT
from tests.mutation.reasons import NEVER_REACHED, SURVIVORS

TARGET = ROOT / "docs" / "mutation.md"
DATA = TARGET.with_suffix(".json")
WANTED = 0.95  # of the mutants that differ from their unit
ENDS = ("killed", "hung", "equivalent", "alive")

HEAD = """# Mutation and coverage

Do the benches notice a fault? Written by `make mutate` and `make coverage` from the last runs; `tests/mutation/` is the
program.

## Mutants

`make mutate` (`UNIT=gs_fifo` for one module, `N=100` mutants each; a run goes on where the last one was
interrupted) elaborates every module of `rtl/` alone with Yosys, its parts left as they are, and draws single-bit
changes at the ports of its cells from a fixed seed: inverted, stuck, or inverted where a neighbouring bit is 0 or
1. All mutants of a unit are one netlist with a register that picks one. Each test of the unit's bench (first
parameter set) runs on a mutant as a fork of one simulator process, until one fails. Number 0 is the unit itself and
must pass every test.

*Killed*: a test failed. *Hung*: a test was not over in twice its cycles and 1000 more; counts as killed. *Equivalent*:
proven to be the unit, whatever the parts answer, from any state or in all states behind a reset, or from any state with
its parts, which may ignore an input (`tests/mutation/equivalent.py`); does not count. *Rate*: killed and hung of the
rest, at least 95 %.
"""


def load() -> dict[str, dict]:
    """{"mutants": {unit: {killed, hung, equivalent, alive, seconds, survivors}}, "coverage": {module: ...}}."""
    return json.loads(DATA.read_text()) if DATA.exists() else {"mutants": {}, "coverage": {}}


def save(data: dict[str, dict]) -> None:
    DATA.write_text(json.dumps(data, indent=1, sort_keys=True) + "\n")
    TARGET.write_text(text(data))


def summary(found: dict) -> dict:
    """What the page needs of the result of a unit (tests/mutation/unit.py)."""
    ends = Counter(one["status"] for one in found["mutants"])
    alive = [one for one in found["mutants"] if one["status"] == "alive"]
    survivors = [{key: one[key] for key in ("line", "text", "name")} for one in alive]
    return {end: ends[end] for end in ENDS} | {"seconds": found["seconds"], "survivors": survivors}


def why_alive(unit: str, one: dict) -> str:
    """Reason of a survivor: the first entry whose two texts are in its source line and its name."""
    return next((why for line, name, why in SURVIVORS.get(unit, ()) if line in one["text"] and name in one["name"]), "")


def why_missed(module: str, source: str) -> str:
    """Reason of a branch that is never taken."""
    return next((why for part, why in NEVER_REACHED.get(module, ()) if part in source), "")


def rate(one: dict) -> float:
    return (one["killed"] + one["hung"]) / max(1, one["killed"] + one["hung"] + one["alive"])


def problems(data: dict[str, dict]) -> list[str]:
    """Units that miss the rate; survivors and branches without a reason."""
    found = []
    for unit, one in sorted(data["mutants"].items()):
        if rate(one) < WANTED:
            found.append(f"{unit}: {rate(one):.1%} of the mutants are killed, want {WANTED:.0%}")
        for alive in one["survivors"]:
            if not why_alive(unit, alive):
                found.append(f"{unit}:{alive['line']}: survivor without a reason: {alive['text']} ({alive['name']})")
    for module, one in sorted(data["coverage"].items()):
        for line, what, source in one["missed"]:
            if not why_missed(module, source):
                found.append(f"{module}:{line}: {what} never taken, without a reason: {source}")
    return found


def table(head: tuple[str, ...], rows: list[tuple]) -> list[str]:
    cells = [[str(cell).replace("|", "\\|") for cell in row] for row in rows]
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *cells)]


def text(data: dict[str, dict]) -> str:
    """The page."""
    units, survivors = [], []
    total: Counter = Counter()
    for unit, one in sorted(data["mutants"].items()):
        units.append(
            (unit, sum(one[end] for end in ENDS), *(one[end] for end in ENDS), f"{rate(one):.1%}", one["seconds"])
        )
        total.update({key: one[key] for key in (*ENDS, "seconds")})
        survivors += [
            (f"{unit}:{alive['line']}", f"`{alive['text']}`", alive["name"], why_alive(unit, alive))
            for alive in one["survivors"]
        ]
    counts = [total[end] for end in ENDS]
    units.append(("**all**", sum(counts), *counts, f"{rate(total):.1%}", total["seconds"]))
    covered, missed = [], []
    for module, one in sorted(data["coverage"].items()):
        shares = [(n, f"{part / n:.1%}" if n else "") for part, n in (one["branch"], one["toggle"])]
        covered.append((module, *shares[0], *shares[1]))
        missed += [(f"{module}:{at}", f"`{line}`", what, why_missed(module, line)) for at, what, line in one["missed"]]
    head = ("unit", "mutants", "killed", "hung", "equivalent", "survivors", "rate", "s")
    lines = [HEAD, *table(head, units), "", "### Survivors", ""]
    lines += [*table(("where", "source", "change", "why no test fails"), survivors), "", "## Coverage", ""]
    lines += ["`make coverage`: Verilator's points over the first build of each bench, with two pairs of stalls:"]
    lines += ["blocks and branches, and for each bit of each signal both directions.", ""]
    lines += [*table(("module", "branches", "taken", "edges", "seen"), covered), "", "### Never taken", ""]
    return "\n".join([*lines, *table(("where", "source", "branch", "why"), missed), ""])


if __name__ == "__main__":
    save(load())
