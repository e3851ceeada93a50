"""The accelerators that `splatcore simulate` knows, as data: units, tables, memory.

`neo` is the paper's (Table 1) with the cycles of our RTL of it. `neo-s` is its sorting engine on GSCore's raster cores
(Fig. 18). `gscore` and `gpu` are reconstructions: docs/hardware.md says what is public and what is assumed. `splatcore`
is the best combination of what this project adds.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace

from golden.errors import InputError


def _key(unit: str, valid: str, text: str, check, default=None):
    return field(default=default, metadata={"unit": unit, "valid": valid, "text": text, "check": check})


def _one_of(*values):
    return lambda value: value in values


def _between(low, high):
    return lambda value: low <= value <= high


@dataclass(frozen=True)
class Hardware:
    """One accelerator. Every field but name and note is a --set key of `splatcore simulate`."""

    name: str
    note: str
    raster: str = _key(
        "", "groups|candidates|given|gpu",
        "raster core: gs_raster_core, gs_late_core, one that is given its hits, or a GPU",
        _one_of("groups", "candidates", "given", "gpu"), "groups",
    )  # fmt: skip
    late_sort: bool = _key("", "0|1", "entries are sorted by fresh keys in the raster core", _one_of(0, 1), False)
    deferred_update: bool = _key(
        "", "0|1", "depth and valid bit are written back by the raster core; 0: a pass of its own", _one_of(0, 1), True
    )
    scratch: bool = _key("", "0|1", "hierarchical sort from scratch in every frame", _one_of(0, 1), False)
    slices: int = _key("raster cores", "1..64", "each with its sorting cores", _between(1, 64), 4)
    sort_cores: int = _key("cores", "1..64", "sorting cores of a slice", _between(1, 64), 4)
    preprocess_units: int = _key("units", "1..64", "projection, colour and duplication units each", _between(1, 64), 4)
    tile: int = _key("pixels", "16|64", "side of a tile", _one_of(16, 64), 64)
    entry_bytes: int = _key("bytes", "4|6|8|16", "entry of a table in memory", _one_of(4, 6, 8, 16), 6)
    position_bytes: int = _key("bytes", "6|12", "of a Gaussian's position in the scene", _one_of(6, 12), 12)
    combine_lines: int = _key(
        "lines", "1..65536", "write-combining buffer before the incoming lists", _between(1, 65536), 64
    )
    record_stride: int = _key("bytes", "24|32|64", "distance of two feature records", _one_of(24, 32, 64), 32)
    cache_kb: int = _key("KB", "0..4096", "record caches, all raster cores together; 0: none", _between(0, 4096), 0)
    cache_shared: bool = _key("", "0|1", "one record cache for all raster cores", _one_of(0, 1), False)
    morton: bool = _key("", "0|1", "Gaussians lie in memory along a Morton curve", _one_of(0, 1), False)
    clusters: bool = _key("", "0|1", "clusters of 256 Gaussians are culled whole", _one_of(0, 1), False)
    reproject: bool = _key(
        "", "0|1", "what was in last frame's tables is found by projecting twice, not read from memory", _one_of(0, 1),
        False,
    )  # fmt: skip
    preprocess_ahead: bool = _key(
        "", "0|1", "preprocessing of a frame runs while the one before it is drawn", _one_of(0, 1), False
    )
    skip_blank: bool = _key(
        "", "0|1", "tiles that hold nothing and held nothing are not drawn again", _one_of(0, 1), False
    )
    channels: int = _key("channels", "1|2|4|8|16|32", "LPDDR4-3200, 12.8 GB/s each", _one_of(1, 2, 4, 8, 16, 32), 4)
    charge_tests: bool = _key("", "0|1", "0: intersection tests take no time", _one_of(0, 1), True)
    charge_imbalance: bool = _key("", "0|1", "0: SCUs share their work evenly", _one_of(0, 1), True)
    charge_projection: bool = _key("", "0|1", "0: preprocessing units take no time", _one_of(0, 1), True)
    charge_image: bool = _key("", "0|1", "0: pixels are not written", _one_of(0, 1), True)

    def settings(self) -> dict:
        """Key -> value, what --set can change."""
        return {name: getattr(self, name) for name in keys()}

    @property
    def bandwidth(self) -> float:
        """Peak, bytes a second."""
        return self.channels * 12.8e9


_NEO = Hardware("neo", "Neo as in the paper, on the cycles of this project's RTL")

HARDWARE = {
    h.name: h
    for h in (
        Hardware(
            "splatcore", "late sort, candidate tests, queues, packed records in Morton order behind a cache, clusters",
            raster="candidates", late_sort=True, entry_bytes=4, record_stride=24, cache_kb=256,
            cache_shared=True, morton=True, clusters=True, reproject=True, preprocess_ahead=True, skip_blank=True,
        ),
        _NEO,
        replace(_NEO, name="neo-s", note="Neo without the update by the raster cores", deferred_update=False),
        Hardware(
            "gscore", "GSCore with 16 sorting and 4 x 4 raster units, 16-pixel tiles, sorted from scratch",
            raster="given", scratch=True, tile=16, entry_bytes=8, combine_lines=1 << 14, cache_kb=128,
        ),
        Hardware(
            "gscore-64", "GSCore on Neo's 64-pixel tiles",
            raster="given", scratch=True, entry_bytes=16, combine_lines=1 << 14, cache_kb=128,
        ),
        Hardware("gpu", "Orin AGX as a roofline", raster="gpu", scratch=True, tile=16, channels=16),
    )
}  # fmt: skip


def keys() -> dict[str, field]:
    """Name -> dataclass field of every --set key."""
    return {f.name: f for f in fields(Hardware) if f.metadata}


def configure(name: str, pairs: list[str]) -> Hardware:
    """A description with "KEY=VALUE" changes; InputError names the key, the value and what is valid."""
    if name not in HARDWARE:
        raise InputError(f"--hardware {name}: wants {'|'.join(HARDWARE)}")
    hardware = HARDWARE[name]
    for pair in pairs:
        key, _, text = pair.partition("=")
        spec = keys()[key]
        kind = type(spec.default)
        try:
            value = kind(int(text)) if kind in (int, bool) else text
            if not spec.metadata["check"](value if kind is str else int(text)):
                raise ValueError
        except ValueError:
            raise InputError(f"--set {key}={text}: wants {spec.metadata['valid']} {spec.metadata['unit']}") from None
        hardware = replace(hardware, **{key: value})
    return hardware


def table() -> list[tuple[str, str, str, str, str]]:
    """(key, value in the default description, unit, valid, text) of every key."""
    values = HARDWARE["splatcore"].settings()
    rows = []
    for name, spec in keys().items():
        meta = spec.metadata
        value = values[name]
        shown = str(int(value)) if isinstance(value, bool) else str(value)
        rows.append((name, shown, meta["unit"], meta["valid"], meta["text"]))
    return rows
