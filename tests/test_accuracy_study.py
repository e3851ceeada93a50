"""`splatcore accuracy`: what it varies, that it is the same wherever and how often it runs, and what is published."""

from __future__ import annotations

import json
import os
import random
import re
import shlex
from pathlib import Path

import pytest
from distributed import LocalCluster
from PIL import Image

from golden import cli
from golden.report import accuracy, sweep
from golden.report.accuracy import answer, area, measure, plan, rows, simulators
from golden.report.accuracy.plan import Choice, Knob

ROOT = Path(__file__).parent.parent
PUBLISHED = ROOT / "docs/accuracy/room"
TINY = ["builtin:sparse?n=500", "--size", "64x64", "--frames", "2", "--no-simulators"]
KEYS = {
    "key_bits", "key_kind", "entry_bytes", "depth", "passes", "chunk", "stop_threshold", "stop_rule", "refresh",
    "alpha_cut", "bound", "mean_bits", "footprint_bits", "opacity_bits", "colour_bits", "alpha_bits",
    "transmittance_bits", "accumulator_bits", "exp_segments", "exp_bits", "sh_degree", "slices", "channels", "cache_kb",
    "colour_every", "cut_share", "setting",
}  # fmt: skip


def command(folder: Path, *words: str, knobs: str = "depth,channels", jobs: str = "1") -> int:
    return cli.run(["accuracy", *TINY, "--knobs", knobs, "--jobs", jobs, "-o", str(folder), *words])


@pytest.fixture(scope="module")
def tiny(tmp_path_factory) -> Path:
    """The folder of a study of two knobs."""
    folder = tmp_path_factory.mktemp("tiny")
    assert command(folder, "--page", str(folder / "page")) == 0
    return folder


def test_every_knob_is_in_the_plan():
    varied = {pair.partition("=")[0] for knob in plan.KNOBS for choice in knob.choices for pair in choice.sets}
    assert varied == KEYS
    sortings = {choice.sorting for knob in plan.KNOBS for choice in knob.choices} - {None}
    assert {re.sub(r":\d+$", "", name) for name in sortings} == {
        "full", "hierarchical", "periodic", "background", "shuffled",
    }  # fmt: skip
    assert {choice.hardware for knob in plan.KNOBS for choice in knob.choices} == {None, "gscore", "gscore-64"}


def test_this_build_knows_every_knob():
    assert plan.points(plan.chosen(None))[1] == []


def test_what_a_build_does_not_know_is_reported_and_left_out():
    odd = Knob("odd", "order", (Choice("1", ("no_such_key=1",)), Choice("3", ("channels=3",)), Choice("ok")))
    points, left = plan.points([odd])
    assert [point.value for point in points] == ["ok", "ok"]
    assert left[0] == "odd 1: this build has no key no_such_key" and "channels=3" in left[1] and len(left) == 3


def test_a_knob_alone_leaves_the_rest_at_the_reference():
    points, _ = plan.points(plan.KNOBS)
    alone = [point for point in points if point.family not in ("ends", "keys")]
    for point in alone:
        assert point.sets or point.pairs or point.sorting or point.hardware != point.machine, point
        assert {pair.partition("=")[0] for pair in (*point.sets, *point.pairs)} <= {
            point.knob,
            "stop_rule",
            "stop_threshold",
            *(("entry_bytes", "record_stride") if point.family == "formats" else ()),
        }
    assert len({(point.machine, *map(str, point.words().values())) for point in points}) == len(points)


