"""What fuzzing has found in the readers stays mended; every target runs, and finds what is planted."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest

from golden import cameras, scene
from golden.errors import InputError
from tests.fuzz import readers
from tests.scene_files import inria_columns, load_bytes, ply_bytes, refused, splat_bytes, truth

TARGETS = list(readers.TARGETS)


def test_a_packed_file_larger_than_its_zip_is_refused_before_a_buffer_is_made(tmp_path):
    data = bytearray(readers.sog()[0])
    entry = data.index(b"PK\x01\x02")
    data[entry + 20 : entry + 24] = struct.pack("<I", 0x54000000)
    (tmp_path / "a.sog").write_bytes(data)
    refused(tmp_path / "a.sog", "a.sog", str(0x54000000), f"{len(data)} bytes")


@pytest.mark.filterwarnings("error")
def test_a_signalling_nan_is_dropped_without_a_word(tmp_path):
    data = bytearray(splat_bytes(truth(0, 3)))
    data[0:4] = struct.pack("<I", 0x7FA00000)
    assert load_bytes(tmp_path, "a.splat", bytes(data)).counters["rejected_nonfinite"] == 1


@pytest.mark.parametrize("name", ["a" * 5000, "0_0/" + "b" * 300, "\ud800/meta.json"])
def test_a_name_that_no_file_can_have_is_refused(tmp_path, name):
    file = readers.place(readers.TARGETS["lod-meta"], tmp_path)
    top = json.loads(readers.streamed_meta()[0])
    top["filenames"][0] = name
    file.write_text(json.dumps(top))
    refused(file, "cannot be opened")


@pytest.mark.filterwarnings("error")
def test_positions_too_far_apart_for_a_view_ask_for_a_camera(tmp_path):
    columns = inria_columns(truth(0, 9))
    columns["x"][:5] = np.linspace(-1e300, 1e300, 5)
    g = load_bytes(tmp_path, "a.ply", ply_bytes(columns, kind="double"))
    with pytest.raises(InputError, match=r"1e\+300.*--camera"):
        cameras.default_view(g)


@pytest.mark.parametrize("name", TARGETS)
def test_seeds_are_read_and_broken_ones_refused(tmp_path, name):
    target = readers.TARGETS[name]
    file = readers.place(target, tmp_path)
    rng = np.random.default_rng(1)
    for data in target.seeds():
        assert len(data) <= readers.INPUT_BYTES
        file.write_bytes(data)
        target.read(str(file))
        for _ in range(10):
            broken = bytearray(data)
            broken[rng.integers(len(data))] ^= 1 << rng.integers(8)
            readers.check(target, file, bytes(broken))


@pytest.mark.parametrize("wrong", ["warning", "memory", "two lines", "error"])
def test_what_must_not_come_out_of_a_reader_is_noticed(tmp_path, wrong):
    def read(path: str) -> None:
        if wrong == "warning":
            np.array([np.inf]) - np.inf
        elif wrong == "error":
            raise KeyError("x")
        raise InputError("a\nb" if wrong == "two lines" else "a") from (MemoryError() if wrong == "memory" else None)

    with pytest.raises((RuntimeWarning, MemoryError, AssertionError, KeyError)):
        readers.check(readers.Target("a", list, read), tmp_path / "a", b"x")


def test_coverage_guides_and_counts(tmp_path):
    """Two seconds: inputs are made, coverage grows beyond that of the seeds."""
    pytest.importorskip("atheris", reason="atheris is not installed")
    counts = readers.run("spz", 2 / 60, 1, tmp_path)
    assert counts["executions"] > 100 and counts["findings"] == 0
    assert counts["coverage"] > counts["coverage at the start"] > 50


def test_each_place_that_fails_keeps_one_input(tmp_path, capsys):
    found = readers.Found(tmp_path)
    for data in (b"1", b"22", b"x"):
        try:
            scene.split_level(3) if data == b"x" else data["a"]
        except Exception as error:
            found.note(error, data)
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(":")[0] for line in lines] == [
        "FOUND TypeError at test_readers.py",
        "FOUND AttributeError at __init__.py",
    ]
    assert sorted(path.read_bytes() for path in tmp_path.iterdir()) == [b"1", b"x"]
