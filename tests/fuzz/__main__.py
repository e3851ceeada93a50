"""`python -m tests.fuzz TARGET --minutes N [--seed S]`: one target for that long; status 1 when anything was found.

Targets: those of readers.py (coverage-guided).
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from tests.fuzz import readers

ROOT = Path(__file__).resolve().parent.parent.parent


def main(argv: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz")
    parser.add_argument("target", choices=[*readers.TARGETS])
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args(argv)
    begin = time.monotonic()
    counts = readers.run(args.target, args.minutes, args.seed, ROOT / "build" / "fuzz" / args.target)
    spent = f"{(time.monotonic() - begin) / 60:.1f} minutes"
    print(f"{args.target}: {spent}, " + ", ".join(f"{name} {value:,}" for name, value in counts.items()), flush=True)
    return int(counts["findings"] > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
