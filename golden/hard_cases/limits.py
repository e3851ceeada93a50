"""Our own: limits of tables, keys and batches, and late sort, X12 to X20."""

from __future__ import annotations

import numpy as np

from golden import formats, params, records, tables
from golden.formats import Formats
from golden.frame import Renderer
from golden.hard_cases.case import case
from golden.hard_cases.run import Run
from golden.hard_cases.setting import camera_a, crowd, gaussians, layers, yaw
from golden.tables import Lists

AWAY = {"rotation": yaw(150), "position": (0, 0, 8)}


@case("X12", "Tables of exactly the capacity")
def x12(run: Run) -> None:
    capacity = params.CHUNK
    for n, over in ((capacity - 1, 0), (capacity, 0), (capacity + 1, 1)):
        frames = run.sequence(gaussians([(-0.5, -0.5, 2)] * n, 0.02, 0.05), capacity=capacity)
        found = [frames.frame(camera_a()) for _ in range(3)]
        run.equal(f"{n} entries: overflow in three frames", [f.counters["overflow"] for f in found], [over] * 3)
        run.equal(f"{n} entries: longest table", int(found[-1].order.lengths.max()), min(n, capacity))


@case("X13", "Cut and return")
def x13(run: Run) -> None:
    frames = run.sequence(crowd(1, 400))
    first = frames.frame(camera_a())
    frames.frame(camera_a(**AWAY))
    run.same("back where it was against the first frame", frames.frame(camera_a()), first)


@case("X14", "A hundred frames at rest")
def x14(run: Run) -> None:
    frames = run.sequence(crowd(1, 400))
    first = frames.frame(camera_a())
    moved = 0
    for _ in range(20 if run.rtl else 100):
        last = frames.frame(camera_a())
        moved += last.counters["incoming"] + last.counters["outgoing"]
    run.equal("entries that come or go", moved, 0)
    run.same("last frame against the first", last, first)


@case("X15", "Pictures whose size changes between frames")
def x15(run: Run) -> None:
    scene = crowd(1, 400)
    frames = run.sequence(scene)
    for size in ((130, 70), (64, 64), (130, 70), (1, 1), (200, 130)):
        alone = Run(run.settings).frame(scene, camera_a(*size))
        run.same(f"{size[0]}x{size[1]} against a cold start", frames.frame(camera_a(*size)), alone)


@case("X16", "Depths one key code apart, and closer")
def x16(run: Run) -> None:
    step = 2.0 ** (formats.KEY_E - run.formats.key_bits)
    for z in (0.25, 2.0, 2.0**20):
        for name, apart, front in (("one code", step, 1.0), ("half a code", step / 2, 0.0)):
            scene = gaussians([(0, 0, z * (1 + apart)), (0, 0, z)], 50 * z, 0.99, [(0, 0, 0), (1, 1, 1)])
            frame = run.frame(scene, camera_a())
            value = 0.99 * front + 0.0099 * (1 - front)
            what = f"{name} at {z:g}: value from that of {'nearer' if front else 'lower index'} first, LSB"
            run.at_most(what, abs(frame.image[64, 64, 0] - value) * 255, 0.25)


@case("X17", "Lists around one and two batches, with and without a stop")
def x17(run: Run) -> None:
    batch = params.CHUNK
    for n in (batch - 1, batch, batch + 1, 2 * batch - 1, 2 * batch, 2 * batch + 1):
        frame = run.frame(layers(n, 0.02, np.arange(n) % 2), camera_a(64, 64))
        run.equal(f"{n} layers: entries", frame.order.words.size, n)
        run.against_oracle(frame)


@case(
    "X18",
    "The last index and the largest key",
    "sorting_core/test_bitonic_sort_unit: entries_of_all_ones_are_not_padding",
)
def x18(run: Run) -> None:
    last, top = (1 << params.INDEX_W) - 1, (1 << run.formats.key_w) - 1
    table = np.sort(records.entries(np.array([top, top, 0, 5]), np.array([last, last - 1, last - 2, 0])))
    new = records.entries(np.array([top, top - 1]), np.array([last - 3, 1]))
    merged = tables.sort(Lists.join([table]), Lists.join([new]), params.CHUNK, tables.CHUNKS).words
    run.equal("keys in order", records.keys_of(merged).tolist(), [0, 5, top - 1, top, top, top])
    run.equal("indices", records.indices_of(merged).tolist(), [last - 2, 0, 1, last - 3, last - 1, last])
    run.equal("read back from memory: entries that differ", int((_stored(run.formats, merged) != merged).sum()), 0)
    run.equal("the largest entry is below every invalid one", bool(merged[-1] < records.INVALID), True)


def _stored(f: Formats, words: np.ndarray) -> np.ndarray:
    """Entries as a memory gives them back."""
    return records.entries_from_bytes(f, records.entry_bytes(f, words))


@case(
    "X19",
    "Late sort: cut, splat that comes back, equal depths, rest",
    "raster_core/test_late_core: equal_keys_are_ordered_by_index",
)
def x19(run: Run) -> None:
    scene = crowd(19, 1500)
    warm = _late(run, scene)
    for step in range(3):
        warm.frame(camera_a(rotation=yaw(step)))
    cold = _late(run, scene).frame(camera_a(**AWAY))
    run.same("declared cut against a cold start", warm.frame(camera_a(**AWAY), cut=True), cold)
    for _ in range(3):
        rest = warm.frame(camera_a(**AWAY))
    run.same("at rest against the cold start", rest, cold)
    run.against_oracle(cold)
    lost = _late(run, gaussians((0, 0, 2), scales=1e-9, opacities=0.0090))
    lost.frame(camera_a())
    seen = lost.frame(camera_a(position=(-0.0078125, -0.0078125, 0)))
    run.at_least("T04: LSB where the mean sits on a pixel", seen.image[64, 64, 0] * 255, 2)
    depth = np.where(np.arange(83) < 23, 3.0, np.random.default_rng(10).uniform(2, 4, 83))
    ties = _late(
        run, gaussians(np.column_stack([depth * 0, depth * 0, depth]), 0.5, 0.5, depth[:, None] % 1 * [1, 1, 1])
    )
    first = ties.frame(camera_a())
    run.same("T08: warm frame against the cold one", ties.frame(camera_a()), first)


def _late(run: Run, scene) -> Renderer:
    return Renderer(scene, run.with_keys(), late=True)
