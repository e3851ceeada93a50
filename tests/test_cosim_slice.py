"""The Verilated slice against the golden model: tables, bitmaps, pixels and cycles of whole small frames."""

from types import SimpleNamespace

import numpy as np
import pytest

from golden import dma, params, records
from golden import slice as gs_slice
from golden.cosim.model import CosimError, Slice
from golden.formats import REFERENCE
from golden.raster_core import raster_lane
from golden.raster_core.raster_core import rasterise
from golden.slice import frame_times, sort_jobs
from golden.sorting_core import sort_lane, sort_sequencer, sorting_core

pytestmark = pytest.mark.slow  # builds the RTL model: a minute where it is not there yet
BACKGROUND = (100, 2000, 1024)


def features(random: np.random.Generator, n: int, width: int, height: int) -> SimpleNamespace:
    """n Gaussians of 0.7 to 20 pixels over the picture, in record codes."""
    mean = np.stack([random.uniform(-8, side + 8, n) for side in (width, height)], 1)
    size = np.exp(random.uniform(-0.4, 3, (n, 2)))
    angle = random.uniform(0, np.pi, n)
    xx, yy = (
        (size[:, 0] * np.cos(angle)) ** 2 + (size[:, 1] * np.sin(angle)) ** 2 + 0.3,
        (size[:, 0] * np.sin(angle)) ** 2 + (size[:, 1] * np.cos(angle)) ** 2 + 0.3,
    )
    xy = (size[:, 0] ** 2 - size[:, 1] ** 2) * np.sin(angle) * np.cos(angle)
    det = xx * yy - xy**2
    chol = np.stack([np.sqrt(yy / det), -xy / np.sqrt(yy * det), 1 / np.sqrt(yy)], 1) * np.sqrt(np.log2(np.e) / 2)

    def codes(x, fraction):
        return np.floor(x * 2.0**fraction + 0.5).astype(np.int64)

    return SimpleNamespace(
        mean=codes(mean, REFERENCE.mean_f),
        chol=codes(chol, REFERENCE.chol_f),
        opacity=codes(-np.log2(random.uniform(0.02, 1, n)), REFERENCE.opacity_f),
        colour=codes(random.uniform(0, 2, (n, 3)), REFERENCE.colour_f),
        key=records.depth_key(REFERENCE, np.exp(random.uniform(-1, 3, n))),
    )


