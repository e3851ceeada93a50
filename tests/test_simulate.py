"""`splatcore simulate`: the JSON, the settings, and that accelerators differ where they should."""

from __future__ import annotations

import json

import numpy as np
import pytest

from golden.cli import run
from golden.errors import InputError
from golden.settings import parse
from golden.timing import simulate
from golden.timing.hardware import HARDWARE, configure

SCENE = "builtin:room?n=8000"
FRAME_KEYS = {
    "cycles", "stage_cycles", "stall_cycles", "dram_bytes", "entries", "incoming", "outgoing", "pairs", "blends",
    "psnr_db", "max_lsb", "flips", "counters", "sha256",
}  # fmt: skip
TOP_KEYS = {
    "scene", "size", "frames", "hardware", "sorting", "effects", "set", "fps", "p50_ms", "p99_ms", "first_ms",
    "per_frame",
}  # fmt: skip


@pytest.fixture(scope="module")
def results() -> dict[str, dict]:
    """Every accelerator on three small frames."""
    configs = [(name, None, {}) for name in HARDWARE]
    return dict(zip(HARDWARE, simulate.compare(SCENE, "256x192", 3, configs, quality="oracle"), strict=True))


def total(result: dict) -> int:
    """Bytes of the last frame."""
    return sum(n for ways in result["per_frame"][-1]["dram_bytes"].values() for n in ways.values())


@pytest.mark.slow
@pytest.mark.parametrize("name", HARDWARE)
def test_json_has_every_field(results, name):
    result = results[name]
    assert set(result) >= TOP_KEYS
    assert json.loads(json.dumps(result, allow_nan=False)) == json.loads(json.dumps(result))
    assert result["hardware"] == name and len(result["per_frame"]) == 3
    for frame in result["per_frame"]:
        assert set(frame) == FRAME_KEYS
        assert frame["cycles"] > 0
        assert set(frame["dram_bytes"]) == {"preprocess", "sorting", "raster"}


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in HARDWARE if name != "gpu"])
def test_shares_are_shares(results, name):
    for share in results[name]["utilisation"].values():
        assert 0 <= share <= 1


@pytest.mark.slow
def test_accelerators_differ_where_they_should(results):
    assert total(results["splatcore"]) < total(results["neo"]) < total(results["neo-s"])
    assert total(results["neo"]) < total(results["gscore-64"]) < total(results["gscore"]) < total(results["gpu"])
    assert results["splatcore"]["fps"] > results["neo"]["fps"] > results["neo-s"]["fps"]
    pictures = {name: [frame["sha256"] for frame in result["per_frame"]] for name, result in results.items()}
    assert pictures["neo"] == pictures["neo-s"] and pictures["gscore"] == pictures["gpu"]
    assert pictures["neo"][0] == pictures["splatcore"][0] and pictures["neo"][2] != pictures["splatcore"][2]


@pytest.mark.slow
def test_late_sort_is_closer_to_the_truth(results):
    worst = {name: min(frame["psnr_db"] for frame in result["per_frame"]) for name, result in results.items()}
    assert worst["splatcore"] > worst["neo"] + 3


@pytest.mark.slow
@pytest.mark.parametrize("camera", ["0,0,0/0,100,0/0,0,1/60", "0,0,90/0,0,100/0,1,0/60"])
def test_a_picture_without_gaussians_is_no_trouble(tmp_path, camera):
    for name in HARDWARE:
        words = ["simulate", "builtin:object?n=50", f"--camera={camera}", "--size", "100x70", "--frames", "2"]
        assert run([*words, "--hardware", name, "--no-oracle", "--json", str(tmp_path / "a.json")]) == 0
        result = json.loads((tmp_path / "a.json").read_text())
        assert all(frame["cycles"] > 0 for frame in result["per_frame"])


@pytest.mark.slow
def test_a_cut_costs_one_frame_and_no_picture(tmp_path):
    words = [
        "simulate",
        SCENE,
        "--path",
        "cut",
        "--size",
        "256x192",
        "--frames",
        "6",
        "--json",
        str(tmp_path / "a.json"),
    ]
    assert run(words) == 0
    frames = json.loads((tmp_path / "a.json").read_text())["per_frame"]
    cut = [frame["counters"]["full_frames"] for frame in frames]
    assert cut.count(1) == 2 and cut[0] == 1
    assert min(frame["psnr_db"] for frame in frames) > 60


@pytest.mark.slow
def test_the_image_is_written_once(results):
    for name in ("neo", "splatcore", "gscore"):
        written = results[name]["per_frame"][-1]["dram_bytes"]["raster"]["write"]
        assert written >= 256 * 192 * 4