def test_tables_pictures_and_answer(tiny):
    table = rows.read(tiny / "accuracy.csv")
    assert tuple(table[0]) == rows.COLUMNS
    assert {row["knob"] for row in table} == {"reference", "end", "depth", "channels"}
    study = json.loads((tiny / "accuracy.json").read_text())
    assert len(study["points"]) == len(table) and study["left_out"] == []
    assert all(len(point["per_frame"]) == 2 for point in study["points"])
    for name in ("accuracy.png", "difference.png"):
        with Image.open(tiny / name) as picture:
            picture.verify()
    published = {path.name: path.read_bytes() for path in (tiny / "page").iterdir()}
    assert set(published) == {"accuracy.csv", "answer.md", "accuracy.png", "difference.png"}
    assert all(data == (tiny / name).read_bytes() for name, data in published.items())
    text = (tiny / "answer.md").read_text()
    assert "0.5 LSB, root mean square" in text and "| 60 dB |" in text and "0 differences" in text


def test_the_ends_of_the_scale(tiny):
    table = {row["value"]: row for row in rows.read(tiny / "accuracy.csv") if row["machine"] == "neo"}
    reference, again, exact, random_ = (table[name] for name in ("reference", "again", "exact", "random order"))
    assert {**again, "knob": "", "family": "", "value": ""} == {**reference, "knob": "", "family": "", "value": ""}
    assert exact["order_max_lsb"] == "0"
    assert float(exact["arithmetic_max_lsb"]) < float(reference["arithmetic_max_lsb"])
    assert float(random_["psnr_min_db"]) + 10 < float(reference["psnr_min_db"]) < float(exact["psnr_min_db"])


def test_a_second_study_has_the_same_table_and_measures_nothing(tiny, monkeypatch):
    before = (tiny / "accuracy.csv").read_bytes()
    monkeypatch.setattr(sweep, "_keep", lambda *task: pytest.fail("measured again"))
    command(tiny)
    assert (tiny / "accuracy.csv").read_bytes() == before


def test_an_interrupted_study_goes_on_where_it_was(tiny, tmp_path, monkeypatch, capsys):
    kept = sweep._keep
    calls = []

    def interrupted(task, results):
        if len(calls) == 2:
            raise KeyboardInterrupt
        calls.append(task)
        kept(task, results)

    monkeypatch.setattr(sweep, "_keep", interrupted)
    with pytest.raises(KeyboardInterrupt):
        command(tmp_path)
    done = {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").iterdir()}
    assert done and not (tmp_path / "accuracy.csv").exists()
    monkeypatch.setattr(sweep, "_keep", kept)
    command(tmp_path)
    assert all(path.stat().st_mtime_ns == time for path, time in done.items())
    assert (tmp_path / "accuracy.csv").read_bytes() == (tiny / "accuracy.csv").read_bytes()


@pytest.mark.slow
def test_a_cluster_and_local_processes_give_the_same_table(tiny, tmp_path):
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0", memory_limit=0) as cluster:
        command(tmp_path / "cluster", "--scheduler", cluster.scheduler_address)
    command(tmp_path / "two", jobs="2")
    for name in ("cluster", "two"):
        for file in ("accuracy.csv", "accuracy.json", "answer.md"):
            assert (tmp_path / name / file).read_bytes() == (tiny / file).read_bytes()


def test_a_worker_with_another_scene_is_refused():
    with pytest.raises(accuracy.InputError, match="another scene"):
        options = cli.parser().parse_args(["accuracy", *TINY, "-o", "x"])
        common = {name: getattr(options, name) for name in accuracy.COMMON}
        measure.measure(json.dumps(common), "0" * 64, (), [("neo", (), None)])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--frames", "1"], "--frames 1: wants 2 or more"),
        (["--sorting", "full"], "--sorting full"),
        (["--knobs", "depth,colour"], "--knobs colour: wants some of setting"),
        (["--set", "alpha_bats=3"], "alpha_bats"),
    ],
    ids=lambda value: " ".join(value),
)
def test_what_makes_no_sense_is_refused(tmp_path, words, said):
    with pytest.raises(accuracy.InputError, match=re.escape(said)):
        cli.run(["accuracy", *TINY, *words, "-o", str(tmp_path / "out")])
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_the_models_miss_what_they_say():
    args = cli.parser().parse_args(["accuracy", *TINY, "-o", "x"])
    table = simulators.rows(json.dumps({name: getattr(args, name) for name in accuracy.COMMON}))
    found = {row["model"]: row for row in table}
    assert list(found) == ["oracle", "golden", "timing", "rtl"]
    assert found["golden"]["misses"] == "against the RTL 0 differences; time"
    assert found["timing"]["misses"] == "against the RTL 0 differences, 0 cycles"
    assert all(float(row["seconds_a_frame"]) > 0 and 50 < float(row["peak_mb"]) < 4000 for row in table)


