"""Runs a case: renderers with this run's settings, the RTL beside them where asked for, and the comparisons."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from rich.progress import Progress

from golden import metrics, oracle, params, slice
from golden.cameras.camera import Camera
from golden.frame import Frame, Renderer, tiles_of
from golden.hard_cases.case import Checks
from golden.hard_cases.setting import gaussians
from golden.job import Job
from golden.preprocess import Features, Pairs, Projection, duplicate, encode
from golden.records import indices_of
from golden.scene.gaussians import Gaussians
from golden.settings import Settings
from golden.tables import Lists

ARITHMETIC = 0.25  # LSB, with the golden model's decisions
FLIPPED = 0.001  # share of the pixels that may be off by more than 1 LSB with own decisions


class Given(Renderer):
    """A renderer of screen ellipses: what comes in is a projection, or codes, or lists of each tile's Gaussians."""

    def __init__(
        self,
        projection: Projection,
        settings: Settings,
        features: Features | None = None,
        pairs: Pairs | None = None,
        table: Lists | None = None,
    ):
        """table: what the last frame wrote back."""
        super().__init__(gaussians(np.zeros((len(projection.visible), 3))), settings)
        self.given = projection, features or encode(settings.formats(), projection), pairs
        self.table = table

    def preprocess(self, camera: Camera) -> tuple[Projection, Features, Pairs]:
        projection, features, pairs = self.given
        return projection, features, pairs or duplicate(self.settings.formats(), features, camera.width, camera.height)

    def frame(self, camera: Camera, cut: bool = False) -> Frame:
        if self.camera is None and self.table is not None:
            self.camera, self.written = camera, self.table
        return super().frame(camera, cut)


class Sequence:
    """The frames of one renderer, each compared with the RTL where the run asks for it."""

    def __init__(self, run: Run, renderer: Renderer):
        self.run, self.renderer, self.pair = run, renderer, None
        if run.rtl:
            from golden.cosim.compare import Cosim

            job = Job(renderer.gaussians, renderer.settings, range(0), [], {})
            self.pair = Cosim(job, renderer.sorting, Progress(disable=True), renderer=renderer)
            self.pair.tables = getattr(renderer, "table", None)

    def frame(self, camera: Camera, cut: bool = False) -> Frame:
        if self.pair is None:
            return self.renderer.frame(camera, cut)
        result = self.pair.draw(camera, cut=cut)
        self.run.compared(result)
        return result.frame


class Run(Checks):
    """One case being run. settings: of the build that is judged; rtl: compare every frame with the RTL."""

    def __init__(self, settings: Settings, rtl: bool = False):
        super().__init__()
        self.settings = settings
        self.formats = settings.formats()
        self.rtl = rtl
        self.rtl_frames = self.rtl_cycles = self.rtl_differences = 0

    def compared(self, result) -> None:
        """Count a frame that the RTL has drawn too."""
        self.rtl_frames += 1
        self.rtl_cycles += result.cycles["cycles"]
        self.rtl_differences += result.mismatches

    def finish(self) -> None:
        """The last check of a case that drew frames by the RTL."""
        if self.rtl_frames:
            what = f"RTL against golden, {self.rtl_frames} frames, {self.rtl_cycles:,} cycles: differences"
            self.equal(what, self.rtl_differences, 0)

    def with_keys(self, background: str = "0,0,0", **keys) -> Settings:
        """This run's settings with the keys of a recipe."""
        return replace(self.settings, background=background, **keys)

    def sequence(self, scene: Gaussians, **keys) -> Sequence:
        """Frames of a scene, tables kept from one to the next."""
        return Sequence(self, Renderer(scene, self.with_keys(**keys)))

    def frame(self, scene: Gaussians, camera: Camera, **keys) -> Frame:
        """The first frame of a scene."""
        return self.sequence(scene, **keys).frame(camera)

    def given(self, projection: Projection, features=None, pairs=None, table=None, **keys) -> Sequence:
        """Frames of screen ellipses (Given)."""
        return Sequence(self, Given(projection, self.with_keys(**keys), features, pairs, table))

    def against_oracle(self, frame: Frame, background: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        """Both budgets: <= 0.25 LSB with the golden decisions, <= 1 LSB on 99.9 % of the pixels with own ones."""
        tables = frame.order.offsets, indices_of(frame.order.words), params.TILE
        width, height = frame.camera.width, frame.camera.height
        injected = oracle.render_injected(
            frame.formats, frame.features, frame.projection, tables, width, height, background
        )
        own = oracle.render(frame.projection, frame.camera, background)
        self.at_most("arithmetic: LSB from the oracle with the same decisions", lsb(frame.image, injected), ARITHMETIC)
        far = np.abs(frame.image - own).max(axis=2) * 255 > 1
        self.at_most("own decisions: share of pixels above 1 LSB", far.mean(), FLIPPED)
        close = np.abs(frame.image - injected).max(axis=2) * 255 <= ARITHMETIC
        self.equal("pixels above 1 LSB that no flipped decision explains", int((far & ~close).sum()), 0)

    def same(self, what: str, a: Frame, b: Frame) -> None:
        """Metamorphic: equal pictures, to the last bit."""
        self.equal(f"{what}: values that differ", int(np.count_nonzero(a.raster.value != b.raster.value)), 0)


def lsb(image: np.ndarray, truth: np.ndarray) -> float:
    """Largest difference of two pictures in LSB."""
    return metrics.compare(image, truth)["max_lsb"]


def cycles(frame: Frame) -> int:
    """Cycles that one slice takes for a frame, by the golden model's formulas."""
    lists = [(part.offsets, part.words) for part in (frame.table, frame.incoming)]
    jobs, _ = slice.sort_jobs(frame.formats, *lists, frame.firsts)
    size = frame.camera.width, frame.camera.height
    order = frame.order.offsets, frame.order.words
    return slice.frame_times(frame.formats, jobs, order, frame.raster, tiles_of(*size), *size).cycles