def tiles_of(width: int, height: int) -> np.ndarray:
    ys, xs = np.mgrid[0 : -(-height // params.TILE), 0 : -(-width // params.TILE)]
    return np.stack([xs.ravel(), ys.ravel()], 1).astype(np.int64) * params.TILE


def join(parts: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    offsets = np.concatenate([[0], np.cumsum([len(part) for part in parts])]).astype(np.int64)
    return offsets, np.concatenate([np.zeros(0, np.int64), *parts])


def compare(model: Slice, scene, table, incoming, xy, size, first, latency) -> list[np.ndarray]:
    """One frame on both sides; returns the tables written back. Cycles are compared when a latency is given."""
    order = [sort_sequencer.sort(old, new, first) for old, new in zip(table, incoming, strict=True)]
    want = rasterise(REFERENCE, join(order), scene, xy, *size, BACKGROUND)
    got = model.frame(scene, join(table), join(incoming), xy, *size, BACKGROUND, first)
    assert np.array_equal(got.offsets, join(order)[0])
    for name, expected in (("words", "words_out"), ("bitmaps", "bitmaps"), ("value", "value"), ("rgb8", "rgb8")):
        assert np.array_equal(getattr(got, name), getattr(want, expected)), name
    assert got.blends.sum() == want.blends.sum()
    if latency:
        assert np.array_equal(got.blends, want.blends)
        places = model.places()
        jobs, words = sort_jobs(REFERENCE, join(table), join(incoming), first, latency, places)
        assert all(map(np.array_equal, words, order))
        times = frame_times(REFERENCE, jobs, join(order), want, xy, *size, latency, places)
        for name in ("accepted", "sorted", "px_first", "px_last", "done"):
            assert np.array_equal(getattr(got, name), getattr(times, name)), name
        assert got.cycles == times.cycles
        entries = sum(map(len, order))
        assert got.counters["feature_read_beats"] == 3 * entries
        assert (
            got.counters["table_read_beats"]
            == got.counters["table_write_beats"]
            == sum(dma.beats(len(o), REFERENCE.entry_bytes) for o in order)
        )
    return [got.words[a:b] for a, b in zip(got.offsets, got.offsets[1:], strict=False)]


def frames(size, seed: int, latency: dma.Latency | None, n_frames: int = 2, lengths=None, stall: int = 0) -> None:
    """A few frames on one model. The first is from scratch; then keys change and new entries come."""
    random = np.random.default_rng(seed)
    count = 1500
    scene = features(random, count, *size)
    xy = tiles_of(*size)
    lengths = lengths or [int(random.integers(0, 700)) for _ in xy]
    assert len(lengths) == len(xy)
    model = Slice(REFERENCE, latency or dma.LATENCY, stall)
    members = [random.permutation(count)[:n] for n in lengths]
    table = [np.zeros(0, np.int64) for _ in xy]
    incoming = [records.entries(scene.key[part], part) for part in members]
    for frame in range(1, n_frames + 1):
        table = compare(model, scene, table, incoming, xy, size, sorting_core.first_length(frame), latency)
        scene.key = np.clip(scene.key + random.integers(-2000, 2000, count), 0, (1 << REFERENCE.key_w) - 1)
        incoming = []
        for old in table:
            there = records.indices_of(old[old < records.INVALID])
            new = np.setdiff1d(random.permutation(count)[: int(random.integers(0, 60))], there)
            incoming.append(records.entries(scene.key[new], new))


def test_two_frames_of_four_tiles():
    frames((128, 128), 1, dma.LATENCY)


def test_a_picture_that_is_no_multiple_of_a_tile():
    frames((130, 70), 2, dma.LATENCY)


@pytest.mark.parametrize("latency", [dma.Latency(1, 1), dma.Latency(2, 400), dma.Latency(300, 3)])
def test_cycles_at_any_latency(latency):
    """Lists around the borders of blocks and batches, empty tiles in a row, more tiles than are under way at once."""
    lengths = [0, 1, 256, 0, 0, 0, 512, 257, 2, 255, 0, 0, 0, 0, 300, 3, 1, 1, 0, 256]
    frames((4 * 64 + 2, 3 * 64 + 6), 3, latency, lengths=lengths)


def test_both_memories_draw_the_same_delays():
    library = Slice(REFERENCE)._library
    for latency in (
        dma.Latency(jitter=1, seed=0),
        dma.Latency(jitter=500, seed=9),
        dma.Latency(jitter=4096, seed=1 << 23),
    ):
        draws = np.array(
            [[dma.late(latency, port, burst) for burst in (*range(300), 1 << 20)] for port in range(dma.PORTS)]
        )
        for port, burst in ((0, 0), (3, 17), (dma.FEATURE, 299), (dma.PIXEL, 123)):
            assert draws[port, burst] == library.slice_late(latency.jitter, latency.seed, port, burst)
        assert draws[-1, -1] == library.slice_late(latency.jitter, latency.seed, dma.PORTS - 1, 1 << 20)
        assert draws.min() == 0 and 0.9 * latency.jitter <= draws.max() <= latency.jitter


@pytest.mark.parametrize("jitter", [7, 63, 500, 4000])
@pytest.mark.parametrize("seed", [1, 2])
def test_cycles_when_answers_are_late_at_random(jitter, seed):
    lengths = [0, 1, 256, 0, 700, 0, 512, 257, 2, 255, 0, 0, 0, 0, 300, 3, 1, 1, 0, 256]
    frames((4 * 64 + 2, 3 * 64 + 6), 20 + seed, dma.Latency(1 + 20 * seed, 30, jitter, seed), lengths=lengths)


@pytest.mark.parametrize(
    ("module", "name", "wrong", "compiled", "found"),
    [
        (
            sort_lane,
            "NEXT_COMMAND",
            sort_sequencer.NEXT_COMMAND + 1,
            [(sort_lane, "run_job"), (gs_slice, "_jobs")],
            "sorted",
        ),
        (gs_slice, "OFFER", gs_slice.OFFER + 1, [(gs_slice, "_frame")], "accepted"),
        (
            raster_lane,
            "end_tile",
            lambda *_: (10_000, 10_001),
            [(raster_lane, "step"), (gs_slice, "_frame")],
            "px_first",
        ),
    ],
)
def test_a_wrong_formula_is_found(monkeypatch, module, name, wrong, compiled, found):
    """compiled: the functions to be interpreted, so that they see what is changed."""
    for place, function in compiled:
        monkeypatch.setattr(place, function, getattr(place, function).py_func)
    frames((128, 64), 12, dma.LATENCY, n_frames=1)
    monkeypatch.setattr(module, name, wrong)
    with pytest.raises(AssertionError, match=found):
        frames((128, 64), 12, dma.LATENCY, n_frames=1)


@pytest.mark.parametrize("stall", [1, 2, 3])
def test_stalls_change_nothing_but_cycles(stall):
    frames((130, 70), 3 + stall, None, stall=stall)


def test_from_scratch_lists_need_many_merges():
    frames((128, 64), 8, dma.LATENCY, n_frames=1, lengths=[1500, 1300])


def test_a_frame_does_not_depend_on_the_one_before():
    """The same frame twice on one model: same cycles."""
    random = np.random.default_rng(9)
    scene = features(random, 300, 128, 64)
    words = records.entries(scene.key, np.arange(300))
    model = Slice(REFERENCE)
    empty = join([np.zeros(0, np.int64)] * 2)
    runs = [model.frame(scene, empty, join([words, words[:99]]), tiles_of(128, 64), 128, 64) for _ in range(2)]
    assert np.array_equal(runs[0].done, runs[1].done) and runs[0].counters == runs[1].counters


def test_progress_is_told_and_a_hang_is_explained():
    random = np.random.default_rng(10)
    scene = features(random, 300, 64, 64)
    words = records.entries(scene.key, np.arange(300))
    model = Slice(REFERENCE, dma.Latency(5000, 20), watchdog=1000)
    empty, xy = join([np.zeros(0, np.int64)]), tiles_of(64, 64)
    with pytest.raises(CosimError, match=r"nothing has moved since .* sort lane 0 is in tile 0; .* port sort 0"):
        model.frame(scene, empty, join([words]), xy, 64, 64)
    model = Slice(REFERENCE, dma.Latency(60_000, 20))
    seen = []
    model.frame(scene, empty, join([words]), xy, 64, 64, watch=seen.append)
    assert [p.cycle for p in seen] == [50_000 * (k + 1) for k in range(len(seen))] and len(seen) >= 3
