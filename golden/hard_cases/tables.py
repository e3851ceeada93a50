"""Tables from frame to frame: T01 to T08."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from golden import metrics, oracle, params
from golden.frame import Renderer
from golden.hard_cases.case import case
from golden.hard_cases.lists import sequence, valid
from golden.hard_cases.run import Run
from golden.hard_cases.setting import camera_a, crowd, gaussians, merge, yaw
from golden.records import entries, indices_of
from golden.sorting_core import sorting_core

CORE = "sorting_core/test_sorting_core"
C = params.CHUNK


@case("T01", "Boundary interleave must really cross boundaries", f"{CORE}: merge_crosses_the_borders_of_chunks")
def t01(run: Run) -> None:
    keys = np.arange(1, 1025)
    keys[300] = 0
    for odd in (False, True):
        frames, camera = sequence(run, [entries(keys, np.arange(1024))], [[]], keys, odd)
        waited = 0
        order = None
        while waited < 8 and (order is None or order[0] != 300):
            order = indices_of(frames.frame(camera).order.tile(0))
            waited += 1
        run.at_most(f"{'odd' if odd else 'even'} frame first: frames until key 0 is at index 0", waited, 4)
    uncovered = 0
    for n in (1, 127, 128, 129, 1000, 1024):
        for frame in (0, 1):
            covered = np.zeros(n, int)
            for start, end in sorting_core.ranges(n, sorting_core.first_length(frame)):
                covered[start:end] += 1
            uncovered += int((covered != 1).sum())
    run.equal("entries that a frame's ranges do not cover once", uncovered, 0)


@case("T02", "Short tables", f"{CORE}: every_length_in_data_and_cycles")
def t02(run: Run) -> None:
    lengths = [0, 1, 2, 127, 128, 129, 200, 255, 256, 257, 383, 384, 385, 511, 512, 513]
    keys = np.arange(sum(lengths))[::-1].copy()
    ends = np.cumsum(lengths)
    picks = [np.arange(end - n, end) for n, end in zip(lengths, ends)]
    for odd in (False, True):
        name = f"{'odd' if odd else 'even'} frame first"
        # reversed: the keys fall while the indices rise
        frames, camera = sequence(run, [entries(keys[p], p) for p in picks], [[]] * len(picks), keys, odd)
        orders = [frames.frame(camera).order for _ in range(2)]
        ready = [[_ordered(order.tile(t)) for t in range(len(picks))] for order in orders]
        run.equal(f"{name}: entries lost", sum(lengths) - orders[1].words.size, 0)
        late = sum(n <= C // 2 and not done for n, done in zip(lengths, ready[0]))
        run.equal(f"{name}: tables up to {C // 2} unsorted after 1 frame", late, 0)
        late = sum(n <= C and not done for n, done in zip(lengths, ready[1]))
        run.equal(f"{name}: tables up to {C} unsorted after 2 frames", late, 0)


def _ordered(words: np.ndarray) -> bool:
    return bool((np.diff(words) > 0).all())


def _inversions(words: np.ndarray) -> int:
    """Pairs of entries that are in the wrong order."""
    return sum(int(np.count_nonzero(words[i + 1 :] < words[i])) for i in range(len(words)))


@case("T03", "Recovery from arbitrary disorder")
def t03(run: Run) -> None:
    n = 4000
    keys = np.arange(n)
    limit = -(-2 * n // C)
    for name, order in (("reversed", keys[::-1]), ("random", np.random.default_rng(0).permutation(n))):
        table = entries(order, order)
        # one of the two by the RTL: they take 32 frames each
        frames, camera = sequence(run if name == "reversed" else Run(run.settings), [table], [[]], keys, odd=False)
        counts = [_inversions(table)]
        while counts[-1] and len(counts) <= limit + 1:
            counts.append(_inversions(frames.frame(camera).order.tile(0)))
        run.at_most(f"{name}: frames until sorted", len(counts) - 1, limit)
        run.equal(f"{name}: frames in which the inversions grow", int((np.diff(counts) > 0).sum()), 0)


@case("T04", "Lost splat between two tests")
def t04(run: Run) -> None:
    for step, name in ((-0.0078125, "half a pixel"), (0.25, "and back")):
        frames = run.sequence(gaussians((0, 0, 2), scales=1e-9, opacities=0.0090))
        first = frames.frame(camera_a())
        run.equal(f"moved by {name}: values drawn in frame 0", int(np.count_nonzero(first.raster.value)), 0)
        if step > 0:
            frames.frame(camera_a(position=(step, step, 0)))
            frames.frame(camera_a())
        second = frames.frame(camera_a(position=(-0.0078125, -0.0078125, 0)))
        run.at_least(f"moved by {name}: LSB where the mean sits on a pixel", second.image[64, 64, 0] * 255, 2)
        run.equal(f"moved by {name}: lost", _lost(second), 0)


def _lost(frame) -> int:
    """Pairs of this frame that are not in its tables."""
    return sum(
        int((~np.isin(frame.pairs.index[at:end], indices_of(frame.order.tile(t)))).sum())
        for t, (at, end) in enumerate(zip(frame.pairs.tile_offsets, frame.pairs.tile_offsets[1:]))
    )


@case("T05", "Early stop starves the deferred depth update")
def t05(run: Run) -> None:
    rng = np.random.default_rng(5)
    back = crowd(6, 4000)
    wall = gaussians(rng.uniform(-0.3, 0.3, (60, 3)) + (0, 0, 0.8), scales=0.19, opacities=0.99, colours=0.5)
    closed = merge(back, wall)
    opened = merge(back, replace(wall, opacities=np.zeros(60)))
    both, alone = run.sequence(closed), Run(run.settings).sequence(opened)
    cameras = [camera_a(rotation=yaw(0.5 * (step - 20))) for step in range(41)]
    for camera in cameras[:-1]:
        hidden, seen = both.frame(camera), alone.frame(camera)
    run.at_least(
        "share of the pixels that the wall stops", (hidden.raster.transmittance < run.formats.t_stop).mean(), 0.2
    )
    both.renderer.gaussians = opened
    reveal, never = both.frame(cameras[-1]), alone.frame(cameras[-1])
    stale = sum(
        int(np.setxor1d(_of(hidden.written.tile(t), 4000), _of(seen.written.tile(t), 4000)).size) for t in range(4)
    )
    run.equal("behind the wall: keys or valid bits that differ from a scene without one", stale, 0)
    truth = oracle.render(reveal.projection, cameras[-1])
    exact = Renderer(opened, run.settings, "full").frame(cameras[-1])
    quality = metrics.compare(reveal.image, truth)
    run.at_least("reveal frame from the oracle, dB", quality["psnr_db"], 59)
    run.at_most("reveal frame: LSB at worst", quality["max_lsb"], 5)
    run.at_most("reveal frame: share of pixels above 1 LSB", quality["share_above_1_lsb"], 0.03)
    run.at_most("against a scene without a wall: share of pixels above 1 LSB apart", _apart(reveal, never), 0.001)
    run.count("sorted anew: share of pixels above 1 LSB", metrics.compare(exact.image, truth)["share_above_1_lsb"])


def _of(words: np.ndarray, n: int) -> np.ndarray:
    """The entries of Gaussians below n."""
    return words[indices_of(words) < n]


def _apart(a, b) -> float:
    """Share of the pixels of two frames that are more than 1 LSB apart."""
    return metrics.compare(a.image, b.image)["share_above_1_lsb"]


@case("T06", "Camera cut and scene swap")
def t06(run: Run) -> None:
    scene, other = crowd(7, 2000), crowd(77, 2000)
    away = camera_a(rotation=yaw(150), position=(0, 0, 8))
    cold = Run(run.settings).frame(scene, away)
    for name, cut in (("declared", True), ("undeclared", False)):
        frames = run.sequence(scene)
        for step in range(3):
            frames.frame(camera_a(rotation=yaw(step)))
        after = frames.frame(away, cut=cut)
        run.same(f"{name} cut against a cold start", after, cold)
        run.equal(f"{name} cut: entries that differ", int((after.order.words != cold.order.words).sum()), 0)
        run.equal(f"{name} cut: full_frames", after.counters["full_frames"], 1)
    swapped = run.sequence(other).frame(camera_a())
    run.equal("another scene: entries of its first frame that it did not list", swapped.table.words.size, 0)


@case("T07", "List longer than the buffer")
def t07(run: Run) -> None:
    capacity = C
    for n in (capacity + 1, 4 * capacity):
        depth = np.random.default_rng(9).permutation(n) * 0.001 + 2
        pile = gaussians(np.stack([-0.25 * depth, -0.25 * depth, depth], 1), scales=0.02, opacities=0.05, colours=0.8)
        scene = merge(pile, gaussians([(0.5, 0.5, 2), (0.52, 0.5, 2.1)], scales=0.02))
        frames = run.sequence(scene, capacity=capacity)
        frames.frame(camera_a())
        frame = frames.frame(camera_a())
        run.equal(f"{n} entries: overflow", frame.counters["overflow"], n - capacity)
        nearest = np.sort(np.argsort(depth, kind="stable")[:capacity])
        kept = np.sort(indices_of(frame.order.tile(0)))
        run.equal(f"{n} entries: kept ones that are not the nearest", int((~np.isin(kept, nearest)).sum()), 0)
        run.equal(f"{n} entries: length of the table", kept.size, capacity)
        roomy = Run(run.settings).frame(scene, camera_a())
        differ = np.count_nonzero(frame.raster.value[64:, 64:] != roomy.raster.value[64:, 64:])
        run.equal(f"{n} entries: values of the neighbour that differ", int(differ), 0)


@case("T08", "Exactly equal depths in real data")
def t08(run: Run) -> None:
    rng = np.random.default_rng(10)
    n = 83
    depth = np.where(np.arange(n) < 23, 3.0, rng.uniform(2, 4, n))
    means = np.stack([rng.uniform(-1, 1, n), rng.uniform(-1, 1, n), depth], 1)
    scene = gaussians(means, rng.uniform(0.3, 3, n), rng.uniform(0.2, 0.9, n), rng.random((n, 3)))
    frames = run.sequence(scene)
    cold = frames.frame(camera_a())
    for _ in range(3):
        warm = frames.frame(camera_a())
    run.same("warm frame against the cold one", warm, cold)
    # a file in another order, in which what is equally far keeps its order
    shuffle = rng.permutation(n)
    shuffle[np.isin(shuffle, np.arange(23))] = np.arange(23)
    mixed = replace(scene, **{k: getattr(scene, k)[shuffle] for k in ("means", "scales", "quats", "opacities", "sh")})
    run.same("shuffled rows, ties in their order", run.frame(mixed, camera_a()), cold)
    keys = cold.features.key
    orders = []
    for table in (valid(keys, np.arange(n)), entries(keys[shuffle], shuffle)):
        lists, camera = sequence(run, [table], [[]], keys, odd=False)
        orders.append(lists.frame(camera).order.words)
    run.equal("shuffled table: entries in another place", int((orders[0] != orders[1]).sum()), 0)
