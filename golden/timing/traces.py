"""`splatcore export`: a frame as others replay it, and the tables of every frame (docs/traces.md).

neo     the trace that the public simulator of Neo reads: who is incoming where, who covers which subtiles
dram    every 64-byte access of a frame, for Ramulator 1, Ramulator 2 or DRAMsim3
tables  the tables of every frame before and behind each step, as plain arrays
"""

from __future__ import annotations

import argparse
import gzip
import lzma
import os
import sys
import zipfile
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np

from golden import params, settings
from golden.errors import InputError
from golden.frame import Frame, Lists, Renderer, tiles_of
from golden.job import Job, add_common, prepare
from golden.records import INVALID, indices_of, keys_of
from golden.timing import dram

TRACES = ("neo", "dram", "tables")
FORMATS = ("dramsim3", "ramulator", "ramulator2")
PACKED = (".gz", ".xz")
BLOCK = 1 << 14  # lines that are made into text at once
ARTIFACT_ROOM = 8198  # entries that a tile's table has room for in the paper's artifact
ACCESSES = 1 << 24  # of a frame, at most

OnFrame = Callable[[int, int], None]  # (frames done, frames)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `splatcore export`; -o names a file."""
    add_common(parser)
    parser.add_argument("--trace", choices=TRACES, required=True, help="what to write")
    parser.add_argument("--format", choices=FORMATS, default=FORMATS[0], help="of --trace dram (default: %(default)s)")
    parser.add_argument("--hardware", default="neo", help="of --trace dram (default: %(default)s)")


@contextmanager
def output(path: Path) -> Iterator[BinaryIO]:
    """A stream into `path`, packed on the way when it ends in .gz or .xz. The name appears when all is written."""
    if path.is_dir():
        raise InputError(f"-o {path}: is a folder; wants the name of a file")
    part = path.with_name(path.name + ".part")
    try:
        with open(part, "wb") as plain:
            if path.suffix == ".gz":
                with gzip.GzipFile("", "wb", 6, plain, mtime=0) as stream:
                    yield stream
            elif path.suffix == ".xz":
                with lzma.open(plain, "wb", preset=1) as stream:
                    yield stream
            else:
                yield plain
        os.replace(part, path)
    except OSError as error:
        raise InputError(f"-o {path}: cannot be written ({error.strerror})") from None
    finally:
        part.unlink(missing_ok=True)


def _by_gaussian(lists: Lists, count: int) -> tuple[np.ndarray, np.ndarray]:
    """(offsets int64[count + 1], tiles int64[E]): the tiles whose list holds a Gaussian, ascending."""
    index = indices_of(lists.words)
    tile = np.repeat(np.arange(len(lists.offsets) - 1), np.diff(lists.offsets))
    offsets = np.concatenate(([0], np.cumsum(np.bincount(index, minlength=count))))
    return offsets, tile[np.argsort(index, kind="stable")]


def _table_text(index: np.ndarray, bitmaps: np.ndarray) -> bytes:
    """A line an entry: Gaussian and SUBTILES bits, row-major, blanks between. index int64[n], bitmaps uint64[n]."""
    digits = len(str(1 << params.INDEX_W))
    text = np.full((len(index), digits + 2 * params.SUBTILES + 1), ord(" "), np.uint8)
    for place in range(digits):
        power = 10**place
        shown = (index >= power) | (place == 0)
        text[shown, digits - 1 - place] = ord("0") + index[shown] // power % 10
    bits = np.unpackbits(bitmaps.astype("<u8").view(np.uint8), bitorder="little").reshape(-1, params.SUBTILES)
    text[:, digits + 1 : -1 : 2] = ord("0") + bits
    text[:, -1] = ord("\n")
    return text.tobytes()


def write_neo(file: BinaryIO, frame: Frame) -> None:
    """One frame as the artifact's poc.trace. Tiles row-major; reused: entries of the last frame's table that stay."""
    count = len(frame.features.visible)
    tiles = len(frame.order.offsets) - 1
    camera = frame.camera
    head = (camera.width, camera.height, params.TILE, params.SUBTILE, params.CHUNK, count, tiles)
    file.write((" ".join(map(str, head)) + "\n").encode())
    offsets, tile = _by_gaussian(frame.incoming, count)
    for begin in range(0, count, BLOCK):
        end = min(begin + BLOCK, count)
        culled = (~frame.features.visible[begin:end]).astype(int).tolist()
        at = offsets[begin : end + 1].tolist()
        names = list(map(str, tile[at[0] : at[-1]].tolist()))
        rows = (
            " ".join([str(culled[k]), str(at[k + 1] - at[k]), *names[at[k] - at[0] : at[k + 1] - at[0]]])
            for k in range(end - begin)
        )
        file.write(("\n".join(rows) + "\n").encode())
    incoming, entries = np.diff(frame.incoming.offsets).tolist(), np.diff(frame.order.offsets).tolist()
    for t in range(tiles):
        file.write(f"{incoming[t]} {entries[t] - incoming[t]} {entries[t]}\n".encode())
        part = slice(frame.order.offsets[t], frame.order.offsets[t + 1])
        file.write(_table_text(indices_of(frame.order.words[part]), frame.raster.bitmaps[part]))


