"""`make bench`: how fast the models are, as ratios, with a history in docs/bench.csv.

Every figure is a ratio of two things measured in this run, or of one to a number that the line names.
"""

from __future__ import annotations

import csv
import subprocess
import sys
import time
from datetime import date
from pathlib import Path

from golden.report.accuracy import simulators
from golden.timing import simulate

ROOT = Path(__file__).parent.parent
HISTORY = ROOT / "docs" / "bench.csv"
FRAME = "builtin:room?n=400000"
LARGE = "builtin:aerial?n=1500000"
WANTED_SECONDS = 3.0  # for a QHD frame, picture and timing
ARTIFACT = 0.2e6  # simulated core cycles a second: the paper's own simulator on a machine like this
WANTED_BYTES = 4e9


def frames(hardware: str, scene: str, size: str, count: int) -> tuple[float, float]:
    """(seconds a frame, simulated cycles a second), of the frames behind the second one."""
    marks = []
    result = simulate.compare(
        scene, size, count, [(hardware, None, {})], on_frame=lambda done, total: marks.append(time.perf_counter())
    )[0]
    seconds = (marks[-1] - marks[1]) / (count - 2)
    cycles = sum(frame["cycles"] for frame in result["per_frame"][2:]) / (count - 2)
    return seconds, cycles / seconds


def large() -> None:
    """One QHD frame of 1.5 M Gaussians; prints the peak of this process's memory in bytes."""
    simulate.compare(LARGE, "qhd", 2, [("splatcore", None, {})])
    print(simulators.peak() * 2**20)


def main() -> None:
    rows = []
    for hardware in ("neo", "splatcore"):
        seconds, rate = frames(hardware, FRAME, "qhd", 6)
        rows.append((f"{hardware}, {FRAME}, qhd: seconds a frame, of {WANTED_SECONDS:g}", seconds / WANTED_SECONDS))
        rows.append((f"{hardware}: simulated cycles a second, over {ARTIFACT:g}", rate / ARTIFACT))
    peak = subprocess.run([sys.executable, __file__, "large"], cwd=ROOT, check=True, capture_output=True, text=True)
    rows.append((f"{LARGE}, qhd: bytes of memory, of {WANTED_BYTES:g}", float(peak.stdout) / WANTED_BYTES))
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True).stdout
    new = not HISTORY.exists()
    with open(HISTORY, "a", newline="") as file:
        writer = csv.writer(file)
        if new:
            writer.writerow(("date", "commit", "what", "ratio"))
        for what, ratio in rows:
            writer.writerow((date.today().isoformat(), commit.strip(), what, f"{ratio:.3f}"))
            print(f"{ratio:8.2f}  {what}")


if __name__ == "__main__":
    large() if sys.argv[1:] == ["large"] else main()
