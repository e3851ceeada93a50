"""`splatcore cosim`: frames by the RTL beside the golden model, compared to the last bit and the last cycle."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from rich.progress import Progress

from golden import dma, params
from golden.cameras.camera import Camera
from golden.cosim.model import Slice, SliceFrame
from golden.errors import InputError
from golden.frame import Frame, Lists, Renderer, tiles_of
from golden.job import Job
from golden.records import indices_of
from golden.settings import Settings
from golden.slice import SliceTimes, frame_times, sort_jobs
from golden.sorting_core import sorting_core


@dataclass(frozen=True)
class Result:
    """One frame of both. image: the RTL's, [H, W, 3] float32."""

    image: np.ndarray
    counters: dict[str, int]
    cycles: dict
    mismatches: int
    difference: str | None  # the first one: unit, tile, entry or pixel, both values
    frame: Frame  # the golden model's

    def line(self, number: int, quality: dict | None) -> str:
        """What the terminal shows of a frame."""
        c = self.counters
        text = (
            f"frame {number}: entries {c['entries']:,}  incoming {c['incoming']:,}  outgoing {c['outgoing']:,}  "
            f"pairs {c['pairs']:,}  cycles {self.cycles['cycles']:,}  mismatches {self.mismatches}"
        )
        if quality is None:
            return text
        psnr = quality["psnr_db"]
        return text + ("  equal to the oracle" if psnr is None else f"  PSNR {psnr:.1f} dB")


def _where(frame: Frame, offsets: np.ndarray, entry: int) -> str:
    """Tile and place of entry number `entry` of all tables."""
    tile = int(np.searchsorted(offsets, entry, side="right")) - 1
    x, y = tiles_of(frame.camera.width, frame.camera.height)[tile]
    return f"tile {tile} (pixel {x}, {y}), entry {entry - int(offsets[tile])}"


def differences(rtl: SliceFrame, frame: Frame, expected: SliceTimes) -> tuple[int, str | None]:
    """(how many, the first in words) of everything in which RTL and golden model differ."""
    golden = frame.raster
    offsets = frame.order.offsets
    if not np.array_equal(rtl.offsets, offsets):
        bad = np.flatnonzero(np.diff(rtl.offsets) != np.diff(offsets))
        t = int(bad[0])
        text = f"sorting core: tile {t}: RTL lists {np.diff(rtl.offsets)[t]} entries, golden {np.diff(offsets)[t]}"
        return bad.size, text
    total, first = 0, None

    def check(unit: str, got: np.ndarray, want: np.ndarray, where, show) -> None:
        nonlocal total, first
        bad = np.argwhere(got != want)
        total += len(bad)
        if len(bad) and first is None:
            at = tuple(bad[0])
            first = f"{unit}: {where(*bad[0])}: RTL {show(got[at])}, golden {show(want[at])}"

    def entry(k: int) -> str:
        return _where(frame, offsets, int(k))

    def tile(t: int) -> str:
        return f"tile {t}"

    def pixel(y: int, x: int, channel: int) -> str:
        return f"pixel ({x}, {y}), {('red', 'green', 'blue')[channel]}"

    check("sorting core, index", indices_of(rtl.words), indices_of(golden.words_out), entry, int)
    check("raster core, table written back", rtl.words, golden.words_out, entry, lambda word: f"0x{int(word):012x}")
    check("intersection test units, bitmap", rtl.bitmaps, golden.bitmaps, entry, lambda word: f"0x{int(word):016x}")
    check("subtile compute units, value", rtl.value, golden.value, pixel, int)
    check("pixel resolver, 8 bit", rtl.rgb8, golden.rgb8, pixel, int)
    check("subtile compute units, blends", rtl.blends, golden.blends, tile, int)
    check("sorting cores, cycle of a tile's end", rtl.sorted, expected.sorted, tile, int)
    check("raster core, cycle of a tile's first pixels", rtl.px_first, expected.px_first, tile, int)
    check("raster core, cycle of a tile's last pixels", rtl.px_last, expected.px_last, tile, int)
    check("slice, cycle of a tile's end", rtl.done, expected.done, tile, int)
    return total, first


def check(settings: Settings) -> None:
    """InputError for a setting that the RTL's slice does not have."""
    for name, known in (
        ("depth", ("auto", "deferred", "consistent")),
        ("passes", (1,)),
        ("chunk", (params.CHUNK,)),
        ("refresh", ("all",)),
        ("bound", ("exact",)),
        ("stop_rule", ("blend-last",)),
    ):
        value = getattr(settings, name)
        if value not in known:
            raise InputError(f"--set {name}={value}: the RTL's slice wants {'|'.join(map(str, known))}")


