"""The command line as a contract: files it writes, errors it reports, interrupts it survives."""

from __future__ import annotations

import hashlib
import json
import signal
import subprocess
import sys
import time
from functools import partial

import numpy as np
import pytest
from PIL import Image

from golden import cli
from golden.errors import InputError

SMALL = ["builtin:sparse?n=2000", "--size", "96x64"]


def refused(capsys, *argv: str) -> str:
    """The one line on stderr of a refused command; nothing else may be printed."""
    with pytest.raises(SystemExit) as stop:
        sys.argv = ["splatcore", *argv]
        cli.main()
    out, err = capsys.readouterr()
    assert stop.value.code == 2
    assert out == ""
    assert err.endswith("\n") and err.count("\n") == 1
    return err


def test_render_writes_pictures_and_stats(tmp_path):
    assert cli.run(["render", *SMALL, "--frames", "2", "-o", str(tmp_path)]) == 0
    stats = json.loads((tmp_path / "stats.json").read_text())
    assert [*stats] and {"scene", "size", "frames", "hardware", "sorting", "effects", "set", "fps", "p50_ms"} <= set(
        stats
    )
    assert {"p99_ms", "first_ms", "per_frame"} <= set(stats)
    assert stats["frames"] == 2 and stats["size"] == [96, 64]
    for number, record in enumerate(stats["per_frame"]):
        image = np.load(tmp_path / f"frame_{number:04d}.npy")
        assert image.shape == (64, 96, 3) and image.dtype == np.float32
        assert hashlib.sha256(image.tobytes()).hexdigest() == record["sha256"]
        picture = np.asarray(Image.open(tmp_path / f"frame_{number:04d}.png"))
        assert np.abs(picture - np.clip(image, 0, 1) * 255).max() <= 0.51
        assert set(record["stage_cycles"]) == {"preprocess", "sorting", "raster"}
        assert set(record["dram_bytes"]["sorting"]) == {"read", "write"}
        assert record["cycles"] is None and record["psnr_db"] is None  # unknown is null, never 0
        assert record["entries"] > 0 and record["blends"] > 0
    assert not list(tmp_path.glob("*.part"))


def test_the_same_command_gives_the_same_bits(tmp_path):
    hashes = []
    for name, jobs in (("a", "1"), ("b", "2")):
        cli.run(["render", *SMALL, "--path", "shake", "--frames", "1:3", "--jobs", jobs, "-o", str(tmp_path / name)])
        stats = json.loads((tmp_path / name / "stats.json").read_text())
        hashes.append([record["sha256"] for record in stats["per_frame"]])
        assert (tmp_path / name / "frame_0002.png").exists()
    assert hashes[0] == hashes[1]


@pytest.mark.parametrize("form", [["--camera", "-1,0,-3/0,0,0/0,-1,0/50"], ["--camera=-1,0,-3/0,0,0/0,-1,0/50"]])
def test_camera_may_begin_with_a_minus(tmp_path, form):
    assert cli.run(["render", *SMALL, *form, "-o", str(tmp_path)]) == 0


def test_info_lists_scene_and_keys(capsys):
    assert cli.run(["info", "builtin:room?n=2000", "--keys"]) == 0
    text = capsys.readouterr().out
    assert "2,000" in text and "background" in text and "read_latency" in text


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["render", "no_such_file.ply", "-o", "x"], ["no_such_file.ply"]),
        (["render", "builtin:castle", "-o", "x"], ["castle", "room"]),
        (["render", "builtin:room?n=many", "-o", "x"], ["many"]),
        (["render", "builtin:room?n=0", "-o", "x"], ["0"]),
        (["render", *SMALL, "--size", "12by7", "-o", "x"], ["12by7"]),
        (["render", *SMALL[:1], "--size", "0x7", "-o", "x"], ["0x7"]),
        (["render", *SMALL, "--frames", "none", "-o", "x"], ["none"]),
        (["render", *SMALL, "--frames", "3:1", "-o", "x"], ["3:1"]),
        (["render", *SMALL, "--fps", "0", "-o", "x"], ["fps", "0"]),
        (["render", *SMALL, "--speed", "nan", "-o", "x"], ["speed", "nan"]),
        (["render", *SMALL, "--camera", "1,2,3", "-o", "x"], ["1,2,3"]),
        (["render", *SMALL, "--cameras", "missing.json", "-o", "x"], ["missing.json"]),
        (["render", *SMALL, "--set", "colour=red", "-o", "x"], ["colour=red", "background"]),
        (["render", *SMALL, "--set", "background=red", "-o", "x"], ["background=red", "0..1"]),
        (["render", *SMALL, "--set", "capacity=7", "-o", "x"], ["capacity=7", "256"]),
        (["render", *SMALL, "--set", "cut_share", "-o", "x"], ["cut_share"]),
        (["render", *SMALL, "--effects", "some", "-o", "x"], ["some"]),
        (["render", *SMALL, "--jobs", "-1", "-o", "x"], ["-1"]),
        (["render", *SMALL, "--path", "jump", "-o", "x"], ["jump", "orbit"]),
        (["render", *SMALL], ["-o DIR"]),
        (["paint", "x"], ["paint", "render"]),
        (["info"], ["SCENE"]),
    ],
    ids=lambda value: " ".join(value)[:40] if isinstance(value, list) else None,
)
def test_bad_input_is_one_line(capsys, tmp_path, monkeypatch, argv, words):
    monkeypatch.chdir(tmp_path)
    line = refused(capsys, *argv)
    assert all(word in line for word in words), line
    assert not list(tmp_path.iterdir())


def test_more_gaussians_than_an_entry_can_name(capsys, monkeypatch):
    monkeypatch.setattr("golden.params.INDEX_W", 10)
    assert "2000 Gaussians" in refused(capsys, "render", *SMALL, "-o", "x")


def test_output_that_is_a_file(capsys, tmp_path):
    (tmp_path / "out").write_text("mine")
    line = refused(capsys, "render", *SMALL, "-o", str(tmp_path / "out"))
    assert "is a file" in line
    assert (tmp_path / "out").read_text() == "mine"


def test_interrupt_keeps_finished_frames(tmp_path):
    command = [sys.executable, "-m", "golden.cli", "render", *SMALL, "--frames", "100000", "-o", str(tmp_path)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    # a shell's background jobs ignore SIGINT, and what they start inherits that
    listen = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    with subprocess.Popen(command, preexec_fn=listen, **pipes) as run:
        try:
            for _ in range(3):
                run.stdout.readline()
            run.send_signal(signal.SIGINT)
            begin = time.monotonic()
            _, err = run.communicate(timeout=60)
        finally:
            run.kill()
    assert time.monotonic() - begin < 30
    assert run.returncode == 130
    assert "Traceback" not in err and "interrupted" in err
    stats = json.loads((tmp_path / "stats.json").read_text())
    assert stats["frames"] >= 3
    assert len(list(tmp_path.glob("*.npy"))) in (stats["frames"], stats["frames"] + 1)


def test_input_errors_are_value_errors():
    assert issubclass(InputError, ValueError)
