"""--set KEY=VALUE: a frozen dataclass whose fields are keys, each with its unit, what is valid and what it sets."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import Field, field, fields, replace
from typing import TypeVar

from golden.errors import InputError

T = TypeVar("T")


def key(default, unit: str, valid: str, text: str, check: Callable[[object], bool]):
    """A field that is a key. check: of a value of the default's kind (0 and 1 for a bool); may raise ValueError."""
    return field(default=default, metadata={"unit": unit, "valid": valid, "text": text, "check": check})


def one_of(*values) -> Callable[[object], bool]:
    return lambda value: value in values


def between(low: float, high: float) -> Callable[[object], bool]:
    return lambda value: low <= value <= high


def known(owner) -> dict[str, Field]:
    """Name -> field of every key of a dataclass or an instance of it."""
    return {f.name: f for f in fields(owner) if f.metadata}


def unknown(pair: str, names: Iterable[str]) -> InputError:
    """The error of a KEY=VALUE whose key nobody knows."""
    return InputError(f"--set {pair}: no such key; `splatcore info --keys` lists {', '.join(names)}")


def change(instance: T, pairs: list[str]) -> T:
    """The instance with "KEY=VALUE" changes; InputError names the key, the value and what is valid."""
    for pair in pairs:
        name, equals, text = pair.partition("=")
        spec = known(instance).get(name)
        if spec is None or not equals:
            raise unknown(pair, known(instance))
        kind = type(spec.default)
        try:
            value = int(text) if kind is bool else kind(text)
            if not spec.metadata["check"](value):
                raise ValueError
        except ValueError:
            wants = f"wants {spec.metadata['valid']} {spec.metadata['unit']}".rstrip()
            raise InputError(f"--set {name}={text}: {wants}") from None
        instance = replace(instance, **{name: kind(value)})
    return instance


def table(instance) -> list[tuple[str, str, str, str, str]]:
    """(key, value, unit, valid, text) of every key."""
    rows = []
    for name, spec in known(instance).items():
        value = getattr(instance, name)
        shown = str(int(value)) if isinstance(value, bool) else str(value)
        rows.append((name, shown, *(spec.metadata[part] for part in ("unit", "valid", "text"))))
    return rows
