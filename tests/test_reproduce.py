"""`splatcore reproduce`: every number comes from runs or from paper.py, runs are kept, and every figure is made."""

from __future__ import annotations

import argparse
import ast
import csv
import json
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from golden import cli, job
from golden.report import reproduce, sweep
from golden.report.reproduce import page, paper, plan, rows, runs, similarity
from golden.report.reproduce.figures import all_figures, measures, traffic
from golden.report.reproduce.plan import Case, Plan, Scene
from golden.report.reproduce.rows import COLUMNS, SUMMARY

ONE, TWO = "builtin:object?n=1500", "builtin:sparse?n=800"
SIZE = "96x64"
FULL = Plan((Scene("indoor", ONE), Scene("outdoor", TWO)), Scene("large", ONE), ("hd", "fhd", "qhd"), 4)


def command(folder: Path, *words: str) -> int:
    return cli.run(["reproduce", *words, "-o", str(folder), "--quick", "--sizes", SIZE, "--jobs", "1"])


class Made:
    """Runs of made-up numbers that differ from case to case; `slow` multiplies the cycles of one hardware."""

    def __init__(self, slow: str = "", factor: int = 1):
        self.slow, self.factor = slow, factor

    def __getitem__(self, case: Case) -> dict:
        rng = np.random.default_rng(zlib.crc32(repr((case.scene, case.size, case.hardware, case.keys)).encode()))
        if case.hardware == plan.LISTS:
            shares = {str(x): float(rng.uniform(50, 100)) for x in similarity.KEEPING}
            return {"keeping": shares, "moved": {**{str(p): 7 for p in similarity.PERCENTILES}, "largest": 40}}
        factor = self.factor if case.hardware == self.slow else 1
        frames = []
        for _ in range(case.frames):
            stages = {stage: int(rng.integers(10**6, 10**7)) * factor for stage in measures.STAGES}
            used = {s: {k: int(rng.integers(10**6, 10**8)) for k in ("read", "write")} for s in measures.STAGES}
            frames.append(
                {"cycles": sum(stages.values()), "stage_cycles": stages, "dram_bytes": used,
                 "entries": 1000, "counters": {"visible": 400},
                 "incoming": int(rng.integers(1, 500)), "psnr_db": float(rng.uniform(45, 80))}
            )  # fmt: skip
        ms = [frame["cycles"] / 1e6 for frame in frames[1:]]
        return {
            "fps": 1e3 / np.mean(ms), "p50_ms": np.percentile(ms, 50), "p99_ms": np.percentile(ms, 99),
            "frames": case.frames, "per_frame": frames,
        }  # fmt: skip


def test_every_figure_asks_for_the_runs_that_it_reads():
    class Asked(Made):
        def __getitem__(self, case):
            assert case in wanted, case
            return super().__getitem__(case)

    for figure in all_figures().values():
        wanted = set(figure.cases(FULL))
        assert figure.make(FULL, Asked())


def test_the_names_are_those_of_the_figures():
    assert tuple(all_figures()) == reproduce.NAMES == tuple(paper.WHY)


@pytest.mark.parametrize("claim", paper.CLAIMS, ids=lambda claim: f"{claim.figure} {claim.hardware} {claim.quantity}")
def test_every_number_of_the_paper_stands_beside_one_of_ours(claim):
    made = all_figures()[claim.figure].make(FULL, Made())
    key = claim.size, claim.hardware, claim.quantity
    found = [row for row in made if (row.size, row.hardware.partition(":")[0], row.quantity) == key and row.paper]
    assert len(found) == 1 and found[0].paper == claim.value
    assert found[0].ours is not None and found[0].ratio == found[0].ours / claim.value


