"""Exported traces say what the frames hold, and a stopped export leaves nothing behind."""

import argparse
import io
import time
from pathlib import Path

import numpy as np
import pytest

from golden.errors import InputError
from golden.frame import Lists, Renderer
from golden.job import prepare
from golden.records import INVALID, indices_of, keys_of
from golden.timing import dram, traces
from tests.trace_readers import plain, read_dram, read_neo

WORDS = ["builtin:sparse?n=2000", "--size", "150x100", "--path", "shake", "--frames", "3"]


def arguments(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    traces.add_arguments(parser)
    return parser.parse_args([*WORDS, *words])


def export(path: Path, *words: str) -> Path:
    assert traces.export(arguments("-o", str(path), *words)) == 0
    assert list(path.parent.glob("*.part")) == []
    return path


@pytest.fixture(scope="module")
def frames():
    """The frames that the commands of this file export."""
    job = prepare(arguments("--trace", "neo"))
    renderer = Renderer(job.gaussians, job.settings)
    return [renderer.frame(camera) for camera in job.cameras]


def test_neo_holds_the_last_frame(tmp_path, frames):
    trace = read_neo(export(tmp_path / "poc.trace", "--trace", "neo"))
    frame = frames[-1]
    tiles = len(frame.order.offsets) - 1
    assert trace.head == {
        "width": 150,
        "height": 100,
        "tile_size": 64,
        "subtile_size": 8,
        "chunk_size": 256,
        "num_gaussians": 2000,
        "num_tiles": tiles,
    }
    assert trace.culled == (~frame.features.visible).tolist() and 0 < sum(trace.culled) < 2000
    tile_of = [set(indices_of(frame.incoming.tile(t)).tolist()) for t in range(tiles)]
    assert trace.incoming == [[t for t in range(tiles) if g in tile_of[t]] for g in range(2000)]
    assert sum(map(len, trace.incoming)) > 0
    for t, (table, counts) in enumerate(zip(trace.tables, trace.counts)):
        kept = frame.table.tile(t) < INVALID
        assert counts == (len(frame.incoming.tile(t)), np.count_nonzero(kept))
        assert [entry[0] for entry in table] == indices_of(frame.order.tile(t)).tolist()
        bitmaps = frame.raster.bitmaps[frame.order.offsets[t] : frame.order.offsets[t + 1]].tolist()
        assert [entry[1] for entry in table] == [[bits >> k & 1 for k in range(64)] for bits in bitmaps]
    assert any(sum(entry[1]) == 0 for table in trace.tables for entry in table)  # left the tile in this frame


@pytest.mark.parametrize("suffix", [".gz", ".xz"])
def test_a_name_says_how_it_is_packed(tmp_path, monkeypatch, suffix):
    text = export(tmp_path / "poc.trace", "--trace", "neo").read_bytes()
    packed = export(tmp_path / f"poc.trace{suffix}", "--trace", "neo")
    assert plain(packed) == text and packed.stat().st_size < len(text) / 10
    monkeypatch.setattr(time, "time", lambda: 1e9)
    again = export(tmp_path / f"again{suffix}", "--trace", "neo")
    assert again.read_bytes() == packed.read_bytes()


def test_tables_hold_every_list_of_every_frame(tmp_path, frames):
    data = np.load(export(tmp_path / "tables.npz", "--trace", "tables"), allow_pickle=False)
    assert data["frames"].tolist() == [0, 1, 2] and data["size"].tolist() == [150, 100]
    assert data["tiles"][:4].tolist() == [[0, 0], [64, 0], [128, 0], [0, 64]]
    for number, frame in enumerate(frames):
        for name in ("table", "incoming", "order", "written"):
            lists: Lists = getattr(frame, name)
            at = f"{number}/{name}/"
            assert np.array_equal(data[at + "offsets"], lists.offsets)
            assert np.array_equal(data[at + "index"], indices_of(lists.words))
            assert np.array_equal(data[at + "key"], keys_of(lists.words))
            assert np.array_equal(data[at + "invalid"], lists.words >= INVALID)
    assert np.array_equal(data["1/written/index"], data["2/table/index"])
    assert data["2/table/invalid"].any()
    assert len(data.files) == 3 + 3 * 4 * 4
    first = (tmp_path / "tables.npz").read_bytes()
    assert export(tmp_path / "again.npz", "--trace", "tables").read_bytes() == first


CYCLES = np.array([905, 900, 901, 900])
ADDRESSES = np.array([64, 1 << 33, 0, 4096])
WRITES = np.array([True, False, False, True])
SORTED = [(1 << 33, False, 0), (4096, True, 0), (0, False, 2), (64, True, 8)]  # 1600 MHz against 1 GHz


@pytest.mark.parametrize("form", traces.FORMATS)
def test_accesses_come_in_the_order_of_time(tmp_path, form):
    with traces.output(tmp_path / "accesses") as file:
        traces.write_dram(file, CYCLES, ADDRESSES, WRITES, form)
    accesses = read_dram(tmp_path / "accesses", form)
    assert accesses == (SORTED if form == "dramsim3" else [access[:2] for access in SORTED])


def test_the_accesses_look_as_the_simulators_want_them():
    text = {}
    for form in traces.FORMATS:
        file = io.BytesIO()
        traces.write_dram(file, CYCLES[:1], ADDRESSES[:1], WRITES[:1], form)
        text[form] = file.getvalue()
    assert text == {"dramsim3": b"0x40 WRITE 0\n", "ramulator": b"0x40 W\n", "ramulator2": b"ST 0x40\n"}


def test_no_access_is_a_file_without_lines():
    file = io.BytesIO()
    traces.write_dram(file, *np.zeros((2, 0), np.int64), np.zeros(0, bool), "dramsim3")
    assert file.getvalue() == b""


def test_many_accesses_keep_their_order():
    n = 3 * traces.BLOCK + 1
    file = io.BytesIO()
    traces.write_dram(file, np.arange(n) * 5, np.arange(n) * 64, np.arange(n) % 3 == 0, "dramsim3")
    rows = file.getvalue().decode().splitlines()
    assert rows == [f"0x{64 * k:x} {'READ' if k % 3 else 'WRITE'} {8 * k}" for k in range(n)]


@pytest.mark.slow
@pytest.mark.parametrize("machine", ["neo", "splatcore"])
def test_dram_holds_the_accesses_of_the_last_frame(tmp_path, machine):
    words = ("--trace", "dram", "--hardware", machine)
    accesses = read_dram(export(tmp_path / "frame.trace", *words), "dramsim3")
    one = read_dram(export(tmp_path / "one.trace", *words, "--format", "ramulator"), "ramulator")
    assert [access[:2] for access in accesses] == one
    clocks = [clock for _, _, clock in accesses]
    assert clocks[0] == 0 and clocks == sorted(clocks)
    assert all(address % dram.LINE == 0 for address, _, _ in accesses)
    assert 0.1 < np.mean([written for _, written, _ in accesses]) < 0.9


@pytest.mark.parametrize("name", ["poc.trace", "poc.trace.xz", "tables.npz"])
def test_an_interrupt_leaves_nothing(tmp_path, name):
    def stop(done: int, total: int) -> None:
        assert total == 3
        if done == 2:
            raise KeyboardInterrupt

    trace = "tables" if name.endswith("npz") else "neo"
    with pytest.raises(KeyboardInterrupt):
        traces.export(arguments("--trace", trace, "-o", str(tmp_path / name)), stop)
    assert list(tmp_path.iterdir()) == []


def test_a_finished_trace_outlives_a_broken_one(tmp_path):
    path = export(tmp_path / "poc.trace", "--trace", "neo")
    text = path.read_bytes()
    with pytest.raises(RuntimeError), traces.output(path) as file:
        file.write(b"half")
        raise RuntimeError
    assert path.read_bytes() == text and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    "words, message",
    [
        ([], "wants -o FILE"),
        (["-o", "."], "is a folder"),
        (["-o", "missing/poc.trace"], "cannot be written"),
        (["--trace", "tables", "-o", "tables.xz"], "ends in .npz"),
        (["--trace", "dram", "-o", "x", "--hardware", "gpu"], "wants an accelerator"),
        (["--trace", "dram", "-o", "x", "--hardware", "tpu"], "--hardware tpu"),
        (["-o", "x", "--set", "capacity=1"], "capacity"),
    ],
)
def test_bad_arguments_are_refused(tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=message):
        traces.export(arguments("--trace", "neo", *words))
    assert list(tmp_path.iterdir()) == []
