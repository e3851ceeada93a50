"""The RTL's slice beside the golden model on random scenes, cameras and memory timings: no difference, no hang."""

from __future__ import annotations

import time
from types import SimpleNamespace

import numpy as np

from golden import settings
from golden.cameras.camera import Camera, matrices
from golden.cosim.compare import Cosim
from golden.cosim.model import STEP, CosimError
from golden.scene.gaussians import Gaussians, checked

CYCLES = 4_000_000  # of a run; the largest takes a quarter of that


class Bound:
    """Where Cosim reports its progress, every STEP cycles of a frame: ends a run that goes on for ever."""

    def __init__(self, cycles: int = CYCLES):
        self.left = cycles

    def add_task(self, name: str, total: int) -> int:
        return 0

    def update(self, task: int, completed: float) -> None:
        self.left -= STEP
        if self.left < 0:
            raise CosimError("the frames take more cycles than they may")


def scene(rng: np.random.Generator) -> Gaussians:
    """1 to 400 Gaussians: ordinary ones, needles, huge, far off, faint, opaque and equal ones."""
    n = int(rng.integers(1, 401))
    means = rng.uniform((-3, -3, 0.1), (3, 3, 8), (n, 3))
    scales = np.exp(rng.uniform(-5, 0, (n, 3)))
    opacities = rng.uniform(0, 1, n)
    kind = rng.choice(7, n, p=rng.dirichlet(np.ones(7)))
    scales[kind == 1] *= (1e3, 1e-6, 1e-6)
    scales[kind == 2] = np.exp(rng.uniform(0, 30, (np.count_nonzero(kind == 2), 3)))
    means[kind == 3] *= np.exp(rng.uniform(0, 20, (np.count_nonzero(kind == 3), 1)))
    opacities[kind == 4] = rng.uniform(1 / 256, 1 / 250, np.count_nonzero(kind == 4))
    opacities[kind == 5] = 1
    means[kind == 6] = means[0]
    colours = rng.uniform(-2, 4, (n, 1, 3)) * rng.choice([1, 1, 1, 30], (n, 1, 1))
    return checked("fuzz", means, scales, rng.normal(size=(n, 4)), opacities, colours, bool(rng.integers(2)))


def camera(rng: np.random.Generator) -> Camera:
    """1 to 200 pixels a side, any lens near the scene, principal point up to a picture off."""
    width, height = (int(side) for side in rng.integers(1, 201, 2))
    fx, fy = max(width, height) * np.exp(rng.uniform(-1.5, 2, 2))
    cx, cy = width * rng.uniform(-0.5, 1.5), height * rng.uniform(-0.5, 1.5)
    q = rng.normal(size=4) * rng.choice([0, 0.1, 1]) + (1, 0, 0, 0)
    return Camera(width, height, fx, fy, cx, cy, matrices(q / np.linalg.norm(q)), rng.normal(size=3) * 0.5)


def path(rng: np.random.Generator) -> list[Camera]:
    """2 to 4 frames of one size: steps, now and then a jump."""
    views = [camera(rng)]
    lens = {name: getattr(views[0], name) for name in ("width", "height", "fx", "fy", "cx", "cy")}
    for _ in range(int(rng.integers(1, 4))):
        q = np.array([1, *rng.normal(0, rng.choice([0, 0.02, 0.4]), 3)])
        rotation = matrices(q / np.linalg.norm(q)) @ views[-1].rotation
        views.append(Camera(**lens, rotation=rotation, position=views[-1].position + rng.normal(0, 0.05, 3)))
    return views


def trial(seed: int) -> dict[str, int]:
    """One scene on both sides; what was compared. CosimError or AssertionError where they part."""
    rng = np.random.default_rng(seed)
    pairs = [f"read_latency={rng.choice([1, 2, 3, 40, 300])}", f"write_latency={rng.choice([1, 2, 20, 400])}"]
    pairs += [f"answer_jitter={rng.choice([0, 0, 7, 63, 500])}", f"capacity={rng.choice([256, 1 << 20])}"]
    pairs += ["background=" + ",".join(f"{x:.3f}" for x in rng.random(3))]
    views = path(rng)
    job = SimpleNamespace(gaussians=scene(rng), settings=settings.parse(pairs), cameras=views, frames=range(len(views)))
    pair = Cosim(job, str(rng.choice(["reuse", "reuse", "full"])), Bound(), seed)
    for k in range(len(views)):
        difference = pair.frame(k).difference
        assert difference is None, f"frame {k}: {difference}"
    return pair.compared


def run(minutes: float, seed: int) -> dict[str, int]:
    """Counts of trials from `seed` on; ends at the first that fails."""
    begin, totals, findings = time.process_time(), {"executions": 0}, 0
    while time.process_time() - begin < 60 * minutes and not findings:
        try:
            compared = trial(seed + totals["executions"])
        except Exception as error:
            print(f"FOUND seed {seed + totals['executions']}: {type(error).__name__}: {error}", flush=True)
            compared, findings = {}, 1
        totals["executions"] += 1
        for name, count in compared.items():
            totals[name] = totals.get(name, 0) + count
    return {**totals, "findings": findings}
