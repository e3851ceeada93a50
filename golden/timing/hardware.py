"""The accelerators that `splatcore simulate` knows, as data: units, tables, memory.

`neo` is the paper's (Table 1) with the cycles of our RTL of it. `neo-s` updates depths and valid bits in a pass of its
own (Fig. 18). `gscore` and `gpu` are reconstructions: docs/hardware.md says what is public and what is assumed.
`splatcore` is the best combination of what this project adds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from golden import keys
from golden.errors import InputError
from golden.keys import between, key, one_of
from golden.timing.address_map import LINE
from golden.timing.dram import PEAK
from golden.timing.record_cache import WAYS


@dataclass(frozen=True)
class Hardware:
    """One accelerator. Every field but name and note is a --set key of `splatcore simulate`."""

    name: str
    note: str
    raster: str = key(
        "groups", "", "groups|candidates|given|gpu",
        "raster core: gs_raster_core, gs_late_core, one that is given its hits, or a GPU",
        one_of("groups", "candidates", "given", "gpu"),
    )  # fmt: skip
    late_sort: bool = key(False, "", "0|1", "entries are sorted by fresh keys in the raster core", one_of(0, 1))
    deferred_update: bool = key(
        True, "", "0|1", "depth and valid bit are written back by the raster core; 0: a pass of its own",
        one_of(0, 1),
    )  # fmt: skip
    scratch: bool = key(False, "", "0|1", "hierarchical sort from scratch in every frame", one_of(0, 1))
    slices: int = key(4, "raster cores", "1..64", "each with its sorting cores", between(1, 64))
    sort_cores: int = key(4, "cores", "1..64", "sorting cores of a slice", between(1, 64))
    preprocess_units: int = key(4, "units", "1..64", "projection, colour and duplication units each", between(1, 64))
    tile: int = key(64, "pixels", "16|64", "side of a tile", one_of(16, 64))
    entry_bytes: int = key(
        6, "bytes", "4..16", "entry of a table in memory; at least what its fields need", between(4, 16)
    )
    position_bytes: int = key(12, "bytes", "6|12", "of a Gaussian's position in the scene", one_of(6, 12))
    combine_lines: int = key(
        64, "lines", "1..65536", "write-combining buffer before the incoming lists",
        between(1, 65536),
    )  # fmt: skip
    record_stride: int = key(
        32, "bytes", "16|24|32|40|48|56|64", "distance of two feature records; at least what one needs",
        one_of(*range(16, 65, 8)),
    )  # fmt: skip
    cache_kb: int = key(0, "KB", "0..4096", "record caches, all raster cores together; 0: none", between(0, 4096))
    cache_shared: bool = key(False, "", "0|1", "one record cache for all raster cores", one_of(0, 1))
    morton: bool = key(False, "", "0|1", "Gaussians lie in memory along a Morton curve", one_of(0, 1))
    clusters: bool = key(False, "", "0|1", "clusters of 256 Gaussians are culled whole", one_of(0, 1))
    reproject: bool = key(
        False, "", "0|1", "what was in last frame's tables is found by projecting twice, not read from memory",
        one_of(0, 1),
    )  # fmt: skip
    preprocess_ahead: bool = key(
        False, "", "0|1", "preprocessing of a frame runs while the one before it is drawn",
        one_of(0, 1),
    )  # fmt: skip
    skip_blank: bool = key(
        False, "", "0|1", "tiles that hold nothing and held nothing are not drawn again",
        one_of(0, 1),
    )  # fmt: skip
    channels: int = key(4, "channels", "1|2|4|8|16|32", "LPDDR4-3200, 12.8 GB/s each", one_of(1, 2, 4, 8, 16, 32))
    charge_tests: bool = key(True, "", "0|1", "0: intersection tests take no time", one_of(0, 1))
    charge_imbalance: bool = key(True, "", "0|1", "0: SCUs share their work evenly", one_of(0, 1))
    charge_projection: bool = key(True, "", "0|1", "0: preprocessing units take no time", one_of(0, 1))
    charge_image: bool = key(True, "", "0|1", "0: pixels are not written", one_of(0, 1))

    def settings(self) -> dict:
        """Key -> value, what --set can change."""
        return {name: getattr(self, name) for name in keys.known(self)}

    @property
    def bandwidth(self) -> float:
        """Peak, bytes a second."""
        return self.channels * PEAK * 1e9


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


def configure(name: str, pairs: list[str]) -> Hardware:
    """A description with "KEY=VALUE" changes; InputError names the key, the value and what is valid."""
    if name not in HARDWARE:
        raise InputError(f"--hardware {name}: wants {'|'.join(HARDWARE)}")
    hardware = keys.change(HARDWARE[name], pairs)
    caches = 1 if hardware.cache_shared else hardware.slices
    least = -(-caches * WAYS * LINE // 1024)
    rules = (
        ("raster=gpu", (hardware.raster == "gpu") == (HARDWARE[name].raster == "gpu"), "--hardware gpu, nothing else"),
        ("tile=16", hardware.tile == 64 or hardware.raster in ("given", "gpu"), "raster=given"),
        ("tile=16", hardware.tile == 64 or hardware.scratch, "scratch=1"),
        ("late_sort=1", not (hardware.late_sort and hardware.scratch), "scratch=0"),
        (f"cache_kb={hardware.cache_kb}", hardware.cache_kb in (0, *range(least, 4097)), f"0 or {least}..4096 KB"),
    )
    for what, kept, wanted in rules:
        if not kept:
            raise InputError(f"--set {what}: wants {wanted}")
    return hardware
