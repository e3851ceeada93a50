"""Any bytes end in Gaussians, in cameras or in an InputError of one line: one target for each reader.

`python -m tests.fuzz.readers TARGET FOLDER SECONDS SEED` is libFuzzer's loop over one of them (atheris); `run`
starts it in a process with bounded memory and reads its counts. FOLDER holds the corpus and what was found.
"""

from __future__ import annotations

import gzip
import hashlib
import json
import re
import resource
import subprocess
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

INPUT_BYTES = 1 << 15  # longest input: the seeds have up to 18 KB
MEMORY = 512 << 20  # bytes that a reader of so few may take beyond what the interpreter has
SECONDS = 10  # for one input


@dataclass(frozen=True)
class Target:
    file: str  # the name under which the reader gets the bytes
    seeds: Callable[[], list[bytes]]
    read: Callable[[str], None]  # of the file, or of the folder that holds it
    beside: Callable[[], dict[str, bytes]] = dict  # files of the same folder, those of a subfolder as "a/b"


def scene_at(spec: str) -> None:
    """A scene is finite, and what the command line derives from it is a camera or an InputError."""
    from golden import cameras, scene

    g = scene.load(spec)
    assert all(np.isfinite(a).all() for a in (g.means, g.scales, g.quats, g.opacities, g.sh)), "not finite"
    assert (g.scales >= 0).all() and (np.abs(g.quats).max(axis=1, initial=0) > 0).all(), "no ellipsoid"
    assert ((g.opacities >= 0) & (g.opacities <= 1)).all(), "opacity outside of 0..1"
    assert all(count >= 0 for count in g.counters.values()), "negative counter"
    finite_camera(cameras.look_at(*cameras.default_view(g), 64, 48))


def cameras_at(path: str) -> None:
    """Cameras are finite with orthonormal axes, at any rate, and can be placed in a scene."""
    from golden import cameras

    start = cameras.look_at((1, -2, -4), (0, 0, 0), (0, -1, 0), 60, 64, 48)
    for fps, speed in ((30, 1), (1000, 0.5)):
        track = cameras.read(path, 64, 48, range(3), fps, speed)
        relative = cameras.kind_of(path) in cameras.RELATIVE
        for camera in cameras.place(track, start, 2.0) if relative else track:
            finite_camera(camera)


def finite_camera(camera) -> None:
    lens = camera.fx, camera.fy, camera.cx, camera.cy
    assert np.isfinite([*lens, *camera.position]).all() and min(camera.fx, camera.fy) > 0, "no lens or place"
    assert np.abs(camera.rotation @ camera.rotation.T - np.eye(3)).max() < 1e-6, "no rotation"


def ply() -> list[bytes]:
    from tests.scene_files import compressed_bytes, inria_columns, ply_bytes, truth

    few, more = truth(0, 5), truth(1, 3)
    inria = [ply_bytes(inria_columns(few), order=order, kind=kind) for order, kind in
             (("<", "float"), (">", "double"), ("a", "float"))]  # fmt: skip
    packed = [compressed_bytes(t, boxed, rest) for t, boxed, rest in ((few, True, False), (more, False, True))]
    return [*inria, ply_bytes(inria_columns(more), comments=["SplatRenderMode: mip"]), *packed]


def splat() -> list[bytes]:
    from tests.scene_files import splat_bytes, truth

    return [splat_bytes(truth(0, n)) for n in (1, 4)]


def spz() -> list[bytes]:
    from tests.scene_files import spz_bytes, truth

    plain = [spz_bytes(truth(degree, 4), version) for version in (1, 2, 3) for degree in (0, 1)]
    return [*plain, *map(gzip.compress, plain)]


def sog() -> list[bytes]:
    from tests.scene_files import sog_files, truth, zipped

    return [zipped(sog_files(truth(1, 4), 2, 1)), zipped(sog_files(truth(0, 4), 1), "a/")]


def sog_folder() -> dict[str, bytes]:
    from tests.scene_files import sog_files, truth

    return sog_files(truth(1, 40), 2, 1)


def sog_meta() -> list[bytes]:
    from tests.scene_files import sog_files, truth

    return [sog_files(truth(1, 40), version, degree)["meta.json"] for version in (1, 2) for degree in (0, 1)]


def streamed_folder() -> dict[str, bytes]:
    from tests.scene_files import sog_files, truth

    return {f"0_{k}/{name}": data for k in (0, 1) for name, data in sog_files(truth(0, 6 + k)).items()}


def streamed_meta() -> list[bytes]:
    leaves = [{"bound": {}, "lods": {"0": dict(file=k, offset=0, count=6 + k)}} for k in (0, 1)]
    top = dict(lodLevels=1, environment=None, filenames=["0_0/meta.json", "0_1/meta.json"], tree={"children": leaves})
    return [json.dumps(top | extra).encode() for extra in ({}, dict(environment="0_1/meta.json", version=1))]


def camera_files() -> list[bytes]:
    from tests import test_camera_readers as files
    from tests.camera_tools import random_cameras

    path = random_cameras(3)
    made = [encode(path) for encode in (files.nerfstudio, files.inria, files.tum, files.record3d)]
    blender = dict(camera_angle_x=0.7, frames=made[0]["frames"])
    return [(text if isinstance(text, str) else json.dumps(text)).encode() for text in (*made, blender)]


