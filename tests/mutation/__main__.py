"""python -m tests.mutation [--unit gs_fifo] [--count 100] [--jobs 2]; --coverage measures that instead.

Results are kept per unit in build/mutate/ and taken from there while nothing they depend on has changed, so that an
interrupted run goes on where it was. Ends with docs/mutation.md written, and with status 1 where it shows a fault.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed

from tests.mutation import coverage, page, unit
from tests.mutation.netlist import Unit, units


def smallest_first(found: dict[str, Unit]) -> list[Unit]:
    """By the size of what has to be compiled."""
    return sorted(found.values(), key=lambda one: (sum(path.stat().st_size for path in one.files), one.module))


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutation", description="Do the benches notice a fault?")
    parser.add_argument("--unit", help="one module; all of rtl/ otherwise")
    parser.add_argument("--count", type=int, default=100, help="mutants of each unit (%(default)s)")
    parser.add_argument("--jobs", type=int, default=2, help="units at a time (%(default)s)")
    parser.add_argument("--coverage", action="store_true", help="line and toggle coverage instead of mutants")
    args = parser.parse_args()
    found = units()
    if args.unit and args.unit not in found:
        print(f"--unit {args.unit}: want one of {', '.join(sorted(found))}", file=sys.stderr)
        return 1
    chosen = smallest_first({args.unit: found[args.unit]} if args.unit else found)
    failed = False
    with ProcessPoolExecutor(args.jobs, max_tasks_per_child=1) as pool:
        tasks = [(coverage.measure, one) if args.coverage else (unit.result, one, args.count) for one in chosen]
        work = {pool.submit(*task): task[1] for task in tasks}
        for one in as_completed(work):
            try:
                print(finish(work[one], one.result()), flush=True)
            except Exception as error:  # of one unit: the others still run
                failed = True
                print(f"{work[one].module}: {error}", file=sys.stderr, flush=True)
    data = page.load()
    if args.coverage and not args.unit and not failed:  # a module is covered by the benches of all that contain it
        page.save(data | {"coverage": coverage.collect(chosen)})
    problems = page.problems(page.load())
    for problem in problems:
        print(problem, file=sys.stderr)
    return int(failed or bool(problems))


def finish(one: Unit, found: dict | int) -> str:
    """Put the result of a unit into the page; one line about it."""
    if isinstance(found, int):
        return f"{one.module}: {found} tests"
    data = page.load()
    data["mutants"][one.module] = page.summary(found)
    page.save(data)
    ends = Counter(mutant["status"] for mutant in found["mutants"])
    return f"{one.module}: {', '.join(f'{ends[end]} {end}' for end in page.ENDS)}, {found['seconds']} s"


if __name__ == "__main__":
    sys.exit(main())