class Cosim:
    """The RTL's slice and the golden model, frame after frame; each keeps its own tables.

    renderer: the golden model's, of the job's scene where none is given.
    """

    def __init__(self, job: Job, sorting: str, progress: Progress, seed: int = 0, renderer: Renderer | None = None):
        check(job.settings)
        self.job = job
        self.renderer = renderer or Renderer(job.gaussians, job.settings, sorting)
        keys = job.settings
        self.latency = dma.Latency(keys.read_latency, keys.write_latency, keys.answer_jitter, seed & 0xFFFFFF)
        self.slice = Slice(job.settings.formats(), self.latency)
        self.tables: Lists | None = None  # as the RTL wrote them
        self.progress = progress
        self.task = progress.add_task("cosim", total=len(job.frames))
        self.compared = {"frames": 0, "table entries": 0, "bitmaps": 0, "pixels": 0, "cycles": 0}
        self.cycles = 0
        self.seconds = 0.0

    def _table(self, frame: Frame) -> Lists:
        """The RTL's own table of each tile that is to be reused in this frame."""
        tiles = range(frame.table.offsets.size - 1)
        return Lists.join([self.tables.tile(t) if frame.table.tile(t).size else frame.table.tile(t) for t in tiles])

    def _times(self, frame: Frame, first: int) -> SliceTimes:
        """When the golden model says that every tile ends."""
        table, incoming, order = frame.table, frame.incoming, frame.order
        places = self.slice.places()
        lists = (table.offsets, table.words), (incoming.offsets, incoming.words)
        jobs, _ = sort_jobs(frame.formats, *lists, first, self.latency, places)
        width, height = frame.camera.width, frame.camera.height
        tiles = tiles_of(width, height)
        return frame_times(
            frame.formats, jobs, (order.offsets, order.words), frame.raster, tiles, width, height, self.latency, places
        )

    def frame(self, index: int) -> Result:
        """Render and compare the frame of camera `index`."""
        return self.draw(self.job.cameras[index], index)

    def draw(self, camera: Camera, index: int = 0, cut: bool = False) -> Result:
        """Render and compare the next frame; index: for the progress, cut: as of Renderer.frame."""
        first = sorting_core.first_length(self.renderer.number)
        frame = self.renderer.frame(camera, cut)
        table = self._table(frame) if self.tables else frame.table
        tiles = tiles_of(camera.width, camera.height)
        begin = time.perf_counter()
        entries = max(frame.order.words.size, 1)
        rtl = self.slice.frame(
            frame.features,
            (table.offsets, table.words),
            (frame.incoming.offsets, frame.incoming.words),
            tiles,
            camera.width,
            camera.height,
            self.job.settings.background_codes(),
            first,
            lambda now: self.progress.update(self.task, completed=index + now.entries / entries),
        )
        self.seconds += time.perf_counter() - begin
        self.progress.update(self.task, completed=index + 1)
        expected = self._times(frame, first)
        mismatches, difference = differences(rtl, frame, expected)
        self.tables = Lists(rtl.offsets, rtl.words)
        self.compared["frames"] += 1
        self.compared["table entries"] += rtl.words.size
        self.compared["bitmaps"] += rtl.bitmaps.size
        self.compared["pixels"] += rtl.value.shape[0] * rtl.value.shape[1]
        self.compared["cycles"] += rtl.cycles
        self.cycles += rtl.cycles
        image = (rtl.value * 2.0**-frame.formats.acc_f).astype(np.float32)
        return Result(image, frame.counters, _cycles(rtl), mismatches, difference, frame)

    def summary(self) -> str:
        """The last line: what was compared, and how fast the RTL ran."""
        counts = ", ".join(f"{value:,} {name}" for name, value in self.compared.items())
        return f"0 differences in {counts}; RTL at {self.cycles / self.seconds:,.0f} cycles a second"


def _cycles(rtl: SliceFrame) -> dict:
    """Cycles and bytes of the frame for stats.json. Sorting and raster overlap: each is the time to its last tile."""
    c = rtl.counters

    def bytes_of(direction: str, *ports: str) -> int:
        return sum(c[f"{port}_{direction}_beats"] * (16 if port == "pixel" else 8) for port in ports)

    cores = range(params.SORT_CORES)
    sort = [f"sort{core}" for core in cores]
    insert = [f"insert{core}" for core in cores]
    return {
        "cycles": rtl.cycles,
        "stage_cycles": {
            "preprocess": None,
            "sorting": int(rtl.sorted.max(initial=0)),
            "raster": int(rtl.done.max(initial=0)),
        },
        "bytes": {
            "sorting": {"read": bytes_of("read", *sort, *insert), "write": bytes_of("write", *sort)},
            "raster": {"read": bytes_of("read", "table", "feature"), "write": bytes_of("write", "table", "pixel")},
        },
    }
