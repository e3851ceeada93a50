"""Properties for minutes of processor time: rounds of hypothesis, each with a new seed, until one fails."""

from __future__ import annotations

import time
import traceback

from hypothesis import HealthCheck, Phase, given, seed, settings

ROUND = 100  # examples


def run(prove, strategies: dict, minutes: float, first_seed: int) -> dict[str, int]:
    """Counts: examples run, failures (the smallest one is printed)."""
    begin, counts = time.process_time(), {"executions": 0, "findings": 0}

    def counted(**example) -> None:
        counts["executions"] += 1
        prove(**example)

    number = first_seed
    while time.process_time() - begin < 60 * minutes and not counts["findings"]:
        chosen = settings(
            max_examples=ROUND, deadline=None, database=None, suppress_health_check=list(HealthCheck),
            phases=(Phase.generate, Phase.shrink), print_blob=False,
        )  # fmt: skip
        try:
            seed(number)(chosen(given(**strategies)(counted)))()
        except Exception:
            print(f"FOUND seed {number}: {traceback.format_exc()}", flush=True)
            counts["findings"] += 1
        number += 1
    return counts
