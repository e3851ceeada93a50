"""What the accuracy study varies, as data: each knob alone, the rest at the reference setting; then a joint grid."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product

from golden import keys
from golden.errors import InputError
from golden.settings import Settings, parse
from golden.timing import hardware, simulate
from golden.timing.hardware import Hardware

REFERENCE = "reference"  # the knob of the points that everything else is compared with
MACHINES = ("neo", "splatcore")  # the paper's with deferred keys; late sort


@dataclass(frozen=True)
class Choice:
    """One value of a knob."""

    label: str
    sets: tuple[str, ...] = ()  # KEY=VALUE of the golden model or the hardware
    sorting: str | None = None
    hardware: str | None = None  # instead of the reference machine


@dataclass(frozen=True)
class Knob:
    name: str
    family: str  # panel of the chart
    choices: tuple[Choice, ...]
    machines: tuple[str, ...] = MACHINES
    unit: str = ""


def _key(name: str, family: str, *values, machines: tuple[str, ...] = MACHINES, unit: str = "") -> Knob:
    """A knob that is one --set key."""
    return Knob(name, family, tuple(Choice(str(v), (f"{name}={v}",)) for v in values), machines, unit)


def _pairs(name: str, family: str, *grid: tuple[str, Iterable]) -> Knob:
    """A knob of several keys, every combination."""
    choices = tuple(
        Choice(" ".join(str(value) for value in values), tuple(f"{k}={v}" for (k, _), v in zip(grid, values)))
        for values in product(*(values for _, values in grid))
    )
    return Knob(name, family, choices)


def _sortings(*names: str) -> Knob:
    return Knob("sorting", "order", tuple(Choice(name, (), name) for name in names), ("neo",))


ENDS = Knob(
    "end", "ends",
    (
        Choice("again"),  # the reference a second time: must be the same to the bit
        Choice("exact", ("setting=wide",), "full"),
        Choice("random order", (), "shuffled:1"),
    ),
    ("neo",),
)  # fmt: skip

KNOBS = (
    Knob(REFERENCE, "ends", (Choice(REFERENCE),)),
    ENDS,
    Knob("setting", "formats", tuple(Choice(name, (f"setting={name}",)) for name in ("small", "wide"))),
    _pairs("depth key", "keys", ("key_kind", ("float",)), ("key_bits", (14, 16, 18, 20, 22, 26))),
    _pairs("depth key", "keys", ("key_kind", ("log", "linear")), ("key_bits", (16, 20, 24))),
    _pairs("depth key", "keys", ("key_kind", ("half",)), ("key_bits", (16,))),
    _key("entry_bytes", "keys", 8, 16, unit="bytes"),
    _key("depth", "order", "consistent", "predicted", "fresh", machines=("neo",)),
    _key("depth", "order", "deferred", machines=("splatcore",)),
    _key("passes", "order", 2, 4, machines=("neo",)),
    _key("chunk", "order", 64, 128, 512, 1024, unit="entries"),
    _sortings("full", "hierarchical", "periodic:2", "periodic:4", "background:1", "background:2"),
    _key("cut_share", "order", 0, 0.02, 0.1),
    _pairs(
        "stop", "stop", ("stop_threshold", (0.00001, 0.001, 0.002, 0.004, 0.016)),
        ("stop_rule", ("blend-last", "drop-last")),
    ),
    _key("refresh", "stop", "none", "every:4"),
    _key("alpha_cut", "stop", 1024, 512, 128, 100, 64, unit="1/alpha"),
    _key("bound", "stop", "box", "oriented", "circle"),
    _key("mean_bits", "formats", 4, 6, 8, 12, unit="bits"),
    _key("footprint_bits", "formats", 13, 14, 16, 18, 22, unit="bits"),
    _key("opacity_bits", "formats", 7, 9, 11, 15, unit="bits"),
    _key("colour_bits", "formats", 6, 8, 12, unit="bits"),
    _key("alpha_bits", "formats", 10, 12, 14, 17, unit="bits"),
    _key("transmittance_bits", "formats", 12, 14, 16, 20, unit="bits"),
    _key("accumulator_bits", "formats", 12, 14, 16, 18, 22, unit="bits"),
    _key("exp_segments", "formats", 4, 8, 32, 64),
    _key("exp_bits", "formats", 17, 20, 22, unit="bits"),
    _key("sh_degree", "colour", 0, 1, 2),
    _key("colour_every", "colour", 2, 4, unit="frames"),
    Knob("tile", "machine", tuple(Choice(name, (), None, name) for name in ("gscore", "gscore-64")), ("neo",)),
    _key("slices", "machine", 1, 2, 8),
    _key("channels", "machine", 1, 2, 8, 16),
    _key("cache_kb", "machine", 0, 64, 512, machines=("splatcore",), unit="KB"),
    _key("cache_kb", "machine", 64, 256, machines=("neo",), unit="KB"),
)  # fmt: skip

DEPTHS = ("deferred", "consistent", "predicted", "fresh")
GRID = "grid"
SETTINGS, DEGREES, CHANNELS = ("small", "reference", "wide"), (0, 1, 3), (2, 4, 8)


def joint() -> tuple[Knob, ...]:
    """The joint grid of what matters: order of work, widths, harmonics, bandwidth."""
    rest = [("setting", SETTINGS), ("sh_degree", DEGREES), ("channels", CHANNELS)]
    return tuple(
        Knob(GRID, GRID, knob.choices, (machine,))
        for machine, first in (("neo", [("depth", DEPTHS)]), ("splatcore", []))
        for knob in [_pairs(GRID, GRID, *first, *rest)]
    )


@dataclass(frozen=True)
class Point:
    """One row of the study."""

    knob: str
    family: str
    value: str
    machine: str  # reference machine; what ran is `hardware`
    hardware: str
    sorting: str | None
    sets: tuple[str, ...]  # of the golden model, sorted
    pairs: tuple[str, ...]  # of the hardware, sorted
    unit: str = ""

    @property
    def config(self) -> tuple:
        return self.hardware, self.pairs, self.sorting

    def words(self) -> dict:
        """What its result is kept under; "again" is kept apart from what it repeats."""
        words = {"sets": list(self.sets), "hardware": self.hardware, "pairs": list(self.pairs), "sorting": self.sorting}
        return {**words, "again": True} if self.value == "again" else words


def point(knob: Knob, choice: Choice, machine: str) -> Point:
    """InputError where a key or a value is not known."""
    sets, pairs = simulate.split_settings(list(choice.sets))
    name = choice.hardware or machine
    settings = parse(sets)
    pairs = simulate.fitted(name, pairs, settings)
    ran = hardware.configure(name, pairs)
    simulate.strategy(ran, choice.sorting)
    simulate.check(ran, settings)
    return Point(
        knob.name, knob.family, choice.label, machine, name, choice.sorting,
        tuple(sorted(sets)), tuple(sorted(pairs)), knob.unit,
    )  # fmt: skip


def points(knobs: Iterable[Knob]) -> tuple[list[Point], list[str]]:
    """(every point, a line about each that this build does not know)."""
    found: list[Point] = []
    left: list[str] = []
    known = {*keys.known(Settings), *keys.known(Hardware)}
    for knob in knobs:
        for choice in knob.choices:
            missing = sorted({pair.partition("=")[0] for pair in choice.sets} - known)
            if missing:
                left.append(f"{knob.name} {choice.label}: this build has no key {', '.join(missing)}")
                continue
            for machine in knob.machines:
                try:
                    found.append(point(knob, choice, machine))
                except InputError as error:
                    left.append(f"{knob.name} {choice.label} on {machine}: {error}")
    return found, left


def chosen(names: str | None) -> list[Knob]:
    """--knobs: names with commas between, None: all and the grid. The reference and the ends are always there."""
    everything = [*KNOBS, *joint()]
    if names is None:
        return everything
    wanted = set(names.split(","))
    unknown = wanted - {knob.name for knob in everything}
    if unknown:
        valid = ", ".join(dict.fromkeys(knob.name for knob in everything if knob.family != "ends"))
        raise InputError(f"--knobs {','.join(sorted(unknown))}: wants some of {valid}, with commas between")
    return [knob for knob in everything if knob.family == "ends" or knob.name in wanted]
