"""Records what goes into units and comes out of them while the RTL's slice draws tiles of a real scene.

A copy of each unit's source writes its ports to a file in every cycle; the slice with these copies is built like that
of `splatcore cosim` and draws some tiles of a frame that reuses the last one's tables.
"""

from __future__ import annotations

import argparse
import re
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from golden.cosim import build
from golden.cosim.model import Slice
from golden.errors import InputError
from golden.frame import Renderer, tiles_of
from golden.job import Job, add_common, prepare
from golden.sorting_core import sorting_core
from tests.builds import ROOT

FOLDER = ROOT / "build" / "power"
CYCLES = 32_000  # recorded, from reset on
TILES = 8
STEP = 1000  # cycles
SHARED = ROOT.parent / "shared"
FOX = SHARED / "scenes" / "fox" / "fox.ply"
PATH = SHARED / "trajectories" / "record3d_dance_metadata.json"
PORT = re.compile(r"^\s*(input|output)\s+(?:wire|reg)\s*(?:\[.*\])?\s*(\w+)\s*,?\s*(?://.*)?$", re.MULTILINE)
RECORDER = """
    integer record_file;
    reg [31:0] record_left = {cycles};
    initial record_file = $fopen($sformatf("{folder}/{module}~%m.hex"), "w");
    always @(posedge clk) if (record_left != 0) begin
        $fwrite(record_file, "%h\\n", {{{ports}}});
        record_left <= record_left - 1;
        if (record_left == 1) $fclose(record_file);
    end
"""


@dataclass(frozen=True)
class Scene:
    """A scene as the command line names it, and how a result does."""

    name: str
    arguments: tuple[str, ...]


SCENES = {
    "fox": Scene("fox, 640x384, recorded path", (str(FOX), "--cameras", str(PATH), "--frames", "80:82")),
    "room": Scene("built-in room, 20,000 Gaussians, 640x384", ("builtin:room?n=20000", "--frames", "2")),
}


def scene(name: str | None = None) -> Scene:
    """A scene of SCENES; without a name the real one where it lies beside the project."""
    if name == "fox" and not FOX.exists():
        raise InputError(f"--scene fox: {FOX.name} does not lie beside the project")
    return SCENES[name or ("fox" if FOX.exists() else "room")]


def port_names(text: str) -> list[tuple[str, str]]:
    """(direction, name) of a module's ports, the clock left out."""
    return [(direction, name) for direction, name in PORT.findall(text) if name != "clk"]


def sources(modules: list[str], folder: Path) -> list[Path]:
    """The slice's RTL, the modules replaced by copies that record."""
    found = []
    for path in build.sources():
        if path.stem in modules:
            text = path.read_text()
            ports = ", ".join(name for _, name in reversed(port_names(text)))  # the first one has the lowest bits
            code = RECORDER.format(cycles=CYCLES, folder=folder, module=path.stem, ports=ports)
            head, _, tail = text.rpartition("endmodule")
            path = folder / path.name
            path.write_text(f"{head}{code}\nendmodule{tail}")
        found.append(path)
    return found


def draw(job: Job, rtl: list[Path]) -> None:
    """Let the slice draw TILES tiles of the job's second frame, those whose tables are nearest to the mean."""
    renderer = Renderer(job.gaussians, job.settings)
    renderer.frame(job.cameras[0])
    camera, first = job.cameras[1], sorting_core.first_length(renderer.number)
    frame = renderer.frame(camera)
    entries = frame.order.lengths
    mean = entries[entries > 0].mean()
    chosen = np.sort(np.argsort(np.abs(entries - mean), kind="stable")[:TILES])
    lists = [(np.cumsum([0, *(len(part.tile(t)) for t in chosen)]), np.concatenate([part.tile(t) for t in chosen]))
             for part in (frame.table, frame.incoming)]  # fmt: skip
    tiles = tiles_of(camera.width, camera.height)[chosen]
    core = Slice(job.settings.formats(), rtl=rtl)
    size = camera.width, camera.height
    config, places = core.place(frame.features, *lists, tiles, *size, job.settings.background_codes(), first)
    core.start(config, places)
    for _ in range(0, CYCLES + STEP, STEP):
        if core.run(STEP) is None:
            break
    core.close()


def record(modules: list[str], where: Scene) -> None:
    """Record the modules anew."""
    parser = argparse.ArgumentParser()
    add_common(parser)
    job = prepare(parser.parse_args([*where.arguments]))
    folder = FOLDER / "record"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    draw(job, sources(modules, folder))


@dataclass(frozen=True)
class Stimulus:
    """Values of an instance's ports in front of each clock edge: bits uint8[cycles, all bits], ports lowest first."""

    instance: str
    ports: dict[str, tuple[str, slice]]
    bits: np.ndarray

    def side(self, direction: str) -> np.ndarray:
        """uint8[cycles, bits] of all inputs or outputs."""
        parts = [self.bits[:, at] for kind, at in self.ports.values() if kind == direction]
        return np.ascontiguousarray(np.concatenate(parts, axis=1))


def stimulus(module: str, widths: dict[str, int], source: Path) -> Stimulus:
    """Of the instance in the middle of those recorded."""
    files = sorted((FOLDER / "record").glob(f"{module}~*.hex"))
    if not files:
        raise RuntimeError(f"{module}: no instance of it was recorded")
    path = files[len(files) // 2]
    ports, at = {}, 0
    for direction, name in port_names(source.read_text()):
        ports[name] = direction, slice(at, at + widths[name])
        at += widths[name]
    digits = -(-at // 4)
    lines = [line for line in path.read_text().split("\n") if len(line) == digits]
    text = np.frombuffer("".join(line.zfill(digits + digits % 2) for line in lines).encode(), np.uint8)
    raw = np.frombuffer(bytes.fromhex(text.tobytes().decode()), np.uint8).reshape(len(lines), -1)
    bits = np.unpackbits(raw[:, ::-1], axis=1, bitorder="little")[:, :at]
    return Stimulus(path.stem.split("~")[1], ports, np.ascontiguousarray(bits))
