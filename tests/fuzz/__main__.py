"""`python -m tests.fuzz TARGET --minutes N [--seed S]`: one target for so much processor time; status 1 at a finding.

Targets: the readers (coverage-guided), the properties (hypothesis), `rtl` (golden model and RTL side by side).
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from tests.fuzz import properties, readers, rtl, runs, table_properties

ROOT = Path(__file__).resolve().parent.parent.parent
PROPERTIES = properties.TARGETS | table_properties.TARGETS


def main(argv: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz")
    parser.add_argument("target", choices=[*readers.TARGETS, *PROPERTIES, "rtl"])
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args(argv)
    begin = time.monotonic()
    if args.target in readers.TARGETS:
        counts = readers.run(args.target, args.minutes, args.seed, ROOT / "build" / "fuzz" / args.target)
    elif args.target == "rtl":
        counts = rtl.run(args.minutes, args.seed)
    else:
        counts = runs.run(*PROPERTIES[args.target], args.minutes, args.seed)
    processor = (time.process_time() + readers.children_seconds()) / 60
    spent = f"{processor:.1f} processor minutes in {(time.monotonic() - begin) / 60:.1f} minutes"
    print(f"{args.target}: {spent}, " + ", ".join(f"{name} {value:,}" for name, value in counts.items()), flush=True)
    return int(counts["findings"] > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