def write_dram(file: BinaryIO, cycles: np.ndarray, addresses: np.ndarray, writes: np.ndarray, form: str) -> None:
    """Accesses in the order of time. cycles int64[n] of the core, addresses int64[n] in bytes, writes bool[n].

    The times of DRAMsim3 are DRAM clocks, counted from the first access.
    """
    order = np.argsort(cycles, kind="stable")
    clocks = -(-(cycles[order] - cycles.min(initial=1 << 60)) * dram.CORE_TICKS // dram.DRAM_TICKS)
    for begin in range(0, len(order), BLOCK):
        part = order[begin : begin + BLOCK]
        rows = zip(addresses[part].tolist(), writes[part].tolist(), clocks[begin : begin + BLOCK].tolist())
        if form == "dramsim3":
            text = "".join([f"0x{a:x} {'WRITE' if w else 'READ'} {c}\n" for a, w, c in rows])
        elif form == "ramulator":
            text = "".join([f"0x{a:x} {'W' if w else 'R'}\n" for a, w, _ in rows])
        else:
            text = "".join([f"{'ST' if w else 'LD'} 0x{a:x}\n" for a, w, _ in rows])
        file.write(text.encode())


def _put(archive: zipfile.ZipFile, name: str, array: np.ndarray) -> None:
    info = zipfile.ZipInfo(f"{name}.npy")  # its date is 1980: the same tables give the same file
    info.compress_type = zipfile.ZIP_DEFLATED
    with archive.open(info, "w", force_zip64=True) as member:
        np.lib.format.write_array(member, np.ascontiguousarray(array), allow_pickle=False)


def write_tables(file: BinaryIO, width: int, height: int, numbered: Iterable[tuple[int, Frame]]) -> None:
    """Frames as one .npz, frame by frame: the table as read, what came, the table as drawn and as written back."""
    numbers = []
    with zipfile.ZipFile(file, "w") as archive:
        _put(archive, "size", np.array([width, height], np.int64))
        _put(archive, "tiles", tiles_of(width, height))
        for number, frame in numbered:
            numbers.append(number)
            lists = {"table": frame.table, "incoming": frame.incoming, "order": frame.order, "written": frame.written}
            for name, entries in lists.items():
                _put(archive, f"{number}/{name}/offsets", entries.offsets)
                _put(archive, f"{number}/{name}/index", indices_of(entries.words).astype(np.uint32))
                _put(archive, f"{number}/{name}/key", keys_of(entries.words).astype(np.uint32))
                _put(archive, f"{number}/{name}/invalid", (entries.words & INVALID) != 0)
        _put(archive, "frames", np.array(numbers, np.int64))


def frames(job: Job, sorting: str, late: bool, on_frame: OnFrame | None) -> Iterator[tuple[int, Frame]]:
    """(number, Frame) of every frame of a job by the golden model."""
    renderer = Renderer(job.gaussians, job.settings, sorting, late)
    for index, number in enumerate(job.frames):
        yield number, renderer.frame(job.cameras[index])
        if on_frame:
            on_frame(index + 1, len(job.frames))


def _dram(file: BinaryIO, job: Job, machine, sorting: str, form: str, on_frame: OnFrame | None) -> None:
    """The accesses of the last frame, by the frame simulator."""
    from golden.timing import simulate

    run = simulate.Run(job, machine, simulate.strategy(machine, sorting))
    memory = run.accelerator.memory
    last = job.frames[-1]
    for number, frame in frames(job, run.sorting, bool(machine.late_sort), on_frame):
        if number == last and not machine.preprocess_ahead:
            run.accelerator.memory = memory._replace(dram=dram.recording(memory.dram, ACCESSES))
        run.add(frame, None)
    if machine.preprocess_ahead:
        run.accelerator.memory = memory._replace(dram=dram.recording(memory.dram, ACCESSES))
    run.finish()
    try:
        log = dram.recorded(run.accelerator.memory.dram)
    except ValueError as error:
        raise InputError(f"--trace dram: {error}; wants a smaller scene or picture") from None
    write_dram(file, log[:, dram.LOG_CYCLE], log[:, dram.LOG_LINE] * dram.LINE, log[:, dram.LOG_WRITE] != 0, form)


def export(args: argparse.Namespace, on_frame: OnFrame | None = None) -> int:
    """`splatcore export`: write the trace that args.trace names to args.out."""
    if args.out is None:
        raise InputError("export: wants -o FILE for its trace")
    path = Path(args.out)
    if args.trace == "tables" and path.suffix in PACKED:
        raise InputError(f"-o {path}: tables are packed already; wants a name that ends in .npz")
    machine = None
    if args.trace == "dram":
        from golden.timing import hardware, simulate

        mine, keys = simulate.split_settings(args.set)
        args = argparse.Namespace(**{**vars(args), "set": mine})
        machine = hardware.configure(args.hardware, simulate.fitted(args.hardware, keys, settings.parse(mine)))
        if machine.raster == "gpu":
            raise InputError(f"--hardware {args.hardware}: has no accesses of its own; wants an accelerator")
    with output(path) as file:
        job = prepare(args)
        if args.trace == "dram":
            _dram(file, job, machine, args.sorting, args.format, on_frame)
        elif args.trace == "tables":
            write_tables(file, job.cameras[0].width, job.cameras[0].height, frames(job, args.sorting, False, on_frame))
        else:
            ((_, frame),) = deque(frames(job, args.sorting, False, on_frame), maxlen=1)
            write_neo(file, frame)
            longest = int(np.diff(frame.order.offsets).max(initial=0))
            if longest > ARTIFACT_ROOM:
                print(f"a table has {longest} entries; the artifact's have room for {ARTIFACT_ROOM}", file=sys.stderr)
    return 0