def made(**changes) -> dict:
    """A row with made-up numbers."""
    return {
        "knob": "depth",
        "family": "order",
        "value": "",
        "set": "",
        "ms_p50": 1.0,
        "mb": 1.0,
        "psnr_min_db": 50.0,
        **changes,
    }


def test_the_cheapest_is_the_fastest_that_meets_the_target():
    table = [made(ms_p50=3.0, psnr_min_db=70.0), made(ms_p50=2.0, psnr_min_db=61.0), made(ms_p50=1.0), made(mb=0.5)]
    assert rows.cheapest(table, lambda row: row["psnr_min_db"] >= 60) is table[1]
    assert rows.cheapest(table, lambda row: row["psnr_min_db"] >= 40) is table[3]
    assert rows.cheapest(table, lambda row: row["psnr_min_db"] >= 80) is None
    assert rows.front(table) == [table[2], table[1], table[0]]


def test_more_units_or_bandwidth_is_no_cheaper_setting():
    table = [
        made(knob="channels", family="machine", set="channels=16", ms_p50=0.1),
        made(knob="grid", family="grid", set="channels=8 depth=fresh", ms_p50=0.2),
        made(knob="grid", family="grid", set="channels=4 depth=fresh", ms_p50=0.9, max_lsb=3.0, percent_above_1_lsb=1),
        made(knob="end", family="ends", value="random order", ms_p50=0.1),
    ]  # fmt: skip
    assert dict(answer.targets(table))["40 dB"] is table[2]


def test_area_follows_the_formats_and_the_slices():
    small, wide = (area.mm2("neo", (f"setting={name}",)) for name in ("small", "wide"))
    reference = area.mm2("neo", ("depth=fresh", "channels=8"))
    assert 0 < small < reference < wide
    assert area.mm2("neo", ("slices=8",)) == pytest.approx(2 * reference)
    assert area.mm2("splatcore", ()) > reference  # the late sorter
    for hardware, word in (("neo", "alpha_bits=14"), ("splatcore", "chunk=512"), ("gscore", "depth=fresh")):
        assert rows.text(area.mm2(hardware, (word,))) == ""


def published_words() -> list[str]:
    """The command behind the published study, from the Makefile."""
    line = re.search(r"^STUDY\s*:=\s*(.*)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    return shlex.split(line[1])


def test_the_published_study_is_what_this_code_measures():
    """Three points of it, chosen by SEED, to the last digit."""
    args = cli.parser().parse_args(["accuracy", *published_words(), "-o", "x"])
    table = rows.read(PUBLISHED / "accuracy.csv")
    points = {(p.knob, p.value, p.machine): p for p in plan.points(plan.chosen(None))[0]}
    assert set(points) == {(row["knob"], row["value"], row["machine"]) for row in table}, "run `make accuracy`"
    common = json.dumps({name: getattr(args, name) for name in accuracy.COMMON})
    head = accuracy.head(args, measure.study(common))
    for row in random.Random(os.environ.get("SEED", "1")).sample(table, 3):
        point = points[row["knob"], row["value"], row["machine"]]
        (result,) = measure.measure(common, head["inputs_sha256"], point.sets, [point.config])
        ours = {key: rows.text(value) for key, value in rows.row(head, point, result).items()}
        assert ours == row, "run `make accuracy`"
