"""Scene readers against files of every format, written by encoders of their own (tests/scene_files.py)."""

import gzip
import io
import json

import numpy as np
import pytest
from PIL import Image

from golden import scene
from tests.scene_files import (
    C0,
    N,
    compressed_bytes,
    inria_columns,
    load_bytes,
    ply_bytes,
    refused,
    sog_files,
    splat_bytes,
    spz_bytes,
    streamed,
    truth,
    webp,
    write_folder,
    zipped,
)


def same_rotation(a: np.ndarray, b: np.ndarray) -> float:
    """Largest angle (radians) between two lists of quaternions, norm and sign aside."""
    unit = [q / np.linalg.norm(q, axis=1, keepdims=True) for q in (a, b)]
    cross = np.minimum(np.linalg.norm(unit[0] - unit[1], axis=1), np.linalg.norm(unit[0] + unit[1], axis=1))
    return float(4 * np.arcsin(cross.max() / 2))


def smallest_three(step: float) -> float:
    """Largest angle when three parts of a unit quaternion are rounded to `step` and the largest, w >= 1/2, follows.

    The three are off by up to sqrt(3) * step / 2, w by up to sqrt(3) times that (|xyz| / w), and angles count twice.
    """
    return 2 * np.sqrt(1 + 3) * np.sqrt(3) * step / 2


def compare(
    g: scene.Gaussians, t: dict, mean: float, scale: float, angle: float, opacity: float, colour: float, rest=0.0
):
    """Largest differences, each below the step of its format; scale is a difference of logarithms."""
    assert len(g) == len(t["means"]) and not any(g.counters.values())
    assert [a.dtype for a in (g.means, g.scales, g.quats, g.opacities)] == [np.float64] * 4 and g.sh.dtype == np.float32
    assert g.sh.shape == t["sh"].shape
    assert np.abs(g.means - t["means"]).max() <= mean
    assert np.abs(np.log(g.scales / t["scales"])).max() <= scale
    assert same_rotation(g.quats, t["quats"]) <= angle
    assert np.abs(g.opacities - t["opacities"]).max() <= opacity
    assert np.abs(g.sh[:, 0] - t["sh"][:, 0]).max() <= colour
    assert np.abs(g.sh[:, 1:] - t["sh"][:, 1:]).max(initial=0) <= rest


# ---- what is written is read back


@pytest.mark.parametrize("degree", range(4))
@pytest.mark.parametrize("kind", ["float", "double"])
def test_inria_ply_reads_back(tmp_path, degree, kind):
    t = truth(degree)
    g = load_bytes(tmp_path, "a.ply", ply_bytes(inria_columns(t), kind))
    fine = 3e-7 if kind == "float" else 1e-14
    compare(g, t, fine, 3 * fine, 3 * fine, fine, 1e-7, 1e-7)
    assert g.name == "a" and g.source.endswith("a.ply") and not g.antialias


@pytest.mark.parametrize("order", ["<", ">", "a"])
def test_ply_byte_orders_and_text(tmp_path, order):
    t = truth(1)
    compare(
        load_bytes(tmp_path, "a.ply", ply_bytes(inria_columns(t), order=order)), t, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6
    )


def test_ply_column_order_and_extra_columns_do_not_matter(tmp_path):
    t = truth()
    columns = {"nx": np.zeros(N), **dict(reversed(inria_columns(t).items()))}
    compare(load_bytes(tmp_path, "a.ply", ply_bytes(columns)), t, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6)


def test_ply_double_keeps_far_positions_exactly(tmp_path):
    t = truth()
    t["means"] += (6378137, 4200000, 512)
    g = load_bytes(tmp_path, "a.ply", ply_bytes(inria_columns(t), "double"))
    assert np.array_equal(g.means, t["means"])
    (tmp_path / "b.ply").write_bytes(ply_bytes(inria_columns(t), "float"))
    refused(tmp_path / "b.ply", "b.ply", "double")


