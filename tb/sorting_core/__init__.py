"""Benches of the sorting core; what they share is here."""

import numpy as np

from golden.formats import BUILD
from golden.records import INVALID, hardware
from tb.lib.stream import rng

END = (None, 1)  # end beat of a list stream


def _hardware(words) -> np.ndarray:
    """[n] entries as the RTL has them."""
    return hardware(BUILD, np.asarray(words, np.int64))


def beats(words) -> list[tuple[int | None, int]]:
    """A list stream (entry, last): the entries, then the end beat."""
    return [*((int(word), 0) for word in _hardware(words)), END]


def entries(n: int, *names: object, invalid: float = 0.0, keys: int = 0) -> np.ndarray:
    """[n] random entries; a quarter of them repeat others. keys: so few different keys, equal indices too."""
    generator = rng(*names)
    pool = [generator.getrandbits(BUILD.entry_w - 1) for _ in range(keys or max(1, 3 * n // 4))]
    words = np.array([generator.choice(pool) for _ in range(n)], np.int64)
    holes = np.array([generator.random() < invalid for _ in range(n)], bool)
    return words | holes * INVALID


def blocks(words, chunk: int) -> list[tuple[int | None, int, int]]:
    """The block stream (entry, len, last) of a list."""
    out: list[tuple[int | None, int, int]] = []
    for start in range(0, len(words) + 1, chunk):
        part = _hardware(words[start : start + chunk])
        last = int(len(part) < chunk)
        out += [(int(word), len(part), last) for word in part] or [(None, 0, 1)]
    return out


async def send_at(source, dut, words, arrival, zero: int) -> None:
    """Sends a list stream whose beat i is offered in cycle zero + arrival[i] at the earliest."""
    from tb.lib.stream import cycle

    for beat, at in zip(beats(words), arrival, strict=True):
        while cycle() + 1 < zero + at:
            await source.edge
        source.send([beat])