def test_rows_follow_the_runs():
    fig15 = all_figures()["fig15"]
    before = {(r.scene, r.size, r.hardware, r.quantity): r.ours for r in fig15.make(FULL, Made())}
    for row in fig15.make(FULL, Made("neo", 2)):
        change = {paper.MS: 2, "speed-up over neo": 2}.get(row.quantity, 0.5)
        change = change if row.hardware == "neo" or row.quantity == "speed-up over neo" else 1
        was = before[row.scene, row.size, row.hardware, row.quantity]
        assert row.ours == pytest.approx(change * was)


def test_the_summary_is_what_fig15_and_table2_say():
    summary, fig15, table2 = (all_figures()[name].make(FULL, Made()) for name in ("summary", "fig15", "table2"))
    found = {(r.scene, r.hardware, r.quantity): r.ours for r in summary}
    for row in fig15:
        if (row.quantity == paper.FPS or (row.hardware == "splatcore" and row.quantity == "speed-up over neo")) and (
            row.size == "qhd"
        ):
            quantity = paper.FPS if row.quantity == paper.FPS else "fps over neo"
            assert found[row.scene, row.hardware, quantity] == row.ours
    worst = [row for row in table2 if row.quantity == "PSNR, dB, worst frame"]
    assert len(worst) == 6 and all(found[row.scene, row.hardware, row.quantity] == row.ours for row in worst)


@pytest.mark.parametrize("name", ["table3", "table4"])
def test_the_published_page_has_the_kept_areas_and_powers(name):
    figure = all_figures()[name]
    assert page.section(figure, figure.make(FULL, {})) in (plan.ROOT / "docs/reproduction.md").read_text()


def test_half_the_slices_are_half_the_area():
    found = {(r.hardware, r.quantity): r.ours for r in all_figures()["slices"].make(FULL, Made()) if r.scene in SUMMARY}
    for name in ("neo", "splatcore"):
        assert found[f"{name}, 2 slices", paper.AREA] == found[f"{name}, 4 slices", paper.AREA] / 2
    assert found["neo, 4 slices", "fps over neo of 4 slices"] == 1


def test_no_result_is_typed_in_outside_of_the_papers_own():
    theirs = {claim.value for claim in paper.CLAIMS if claim.value != int(claim.value)}
    for file in Path(reproduce.__file__).parent.rglob("*.py"):
        if file.name != "paper.py":
            numbers = {n.value for n in ast.walk(ast.parse(file.read_text())) if isinstance(n, ast.Constant)}
            assert not theirs & {value for value in numbers if isinstance(value, float)}, file.name


def test_traffic_of_sixty_frames_is_the_first_and_the_others_mean():
    def frame(n):
        return {"dram_bytes": {stage: {"read": n, "write": 0} for stage in measures.STAGES}}

    result = {"per_frame": [frame(10**9), frame(10**6), frame(3 * 10**6)]}
    assert measures.gigabytes(result) == pytest.approx(3 * (1 + 59 * 0.002))
    assert measures.gigabytes(result, ("raster",)) == pytest.approx(1 + 59 * 0.002)


def test_loss_at_the_papers_quality():
    assert measures.loss(44.3) == pytest.approx(0.1, abs=0.005)
    assert measures.loss(39.2) == pytest.approx(0.3, abs=0.02)
    assert 0 < measures.loss(90) < 1e-5


def test_software_neo_sorts_what_comes_and_passes_over_the_rest():
    pair = sum(traffic.gpu.frame(0, 0, 0, 1, 640, 360, 1).bytes["sorting"].values())
    used = {"preprocess": {"read": 5, "write": 0}, "sorting": {"read": 1000 * pair, "write": 0},
            "raster": {"read": 70, "write": 0}}  # fmt: skip
    frame = {"dram_bytes": used, "stage_cycles": dict.fromkeys(measures.STAGES, 10**6)}
    made = traffic.software(frame, {"incoming": 25, "entries": 100}, 640, 360)
    assert made["sorting"]["bytes"] == 0.25 * 1000 * pair + 1000 * 8 * 4
    assert made["raster"] == {"bytes": 70 + 8000, "seconds": 1e-3}
    assert made["preprocess"] == {"bytes": 5, "seconds": 1e-3}