@pytest.mark.slow
@pytest.mark.parametrize("sorting", ["full", "hierarchical", "periodic:2", "background:1"])
def test_strategies_run_on_neo_and_cost_what_they_do(sorting):
    reuse, other = simulate.compare(SCENE, "256x192", 4, [("neo", None, {}), ("neo", sorting, {})])
    sorted_bytes = [sum(f["dram_bytes"]["sorting"]["read"] for f in r["per_frame"][1:]) for r in (reuse, other)]
    assert other["sorting"] == sorting
    if sorting.startswith("periodic"):
        assert other["per_frame"][1]["dram_bytes"]["sorting"]["read"] == 0
    elif sorting != "background:1":
        assert sorted_bytes[1] > sorted_bytes[0]


@pytest.mark.slow
def test_twice_is_the_same_and_more_bandwidth_is_not_slower():
    one, two, wide = simulate.compare(
        SCENE, "256x192", 2, [("neo", None, {}), ("neo", None, {}), ("neo", None, {"channels": "8"})]
    )
    assert one == two
    assert wide["fps"] > one["fps"]


@pytest.mark.slow
def test_the_command_writes_json_and_pictures(tmp_path, capsys):
    out = tmp_path / "out"
    words = ["simulate", SCENE, "--size", "192x128", "--frames", "2", "--no-oracle", "--set", "channels=8"]
    assert run([*words, "--json", str(tmp_path / "a.json"), "-o", str(out)]) == 0
    result = json.loads((tmp_path / "a.json").read_text())
    assert result == json.loads((out / "stats.json").read_text())
    assert result["set"]["channels"] == 8 and result["hardware"] == "splatcore"
    assert result["per_frame"][0]["psnr_db"] is None
    assert np.load(out / "frame_0001.npy").shape == (128, 192, 3)
    assert "frames a second" in capsys.readouterr().out


@pytest.mark.parametrize(
    "words",
    [
        ["--hardware", "neo2"],
        ["--set", "slices=0"],
        ["--set", "channels=3"],
        ["--set", "channels=0"],
        ["--hardware", "neo", "--set", "entry_bytes=5"],
        ["--set", "entry_bytes=17"],
        ["--set", "record_stride=20"],
        ["--set", "tile=48"],
        ["--set", "bandwidth=0"],
        ["--set", "raster=gpu"],
        ["--hardware", "neo", "--set", "tile=16"],
        ["--hardware", "gscore", "--set", "late_sort=1"],
        ["--hardware", "neo", "--set", "cache_kb=1", "--set", "slices=64", "--set", "cache_kb=8"],
        ["--sorting", "periodic:0"],
        ["--sorting", "background"],
        ["--hardware", "gscore", "--sorting", "reuse"],
        ["--json", "/nowhere/at/all.json"],
    ],
    ids=" ".join,
)
def test_bad_settings_are_refused(words):
    with pytest.raises(InputError, match=words[-1].partition("=")[0].split(":")[0]):
        run(["simulate", SCENE, *words])


def test_entries_and_records_follow_the_formats():
    def fit(name: str, keys: str, *given: str) -> list[str]:
        return simulate.fitted(name, list(given), parse([keys]))

    assert fit("neo", "setting=reference") == fit("splatcore", "sh_degree=2") == fit("gscore", "setting=small") == []
    assert fit("neo", "setting=small") == ["entry_bytes=5"] and fit("neo", "setting=wide") == ["entry_bytes=7"]
    assert fit("splatcore", "setting=wide") == fit("splatcore", "depth=predicted") == ["record_stride=32"]
    assert fit("neo", "setting=wide", "entry_bytes=8") == ["entry_bytes=8"]


@pytest.mark.slow
@pytest.mark.parametrize("given", [[], ["--set", "record_stride=40"]], ids=["none", "one"])
def test_a_setting_alone_is_enough(tmp_path, given):
    file = tmp_path / "a.json"
    words = ["simulate", "builtin:sparse?n=200", "--size", "64x64", "--frames", "1", "--no-oracle", "--hardware", "neo"]
    assert run([*words, "--json", str(file), "--set", "setting=wide", *given]) == 0
    made = json.loads(file.read_text())["set"]
    assert (made["entry_bytes"], made["record_stride"]) == (7, 40 if given else 32)


def test_descriptions_obey_their_own_rules():
    for name in HARDWARE:
        pairs = [f"{key}={int(v) if isinstance(v, bool) else v}" for key, v in HARDWARE[name].settings().items()]
        assert configure(name, pairs) == HARDWARE[name]
