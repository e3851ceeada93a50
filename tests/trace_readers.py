"""Readers of the exported traces, written from docs/traces.md and from nothing else."""

from __future__ import annotations

import gzip
import lzma
from dataclasses import dataclass
from pathlib import Path


def plain(path: Path) -> bytes:
    """A file's contents, unpacked if its name says that it is packed."""
    data = path.read_bytes()
    return {".gz": gzip.decompress, ".xz": lzma.decompress}.get(path.suffix, bytes)(data)


@dataclass
class NeoTrace:
    """poc.trace: G Gaussians, T tiles."""

    head: dict[str, int]
    culled: list[bool]
    incoming: list[list[int]]  # [G] tiles
    counts: list[tuple[int, int]]  # [T] incoming, reused
    tables: list[list[tuple[int, list[int]]]]  # [T] entries: Gaussian, 64 bits


def read_neo(path: Path) -> NeoTrace:
    """Whitespace is all that separates, as for a C++ stream."""
    tokens = map(int, plain(path).split())
    names = ("width", "height", "tile_size", "subtile_size", "chunk_size", "num_gaussians", "num_tiles")
    head = {name: next(tokens) for name in names}
    bits = (head["tile_size"] // head["subtile_size"]) ** 2
    culled, incoming = [], []
    for _ in range(head["num_gaussians"]):
        culled.append(bool(next(tokens)))
        incoming.append([next(tokens) for _ in range(next(tokens))])
    counts, tables = [], []
    for _ in range(head["num_tiles"]):
        counts.append((next(tokens), next(tokens)))
        tables.append([(next(tokens), [next(tokens) for _ in range(bits)]) for _ in range(next(tokens))])
    assert next(tokens, None) is None
    return NeoTrace(head, culled, incoming, counts, tables)


def read_dram(path: Path, form: str) -> list[tuple]:
    """(address, written) of each access, with the clock for DRAMsim3."""
    accesses = []
    for line in plain(path).decode().splitlines():
        words = line.split(" ")
        if form == "ramulator2":
            accesses.append((int(words[1], 16), {"LD": False, "ST": True}[words[0]]))
        elif form == "ramulator":
            accesses.append((int(words[0], 16), {"R": False, "W": True}[words[1]]))
        else:
            accesses.append((int(words[0], 16), {"READ": False, "WRITE": True}[words[1]], int(words[2])))
    return accesses