def test_similarity_counts_as_plain_python_does():
    rng = np.random.default_rng(1)
    was, now = ([rng.permutation(50)[: rng.integers(0, 40)] for _ in range(6)] for _ in range(2))
    at = [np.concatenate(([0], np.cumsum([len(tile) for tile in lists]))) for lists in (was, now)]
    flat = [np.concatenate(lists).astype(np.int64) for lists in (was, now)]
    kept, moved = np.zeros(6, np.int64), np.zeros(len(flat[0]), np.int64)
    n = similarity.compare(at[0], flat[0], at[1], flat[1], kept, moved)
    expected = []
    for t, (old, new) in enumerate(zip(was, now)):
        old, new = [i for i in old if i in new], [i for i in new if i in old]
        assert kept[t] == len(old)
        expected += [abs(k - new.index(i)) for k, i in enumerate(old)]
    assert moved[:n].tolist() == expected


def test_a_camera_that_stands_still_keeps_everything():
    words = [ONE, "--size", SIZE, "--frames", "3", "--path", "static"]
    parser = argparse.ArgumentParser()
    job.add_common(parser)
    found = similarity.measure(job.prepare(parser.parse_args(words)))
    assert set(found["keeping"].values()) == {100.0}
    assert set(found["moved"].values()) == {0}


def test_a_table_is_read_as_it_was_written(tmp_path):
    made = all_figures()["fig18"].make(FULL, Made())
    rows.write(tmp_path / "fig18.csv", made)
    again = rows.read(tmp_path / "fig18.csv")
    assert again.figure == "fig18" and len(again) == len(made)
    for a, b in zip(again, made):
        assert (a.scene, a.size, a.hardware, a.quantity, a.paper) == (b.scene, b.size, b.hardware, b.quantity, b.paper)
        assert a.ours == pytest.approx(b.ours, rel=1e-5)


@pytest.fixture
def counted(monkeypatch):
    """Replaces measuring; the pictures of each call are noted, and the second call is interrupted."""
    calls = []

    def measure(pictures, spec, cases):
        calls.append(pictures)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return [Made()[case] for case in cases]

    monkeypatch.setattr(runs, "measure", measure)
    monkeypatch.setattr(sweep, "sources", lambda work: "made up")
    return calls


def test_an_interrupted_reproduction_goes_on_where_it_was(tmp_path, counted):
    with pytest.raises(KeyboardInterrupt):
        command(tmp_path, "fig6", "fig7", "--scenes", f"{ONE},{TWO}")
    kept = sorted((tmp_path / "runs").iterdir())
    assert len(kept) == 1 and not list(tmp_path.glob("*.csv"))
    command(tmp_path, "fig6", "fig7", "--scenes", f"{ONE},{TWO}")
    assert len(counted) == 3 and counted[2] == counted[1] != counted[0]
    assert (tmp_path / "fig6.csv").exists() and (tmp_path / "fig7.png").exists()
    command(tmp_path, "fig6", "fig7", "--scenes", f"{ONE},{TWO}")
    assert len(counted) == 3


def test_other_sources_measure_anew(tmp_path, monkeypatch):
    case = FULL.case("indoor", "hd", "neo")
    before = runs.Runs(FULL, tmp_path).of(case)
    assert before == runs.Runs(FULL, tmp_path).of(case)
    monkeypatch.setattr(sweep, "sources", lambda work: "other")
    assert runs.Runs(FULL, tmp_path).of(case) != before


