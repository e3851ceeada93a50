"""`splatcore cosim`: RTL and golden model agree, and a difference anywhere stops it and is named."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from golden import cli
from golden.cosim import compare
from golden.errors import InputError
from golden.records import INVALID

pytestmark = pytest.mark.slow  # builds the RTL model: a minute where it is not there yet

RUN = ["cosim", "builtin:object?n=3000", "--size", "130x70", "--path", "shake", "--speed", "4"]


def test_rtl_equals_golden(tmp_path, capsys):
    assert cli.run([*RUN, "--frames", "3", "-o", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 4
    assert all(f"frame {number}:" in line and "mismatches 0" in line for number, line in enumerate(lines[:3]))
    assert "incoming" in lines[0] and "PSNR" in lines[0] and lines[3].startswith("0 differences in 3 frames")
    stats = json.loads((tmp_path / "stats.json").read_text())
    for record in stats["per_frame"]:
        assert record["cycles"] > 0 and record["psnr_db"] > 40
        assert record["stage_cycles"]["sorting"] < record["cycles"]
        assert record["dram_bytes"]["raster"]["write"] >= 130 * 70 * 4
    cli.run(["render", *RUN[1:], "--frames", "3", "-o", str(tmp_path / "golden")])
    golden = json.loads((tmp_path / "golden" / "stats.json").read_text())
    for ours, theirs in zip(stats["per_frame"], golden["per_frame"], strict=True):
        assert ours["sha256"] == theirs["sha256"]


@pytest.mark.parametrize("setting", ["small", "wide"])
def test_rtl_equals_golden_at_other_number_formats(setting, capsys):
    """Entries of 5 and 7 bytes, records of 24 and 32; tables, bitmaps, pixels and cycles."""
    assert cli.run([*RUN, "--frames", "3", "--set", f"setting={setting}"]) == 0
    assert "0 differences in 3 frames" in capsys.readouterr().out


def test_answers_that_are_late_at_random_change_cycles_only(tmp_path, capsys):
    runs = []
    for jitter in (0, 30, 600):
        folder = tmp_path / str(jitter)
        late = ["--set", f"answer_jitter={jitter}"]
        assert cli.run([*RUN, *late, "--frames", "2", "-o", str(folder)]) == 0
        assert "0 differences in 2 frames" in capsys.readouterr().out
        runs.append(json.loads((folder / "stats.json").read_text())["per_frame"])
    for records in zip(*runs, strict=True):
        assert len({record["cycles"] for record in records}) == 3
        assert len({record["sha256"] for record in records}) == 1


def test_render_by_rtl(tmp_path):
    with pytest.raises(InputError, match="-o DIR"):
        cli.run(["render", *RUN[1:], "--model", "rtl"])
    assert cli.run(["render", *RUN[1:], "--model", "rtl", "-o", str(tmp_path)]) == 0
    assert (tmp_path / "frame_0000.png").exists()


def changed(array: np.ndarray, k: int, mask: int) -> np.ndarray:
    """A copy with one bit pattern flipped in element k."""
    copy = array.copy()
    copy.reshape(-1)[k] ^= copy.dtype.type(mask)
    return copy


@pytest.mark.parametrize(
    ("field", "k", "mask", "words"),
    [
        ("words", 3, 1, ["sorting core, index", "entry 3", "tile 0"]),
        ("words", 4, 1 << 30, ["table written back", "entry 4"]),
        ("words", 4, INVALID, ["table written back", "entry 4"]),
        ("bitmaps", 5, 2, ["intersection test units", "entry 5"]),
        ("value", 7, 1, ["subtile compute units", "pixel (2, 0), green"]),
        ("rgb8", 8, 1, ["pixel resolver", "pixel (2, 0), blue"]),
        ("blends", 1, 1, ["blends", "tile 1"]),
        ("sorted", 2, 1, ["sorting cores, cycle", "tile 2"]),
        ("px_first", 1, 1, ["raster core, cycle", "first pixels", "tile 1"]),
        ("px_last", 0, 1, ["raster core, cycle", "last pixels", "tile 0"]),
        ("done", 3, 1, ["slice, cycle", "tile 3"]),
    ],
)
def test_any_difference_is_named(monkeypatch, capsys, field, k, mask, words):
    original = compare.Slice.frame

    def broken(self, *arguments):
        result = original(self, *arguments)
        return dataclasses.replace(result, **{field: changed(getattr(result, field), k, mask)})

    monkeypatch.setattr(compare.Slice, "frame", broken)
    assert cli.run([*RUN, "--frames", "2"]) == 1
    out, err = capsys.readouterr()
    assert err.count("\n") == 1 and all(word in err for word in words) and "RTL" in err and "golden" in err
    assert "mismatches 0" not in out and "frame 1" not in out