@pytest.mark.parametrize(
    "comments, wanted",
    [
        ((), False),
        (("SplatRenderMode: mip",), True),
        (("antialiased 1",), True),
        (("antialiased 1", "antialiased 0"), False),
    ],
)
def test_ply_antialias_comment(tmp_path, comments, wanted):
    assert load_bytes(tmp_path, "a.ply", ply_bytes(inria_columns(truth()), comments=comments)).antialias is wanted


@pytest.mark.parametrize("degree, boxed", [(0, True), (0, False), (1, True), (3, True)])
def test_compressed_ply_reads_back(tmp_path, degree, boxed):
    t = truth(degree)
    g = load_bytes(tmp_path, "a.compressed.ply", compressed_bytes(t, boxed, degree > 0))
    compare(g, t, 4 / 1023, 4 / 1023, smallest_three(np.sqrt(2) / 1023), 0.51 / 255, 0.51 / 255 / C0, 8 / 256)
    assert g.name == "a"


def test_splat_reads_back(tmp_path):
    t = truth()
    compare(load_bytes(tmp_path, "a.splat", splat_bytes(t)), t, 2e-7, 2e-7, 0.02, 0.51 / 255, 0.51 / 255 / C0)


@pytest.mark.parametrize("version, degree", [(1, 0), (2, 0), (2, 3), (3, 0), (3, 1), (3, 2), (3, 3)])
@pytest.mark.parametrize("packed", [True, False])
def test_spz_reads_back(tmp_path, version, degree, packed):
    t = truth(degree)
    if version < 3:  # the real part follows from the others: keep it away from zero, where it is lost
        t["quats"][:, 0] += 2 * np.sign(t["quats"][:, 0])
        t["quats"] /= np.linalg.norm(t["quats"], axis=1, keepdims=True)
    data = spz_bytes(t, version, flags=1)
    g = load_bytes(tmp_path, "a.spz", gzip.compress(data) if packed else data)
    angle = smallest_three(np.sqrt(0.5) / 511) if version == 3 else 0.03
    compare(
        g, t, 0.51 / 1024 if version == 1 else 0.51 / 4096, 0.51 / 16, angle, 0.51 / 255, 0.51 / 255 / 0.15, 0.51 / 128
    )
    assert g.antialias


def test_spz_of_degree_4_keeps_degree_3_and_counts(tmp_path):
    t = truth(4)
    g = load_bytes(tmp_path, "a.spz", gzip.compress(spz_bytes(t, 3)))
    assert g.sh.shape == (N, 16, 3) and g.counters["cut_to_sh3"] == N
    assert np.abs(g.sh - t["sh"][:, :16]).max() < 0.04


SOG_STEPS = dict(mean=2e-4, scale=4 / 255, angle=smallest_three(np.sqrt(2) / 255), colour=2 / 255, rest=2 / 255)


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("degree", range(4))
def test_sog_zip_and_folder_read_back(tmp_path, version, degree):
    t = truth(degree)
    files = sog_files(t, version, degree)
    folder = write_folder(tmp_path / "place", files)
    for spec in (folder, folder / "meta.json"):
        g = scene.load(str(spec))
        compare(g, t, **SOG_STEPS, opacity=0.01)
        assert g.name == "place"
    for inner in ("", "deep/"):
        other = load_bytes(tmp_path, "b.sog", zipped(files, inner))
        assert np.array_equal(other.means, g.means) and np.array_equal(other.sh, g.sh) and other.name == "b"


def test_sog_null_in_front_of_a_code_book_continues_it(tmp_path):
    t = truth()
    files = sog_files(t)
    meta = json.loads(files["meta.json"])
    meta["scales"]["codebook"][0] = None
    compare(
        load_bytes(tmp_path, "a.sog", zipped(files | {"meta.json": json.dumps(meta).encode()})),
        t,
        **SOG_STEPS,
        opacity=0.01,
    )


