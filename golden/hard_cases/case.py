"""What a case is, what it finds, and the list of all cases."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from golden.hard_cases.run import Run

SECTIONS = ("projection", "intersection", "blending", "sorting", "merging", "tables", "extremes", "limits")


@dataclass(frozen=True)
class Check:
    """One figure beside its bound. ok None: counted, not judged."""

    what: str
    figure: float | int | str
    bound: str
    ok: bool | None


@dataclass(frozen=True)
class Case:
    """A case. work fills a Run with checks; None: the unit that it is about does not exist yet, `title` says so."""

    name: str
    title: str
    work: Callable[[Run], None] | None
    benches: tuple[str, ...] = ()  # "unit/test_module: test", the benches that hold it in RTL


@dataclass
class Checks:
    """Checks in the order in which they were made."""

    found: list[Check] = field(default_factory=list)

    def at_most(self, what: str, figure: float, bound: float, text: str = "") -> None:
        """figure <= bound; a NaN fails."""
        self.found.append(Check(what, _plain(figure), f"<= {text or f'{bound:.5g}'}", bool(figure <= bound)))

    def at_least(self, what: str, figure: float, bound: float) -> None:
        self.found.append(Check(what, _plain(figure), f">= {bound:.5g}", bool(figure >= bound)))

    def equal(self, what: str, figure, want) -> None:
        """Numbers, or anything else that prints well."""
        self.found.append(Check(what, _plain(figure), f"= {_plain(want)}", bool(figure == want)))

    def count(self, what: str, figure) -> None:
        """A figure that is reported, not judged."""
        self.found.append(Check(what, _plain(figure), "counted", None))


def _plain(value):
    """Numbers as Python's own, everything else as text."""
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, int | float | str) else str(value)


_CASES: dict[str, Case] = {}


def case(name: str, title: str, *benches: str):
    """Decorator: the function is the work of a case."""

    def register(work):
        if name in _CASES:
            raise ValueError(f"case {name} twice")
        _CASES[name] = Case(name, title, work, benches)
        return work

    return register


_LATER = {
    "the order-independent blender does not exist yet": {
        "O01": "Weight overflow",
        "O02": "Pixel without contributor",
        "O03": "phi = 0 everywhere",
        "O04": "Any order, same bits",
        "O05": "Equal weights are a plain average",
        "O06": "A giant elsewhere in the tile",
    },
    "the polygon raster does not exist yet": {
        "R01": "Shared edge",
        "R02": "Vertex on a pixel centre",
        "R03": "Degenerate triangles",
        "R04": "Crossing the near plane",
        "R05": "Equal depth",
        "R06": "Perspective-correct attributes",
    },
    "the deferred MLP does not exist yet": {
        "N01": "Largest possible sums",
        "N02": "Average first, then the MLP",
        "N03": "Uncovered pixel and bad view direction",
    },
}


def cases() -> dict[str, Case]:
    """Name -> case: those of the sections in their order, then those that wait for a unit."""
    for section in SECTIONS:
        import_module(f"golden.hard_cases.{section}")
    later = {
        name: Case(name, f"{title}: {reason}", None)
        for reason, group in _LATER.items()
        for name, title in group.items()
    }
    return {**_CASES, **later}
