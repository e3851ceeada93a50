"""Scenes: `load` turns what the user names into Gaussians (docs/scenes.md)."""

from __future__ import annotations

import re
from pathlib import Path

from golden.errors import InputError
from golden.scene import builtin, ply, sog, splat
from golden.scene.files import one_line
from golden.scene.gaussians import Gaussians, checked

__all__ = ["Gaussians", "checked", "load"]

FORMATS = ".ply, .compressed.ply, .splat, .spz, .sog, a folder with meta.json or lod-meta.json, or builtin:NAME"


def load(spec: str) -> Gaussians:
    """The scene a command line names; every problem is an InputError of one line."""
    if spec.startswith("builtin:"):
        return builtin.load(spec)
    path, level = split_level(spec)
    try:
        folder, exists = path.is_dir(), path.exists()
    except (OSError, ValueError) as error:
        raise InputError(f"{one_line(spec)}: cannot be opened ({one_line(error)})") from error
    if not exists:
        raise InputError(f"{path}: no such file or folder; a scene is {FORMATS}")
    if folder:
        path = inside(path)
    if path.name == "lod-meta.json":
        return sog.read_streamed(path, level or 0, name_of(path.parent), spec)
    if level is not None:
        raise InputError(f"{spec}: @lod={level} needs a streamed scene (lod-meta.json), {path.name} has one level")
    if path.name == "meta.json":
        return sog.read_folder(path, name_of(path.parent), spec)
    if path.suffix == ".obj" or path.name == "mlp.json":
        raise InputError(f"{path}: is a MobileNeRF mesh, polygons are not read yet; a scene is {FORMATS}")
    readers = {".ply": ply.read, ".splat": splat.read_splat, ".spz": splat.read_spz, ".sog": sog.read_zip}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise InputError(f"{path}: ending '{path.suffix}' is unknown; a scene is {FORMATS}")
    try:
        return reader(path, spec)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({one_line(error)})") from error


def split_level(spec: str) -> tuple[Path, int | None]:
    """(path, level of detail or None) of `path@lod=N`."""
    path, mark, level = spec.rpartition("@lod=")
    if not mark:
        return Path(spec), None
    if not re.fullmatch(r"\d{1,4}", level):
        raise InputError(f"{spec}: @lod={one_line(level)} is no level, @lod=0 or a small whole number is needed")
    return Path(path), int(level)


def inside(folder: Path) -> Path:
    """The file that makes a folder a scene."""
    for name in ("lod-meta.json", "meta.json", "mlp.json"):
        if (folder / name).is_file():
            return folder / name
    scenes = sorted(p.name for p in folder.iterdir() if p.suffix in (".ply", ".splat", ".spz", ".sog", ".obj"))
    hint = f"it holds {one_line(', '.join(scenes))}: name the file" if scenes else f"a scene is {FORMATS}"
    raise InputError(f"{folder}: a folder without lod-meta.json or meta.json; {hint}")


def name_of(folder: Path) -> str:
    return folder.name or folder.resolve().name
