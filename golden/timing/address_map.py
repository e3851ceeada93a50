"""Where everything lies in memory, in bytes, and how it is stored there (docs/traffic.md)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from golden import formats, params
from golden.timing.dram import LINE

BLOCK = 256  # Gaussians that are preprocessed together, and of a cluster
PAGE = 4096  # bytes: regions start at multiples
COLOUR_BYTES = 5  # of a colour that is kept: 39 bits
SPHERE_BYTES = 32  # of a cluster: centre, spread and reach, float32
START_BYTES = 8  # of a block: where its membership data start
HEAD_BYTES = 32  # of a block's membership data: one bit a Gaussian, visible or not
MEMBER_BYTES = 8  # of a visible Gaussian: the rectangle of its tiles in 24 bits, then one bit a tile
MEMBER_TILES = 40  # that fit into those; more take bytes of their own
ENTRY_MAX = 16  # bytes of an entry in any description
PIXEL_BYTES = 4  # 8 bits a channel and one byte unused, as gs_axi_pixel_writer packs them


@dataclass(frozen=True)
class Formats:
    """How the scene and the results of preprocessing are stored."""

    degree: int = 3  # of the scene's spherical harmonics
    position_bytes: int = 12  # three float32; the paper's artifact: 6, three float16
    reach: bool = False  # the Gaussian's reach lies beside its position: culling needs nothing else (2 bytes more)
    rest_stride: int = 0  # bytes from one Gaussian's other parameters to the next's; 0: packed
    colour_every: int = 1  # frames that a colour is kept; above 1 harmonics and the kept colours lie apart
    clusters: bool = False  # blocks are culled whole by their bounding sphere
    membership: bool = True  # "was it in the tile's last table?" is answered from memory; False: every pair is listed
    record_stride: int = 32  # bytes from one feature record to the next
    record_bytes: int = formats.REFERENCE.record_bytes  # of it that are used
    incoming_bytes: int = formats.REFERENCE.entry_bytes  # of an entry that preprocessing lists
    incoming_lines: str = "combined"  # or "artifact": three lines an entry, as the paper's simulator counts
    combine_lines: int = 64  # lines of the write-combining buffer in front of the incoming lists
    tile: int = params.TILE  # pixels along the side of a tile that preprocessing lists for

    @property
    def harmonics_bytes(self) -> int:
        """float16, three channels."""
        return 6 * (self.degree + 1) ** 2

    @property
    def split(self) -> bool:
        """Harmonics lie in a region of their own."""
        return self.colour_every > 1

    @property
    def position_stride(self) -> int:
        return self.position_bytes + 2 * self.reach

    @property
    def rest_bytes(self) -> int:
        """float16: opacity 2, scale 6, rotation 8, and the harmonics where they are not split off."""
        return 16 + (0 if self.split else self.harmonics_bytes)

    @property
    def rest_step(self) -> int:
        return self.rest_stride or self.rest_bytes


def record_bytes(f: formats.Formats, predicted: bool) -> int:
    """Bytes of a feature record, whole beats. predicted: it holds a second key, for the camera of the next frame."""
    bits = sum(width for _, width in formats.record_fields(f)) + f.key_w
    return max(f.record_bytes, -(-bits // 64) * 8) if predicted else f.record_bytes


@dataclass(frozen=True)
class Regions:
    """First byte of each region; two where one generation is written while the other is read."""

    positions: int
    rest: int
    harmonics: int
    colours: int
    clusters: int
    blocks: tuple[int, int]
    members: tuple[int, int]
    features: tuple[int, int]
    incoming: tuple[int, int]
    scratch: int
    tables: tuple[int, int]
    image: tuple[int, int]
    end: int


def regions(formats: Formats, scene_n: int, width: int, height: int, entries: int) -> Regions:
    """Regions one behind the other, in pages, for a picture of width x height.

    entries: most entries that all tables of a frame hold together. A list of each tile starts with a line, so that
    lists take up to a line a tile more than their entries (ENTRY_MAX bytes each).
    """
    at = 0
    tiles = -(-width // formats.tile) * -(-height // formats.tile)

    def take(size: int) -> int:
        nonlocal at
        begin = at
        at += -(-max(size, 1) // PAGE) * PAGE
        return begin

    def both(size: int) -> tuple[int, int]:
        return take(size), take(size)

    blocks = -(-scene_n // BLOCK)
    lists = ENTRY_MAX * entries + LINE * tiles
    member = MEMBER_BYTES + -(-tiles // 8)  # bytes of a Gaussian that covers the picture
    return Regions(
        positions=take(formats.position_stride * scene_n),
        rest=take(formats.rest_step * scene_n),
        harmonics=take(formats.harmonics_bytes * scene_n if formats.split else 0),
        colours=take(COLOUR_BYTES * scene_n if formats.split else 0),
        clusters=take(SPHERE_BYTES * blocks),
        blocks=both(START_BYTES * blocks),
        members=both(HEAD_BYTES * blocks + member * scene_n),
        features=both(formats.record_stride * scene_n),
        incoming=both(lists),
        scratch=take(lists),
        tables=both(lists),
        image=both(LINE * image_lines(width, height)),
        end=at,
    )


def list_starts(base: int, lengths: np.ndarray, entry_bytes: int) -> np.ndarray:
    """[T + 1] int64 byte addresses of lists of so many entries, each at the start of a line; the last: behind all."""
    size = -(-np.asarray(lengths, np.int64) * entry_bytes // LINE) * LINE
    return base + np.concatenate((np.zeros(1, np.int64), np.cumsum(size)))


def list_lines(lengths: np.ndarray, entry_bytes: int) -> int:
    """Lines of lists of so many entries, read or written once."""
    return int((-(-np.asarray(lengths, np.int64) * entry_bytes // LINE)).sum())


def image_lines(width: int, height: int) -> int:
    """Lines of the picture. A row starts with a line, so the part of it in a tile of 16 or 64 pixels is whole lines."""
    return -(-width * PIXEL_BYTES // LINE) * height
