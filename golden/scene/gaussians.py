"""The scene as every later step sees it: arrays of Gaussians in world units, and the checks all readers share."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from golden import params
from golden.errors import InputError

SH_C0 = 0.28209479177387814  # sqrt(1 / (4 pi)): colour = SH_C0 * f_dc + 0.5
SH_COUNTS = (1, 4, 9, 16)  # coefficients a channel for degrees 0 to 3
MAX_GAUSSIANS = 1 << params.INDEX_W
NORM_MIN = 1e-290  # a squared quaternion norm below this cannot be divided by


@dataclass(frozen=True)
class Gaussians:
    name: str  # file or folder without its ending, or the built-in scene's name
    means: np.ndarray  # float64 [N, 3] world units
    scales: np.ndarray  # float64 [N, 3] standard deviation along the own axes, world units
    quats: np.ndarray  # float64 [N, 4] w, x, y, z as stored, not normalised
    opacities: np.ndarray  # float64 [N] 0..1
    sh: np.ndarray  # float32 [N, K, 3] K = 1, 4, 9 or 16; order and signs of the original 3DGS
    antialias: bool = False  # trained with the opacity compensation of Mip-Splatting
    counters: dict[str, int] = field(default_factory=dict)  # rows dropped, by reason
    source: str = ""  # what the user named

    def __len__(self) -> int:
        return len(self.means)

    @property
    def degree(self) -> int:
        """Of the spherical harmonics, 0 to 3."""
        return SH_COUNTS.index(self.sh.shape[1])


def sigmoid(logits: np.ndarray) -> np.ndarray:
    """Opacity of a logit; +Inf gives 1, -Inf gives 0, NaN stays."""
    with np.errstate(over="ignore"):
        return 1.0 / (1.0 + np.exp(-np.asarray(logits, np.float64)))


def exp_scales(logs: np.ndarray) -> np.ndarray:
    """Standard deviations of log scales; a log that is not finite stays not finite, so that its row is dropped."""
    logs = np.asarray(logs, np.float64)
    with np.errstate(over="ignore"):
        return np.where(np.isneginf(logs), np.nan, np.exp(logs))


def checked(
    name: str,
    means: np.ndarray,
    scales: np.ndarray,
    quats: np.ndarray,
    opacities: np.ndarray,
    sh: np.ndarray,
    antialias: bool = False,
    source: str = "",
    counters: dict[str, int] | None = None,
) -> Gaussians:
    """Gaussians of raw rows: those that cannot be drawn are dropped and counted, the others keep their order.

    A row is counted once, at the first rule that drops it: `rejected_nonfinite` (NaN or Inf in any field),
    `rejected_scale` (a negative standard deviation), `rejected_quat` (a quaternion without a direction).
    """
    n = len(means)
    if n > MAX_GAUSSIANS:
        raise InputError(f"{source or name}: {n} Gaussians, a table entry's index holds up to {MAX_GAUSSIANS}")
    arrays = [np.ascontiguousarray(a, np.float64) for a in (means, scales, quats, opacities)]
    with np.errstate(over="ignore"):
        arrays.append(np.ascontiguousarray(sh, np.float32))
    shapes = [a.shape for a in arrays]
    assert shapes[:4] == [(n, 3), (n, 3), (n, 4), (n,)], shapes
    assert shapes[4][0] == n and shapes[4][1] in SH_COUNTS and shapes[4][2] == 3, shapes
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        norms = np.einsum("ij,ij->i", arrays[2], arrays[2])
        rules = {
            "rejected_nonfinite": ~np.logical_and.reduce(
                [np.isfinite(a).all(axis=tuple(range(1, a.ndim))) for a in arrays]
            ),
            "rejected_scale": (arrays[1] < 0).any(axis=1),
            "rejected_quat": ~((norms > NORM_MIN) & np.isfinite(norms)),
        }
    counts = dict(counters or {})
    keep = np.ones(n, bool)
    for rule, bad in rules.items():
        counts[rule] = counts.get(rule, 0) + int((bad & keep).sum())
        keep &= ~bad
    if not keep.all():
        arrays = [a[keep] for a in arrays]
    return Gaussians(name, *arrays, antialias=antialias, counters=counts, source=source)


def joined(name: str, parts: list[Gaussians], source: str) -> Gaussians:
    """One scene of several, in order; missing SH bands are zero, counters add up."""
    bands = max(p.sh.shape[1] for p in parts)
    sh = np.zeros((sum(len(p) for p in parts), bands, 3), np.float32)
    at = 0
    for part in parts:
        sh[at : at + len(part), : part.sh.shape[1]] = part.sh
        at += len(part)
    counters: dict[str, int] = {}
    for part in parts:
        for key, value in part.counters.items():
            counters[key] = counters.get(key, 0) + value
    fields = [np.concatenate([getattr(p, f) for p in parts]) for f in ("means", "scales", "quats", "opacities")]
    return checked(name, *fields, sh, all(p.antialias for p in parts), source, counters)


def limit_bands(sh: np.ndarray, counters: dict[str, int]) -> np.ndarray:
    """[N, K, 3] cut to degree 3; counts the Gaussians that lose a higher band."""
    if sh.shape[1] > SH_COUNTS[-1]:
        counters["cut_to_sh3"] = len(sh)
    return sh[:, : SH_COUNTS[-1]]


def check_float32_positions(file: str, means: np.ndarray, scales: np.ndarray) -> None:
    """Refuse positions stored as float32 so far from the origin that the scene has lost its shape."""
    if len(means) < 2:
        return
    finite = np.isfinite(means).all(axis=1) & np.isfinite(scales).all(axis=1)
    if not finite.any():
        return
    far = np.median(np.abs(means[finite].astype(np.float64)), axis=0).max()  # twice 3e38 is no float32
    sigma = np.median(scales[finite].max(axis=1))
    step = float(np.spacing(np.float32(far)))
    if step > sigma > 0:
        raise InputError(
            f"{file}: positions near {far:.7g} are float32 with steps of {step:g}, wider than the median Gaussian"
            f" ({sigma:.3g}); store x, y, z as double, or move the scene to the origin"
        )