def test_streamed_levels_are_concatenated_in_order(tmp_path):
    a, b, c, sky = truth(1, 40, 1), truth(0, 30, 2), truth(0, 20, 3), truth(0, 10, 4)
    streamed(tmp_path / "s", {0: [a, b], 1: [c]}, sky)
    g = scene.load(str(tmp_path / "s"))
    assert np.abs(g.means - np.concatenate([t["means"] for t in (a, b, sky)])).max() < 2e-4
    assert g.sh.shape == (80, 4, 3) and not g.sh[40:, 1:].any() and g.name == "s"
    for spec in (f"{tmp_path}/s@lod=1", f"{tmp_path}/s/lod-meta.json@lod=1"):
        assert len(scene.load(spec)) == 30
    refused(f"{tmp_path}/s@lod=2", "@lod=2", "0 to 1")
    refused(f"{tmp_path}/s@lod=x", "@lod=x")
    refused(f"{tmp_path}/s/0_0@lod=1", "one level")


def test_streamed_levels_left_out_are_only_missed_when_asked(tmp_path):
    streamed(tmp_path / "s", {0: [truth(0, 40)], 1: [truth(0, 20)]})
    (tmp_path / "s" / "1_0").rename(tmp_path / "gone")
    assert len(scene.load(f"{tmp_path}/s")) == 40
    refused(f"{tmp_path}/s@lod=1", "1_0")


def test_streamed_count_that_the_chunk_does_not_hold(tmp_path):
    streamed(tmp_path / "s", {0: [truth(0, 40)]})
    meta = tmp_path / "s" / "lod-meta.json"
    meta.write_text(meta.read_text().replace('"count": 40', '"count": 41'))
    refused(tmp_path / "s", "41", "40", "0_0/meta.json")


# ---- rows that cannot be drawn


def test_rows_that_are_not_finite_are_dropped_and_counted(tmp_path):
    columns = {k: v[:7].copy() for k, v in inria_columns(truth()).items()}
    columns["x"][0] = np.nan
    columns["scale_1"][1] = np.inf
    columns["scale_2"][6] = -np.inf
    columns["opacity"][2:5] = np.inf, -np.inf, np.nan
    g = load_bytes(tmp_path, "a.ply", ply_bytes(columns))
    assert g.counters["rejected_nonfinite"] == 4 and len(g) == 3
    assert g.opacities[0] == 1 and g.opacities[1] == 0 and 0 < g.opacities[2] < 1
    assert np.allclose(g.means[:, 0], columns["x"][[2, 3, 5]])


def test_zero_rows_are_dropped_and_counted(tmp_path):
    columns = {k: np.concatenate([v[:1], np.zeros(4095)]) for k, v in inria_columns(truth()).items()}
    g = load_bytes(tmp_path, "a.ply", ply_bytes(columns))
    assert len(g) == 1 and g.counters == {"rejected_nonfinite": 0, "rejected_scale": 0, "rejected_quat": 4095}


def test_sog_rotation_without_a_largest_part_is_dropped(tmp_path):
    files = sog_files(truth(n=4))
    pixels = np.array(Image.open(io.BytesIO(files["quats.webp"])))
    pixels[0, 2, 3] = 17  # not 252 to 255
    g = load_bytes(tmp_path, "a.sog", zipped(files | {"quats.webp": webp(pixels)}))
    assert len(g) == 3 and g.counters["rejected_quat"] == 1


def test_unnormalised_quaternions_stay_as_stored(tmp_path):
    t = truth(n=5)
    t["quats"] = t["quats"] * np.array([1, -1, 1e3, 1e-3, 1e-18])[:, None]
    g = load_bytes(tmp_path, "a.ply", ply_bytes(inria_columns(t)))
    assert len(g) == 5 and np.allclose(g.quats, t["quats"], rtol=1e-6, atol=0)


def test_a_scene_of_no_rows_is_empty_not_wrong(tmp_path):
    columns = {k: v[:0] for k, v in inria_columns(truth()).items()}
    for order in "<a":
        assert len(load_bytes(tmp_path, "a.ply", ply_bytes(columns, order=order))) == 0
    assert len(load_bytes(tmp_path, "a.spz", gzip.compress(spz_bytes(truth(n=0), 3)))) == 0