TARGETS = {
    "ply": Target("a.ply", ply, scene_at),
    "splat": Target("a.splat", splat, scene_at),
    "spz": Target("a.spz", spz, scene_at),
    "sog": Target("a.sog", sog, scene_at),
    "sog-meta": Target("meta.json", sog_meta, scene_at, sog_folder),
    "sog-image": Target("sh0.webp", lambda: [sog_folder()["sh0.webp"]], lambda file: scene_at(str(Path(file).parent)),
                        sog_folder),
    "lod-meta": Target("lod-meta.json", streamed_meta, scene_at, streamed_folder),
    "cameras": Target("cameras.any", camera_files, cameras_at),
}  # fmt: skip


def place(target: Target, folder: Path) -> Path:
    """Where the bytes go, with the files beside them written."""
    for name, data in target.beside().items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(data)
    return folder / target.file


def check(target: Target, file: Path, data: bytes) -> None:
    """One input; raises what must not come out: a warning counts, and so does an InputError for lack of memory."""
    from golden.errors import InputError

    file.write_bytes(data)
    try:
        with warnings.catch_warnings(action="error"):
            target.read(str(file))
    except InputError as error:
        text = str(error)
        assert "\n" not in text and len(text) < 1000, f"no short line: {text!r}"
        if isinstance(error.__cause__, MemoryError):
            raise error.__cause__ from None


class Found:
    """Failures by the place in the sources; the first input of each is kept in a folder and told on stderr."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.places: set[str] = set()

    def note(self, error: Exception, data: bytes) -> None:
        ours = [
            f for f in traceback.extract_tb(error.__traceback__) if {"golden", "tests"} & set(Path(f.filename).parts)
        ]
        where = f"{type(error).__name__} at {Path(ours[-1].filename).name}:{ours[-1].lineno}"
        if where not in self.places:
            self.places.add(where)
            kept = self.folder / hashlib.sha1(data).hexdigest()
            kept.write_bytes(data)
            print(f"FOUND {where}: {error!s:.200} ({kept})", file=sys.stderr, flush=True)


def loop(name: str, folder: Path, seconds: int, seed: int) -> None:
    """libFuzzer over one target; every new place in the sources that fails leaves an input in FOLDER/found."""
    import atheris

    with atheris.instrument_imports(include=["golden.scene", "golden.cameras", "plyfile"]):
        import plyfile  # noqa: F401

        from golden import cameras, scene  # noqa: F401

    target, found = TARGETS[name], folder / "found"
    found.mkdir(parents=True, exist_ok=True)
    corpus = folder / "corpus"
    corpus.mkdir(exist_ok=True)
    for data in target.seeds():
        (corpus / hashlib.sha1(data).hexdigest()).write_bytes(data)
    failures = Found(found)
    with tempfile.TemporaryDirectory() as scratch:
        file = place(target, Path(scratch))

        def one(data: bytes) -> None:
            try:
                check(target, file, data)
            except Exception as error:
                failures.note(error, data)

        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
        options = [f"-max_len={INPUT_BYTES}", f"-max_total_time={seconds}", f"-timeout={SECONDS}", f"-seed={seed}"]
        options += ["-print_final_stats=1", f"-artifact_prefix={found}/", "-len_control=0", "-reload=0"]
        atheris.Setup([sys.argv[0], *options, str(corpus)], one)
        atheris.Fuzz()


def run(name: str, minutes: float, seed: int, folder: Path) -> dict[str, int]:
    """Counts of one run: executions, coverage at its start and end, inputs kept, findings.

    libFuzzer ends by the clock, so it is started again, with the corpus it has, until the processor time is spent.
    """
    before, spent, starts, found = children_seconds(), 0.0, 0, []
    counts = {"executions": 0, "coverage at the start": 0, "coverage": 0, "inputs kept": 0, "peak MB": 0}
    while spent < 60 * minutes and not any("the process ended" in line for line in found):
        seconds = max(1, round(60 * minutes - spent))
        command = [sys.executable, "-m", "tests.fuzz.readers", name, str(folder), str(seconds), str(seed + starts)]
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
        log = done.stderr
        stats = dict(re.findall(r"stat::(\w+):\s+(\d+)", log))
        if not starts:
            counts["coverage at the start"] = next((int(n) for n in re.findall(r"INITED cov: (\d+)", log)), 0)
        counts["executions"] += int(stats.get("number_of_executed_units", 0))
        counts["coverage"] = max([counts["coverage"], *(int(n) for n in re.findall(r"cov: (\d+)", log))])
        counts["inputs kept"] += int(stats.get("new_units_added", 0))
        counts["peak MB"] = max(counts["peak MB"], int(stats.get("peak_rss_mb", 0)))
        found += re.findall(r"^FOUND .*", log, re.MULTILINE)
        if done.returncode:
            found += [f"FOUND the process ended with status {done.returncode}: {log[-600:]}"]
        spent, starts = children_seconds() - before, starts + 1
    for line in found:
        print(line, file=sys.stderr)
    return {**counts, "findings": len(found)}


def children_seconds() -> float:
    """Processor time of the processes that were started here and have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    loop(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]))