def test_cases_of_the_same_frames_are_measured_together(tmp_path):
    kept = runs.Runs(FULL, tmp_path)
    plain, judged = FULL.case("indoor", "hd", "neo"), FULL.case("indoor", "hd", "neo", quality=True)
    other = FULL.case("indoor", "hd", "gscore", channels=8)
    ((_, cases),) = kept.missing([plain, judged, other])
    assert set(cases) == {judged, other}  # what is judged serves both
    kept.of(judged).write_text(json.dumps({"result": {"fps": 1}}))
    assert kept[plain] == kept[judged] == {"fps": 1}
    assert [cases for _, cases in kept.missing([plain, judged])] == []


def test_two_processes_measure_what_one_does(tmp_path):
    words = ["fig7", "--scenes", f"{ONE},{TWO}"]
    command(tmp_path / "one", *words)
    cli.run(["reproduce", *words, "-o", str(tmp_path / "two"), "--quick", "--sizes", SIZE, "--jobs", "2"])
    assert (tmp_path / "one/fig7.csv").read_bytes() == (tmp_path / "two/fig7.csv").read_bytes()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["fig15", "table5"], ["table5", "table4"]),
        (["fig99"], ["fig99", "fig15", "beyond"]),
        (["fig3", "--frames", "1"], ["--frames 1", "2 or more"]),
        (["fig3", "--sizes", "huge"], ["huge"]),
        (["fig3", "--scenes", "fox,fox"], ["fox,fox", "indoor"]),
        (["fig3", "--jobs", "-2"], ["-2"]),
        (["page"], ["-o", "no figure"]),
    ],
    ids=lambda value: " ".join(value),
)
def test_what_makes_no_sense_is_refused_in_one_line(capsys, tmp_path, monkeypatch, words, said):
    monkeypatch.setattr(sys, "argv", ["splatcore", "reproduce", *words, "-o", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    out, err = capsys.readouterr()
    assert stop.value.code == 2 and out == "" and err.count("\n") == 1
    assert all(word in err for word in said), err
    assert not (tmp_path / "out").exists()


def test_the_page_marks_what_is_the_papers(tmp_path):
    (tmp_path / "plan.json").write_text(json.dumps(FULL.describe()))
    for name, figure in all_figures().items():
        rows.write(tmp_path / f"{name}.csv", figure.make(FULL, Made()))
    text = page.text(tmp_path)
    for name, figure in all_figures().items():
        assert f"## {figure.title}" in text and paper.WHY[name] in text and f"`{name}.png`" in text
    assert "| paper | ours | ours / paper |" in text
    assert "| fps | mean | qhd | neo | 99.3 |" in text
    assert "| fps at motion x16 | mean | qhd | neo | > 60 |" in text
    assert "Section 6.2" in text


@pytest.mark.slow
def test_all_figures_of_a_tiny_scene(tmp_path):
    """Real runs: every table has numbers, every picture opens, and a second call changes nothing."""
    words = ["all", "page", "--scenes", ONE, "--page", str(tmp_path / "page.md")]
    command(tmp_path, *words)
    tables = {}
    for name in reproduce.NAMES:
        with open(tmp_path / f"{name}.csv", newline="") as file:
            lines = list(csv.DictReader(file))
        assert tuple(lines[0]) == COLUMNS and set(SUMMARY) & {line["scene"] for line in lines}
        for line in lines:
            # The paper has no picture of this size
            assert (line["paper"] == line["ratio"] == "") == (line["size"] != paper.NODE)
            assert line["ours"] != "" or "PSNR" in line["quantity"]
        with Image.open(tmp_path / f"{name}.png") as picture:
            picture.verify()
        tables[name] = lines
    assert all(float(line["ours"]) > 0 for line in tables["fig15"])
    assert (tmp_path / "page.md").read_text().count("\n## ") == len(reproduce.NAMES)
    before = {path: path.read_bytes() for path in tmp_path.glob("*.csv")}
    files = {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").iterdir()}
    command(tmp_path, *words)
    assert before == {path: path.read_bytes() for path in tmp_path.glob("*.csv")}
    assert files == {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").iterdir()}
    assert not list(tmp_path.rglob("*.part"))
