"""Builds the slice as a shared library: Verilator, then the C++ compiler; kept in build/cosim by what it is made of.

Every set of number formats is a library of its own, with a header of its own.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

from golden import params, toolchain
from golden.errors import InputError
from golden.formats import BUILD, Formats

ROOT = Path(__file__).resolve().parent.parent.parent
TOP = "gs_slice"
HARNESS = Path(__file__).with_name("harness.cpp")
JOBS = 2
VERILATOR = ("--cc", "-O3", "--x-assign", "fast", "--x-initial", "fast", "--noassert", "--no-timing")
SPLIT = ("--output-split", "12000", "--output-split-cfuncs", "2000")
FAST = "-O2"  # code that runs every cycle
SLOW = "-O0"  # code that runs once
COMPILER = "g++"


def sources() -> list[Path]:
    """The RTL of TOP: its file and those of the modules named in them."""
    files = {path.stem: path for path in (ROOT / "rtl").rglob("*.v")}
    found, names = set(), {TOP}
    while names:
        found |= names
        names = set(re.findall(r"\bgs_\w+", "".join(files[name].read_text() for name in names))) & files.keys() - found
    return sorted(files[name] for name in found)


def key(formats: Formats, rtl: list[Path]) -> str:
    """Changes with anything that could change the library."""
    parts = hashlib.sha256()
    for path in [*rtl, HARNESS, Path(__file__)]:
        parts.update(path.name.encode() + b"\0" + path.read_bytes())
    parts.update(params.verilog_header(formats).encode())
    parts.update(version("verilator").encode())
    return parts.hexdigest()[:16]


def _run(command: list[str], folder: Path, environment: dict[str, str]) -> None:
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    if done.returncode:
        log = folder / "error.txt"
        log.write_text(done.stdout + done.stderr)
        last = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()
        first = next((line for line in last if "rror" in line), last[-1])
        raise InputError(f"building the RTL model failed in {command[0]}: {first} (all of it: {log})")


def library(formats: Formats, rtl: list[Path] | None = None, quiet: bool = False) -> Path:
    """Path of the shared library, built when there is none for these sources and formats; tells when it builds.

    rtl: other files than sources(), with the same modules; these models are compiled fast rather than run fast.
    """
    fast = SLOW if rtl else FAST
    rtl = rtl or sources()
    folder = ROOT / "build" / "cosim" / key(formats, rtl)
    result = folder / "slice.so"
    if result.exists():
        return result
    environment = {**os.environ, **toolchain.environment()}
    if not quiet:
        print("building the RTL model with Verilator, once for these formats (about a minute) ...", file=sys.stderr)
    start = time.monotonic()
    work = folder.with_name(f"{folder.name}.{os.getpid()}")
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    try:
        (work / "gs_params.vh").write_text(params.verilog_header(formats))
        includes = [f"-I{work}", "--Mdir", str(work), "--prefix", f"V{TOP}", "--top-module", TOP]
        _run(["verilator", *VERILATOR, *SPLIT, *includes, "-CFLAGS", "-fPIC", *map(str, rtl)], work, environment)
        runtime = Path(environment["PATH"].split(os.pathsep)[0]).parent / "include"
        # The harness waits for nothing: it is compiled beside the model.
        flags = [FAST, "-fPIC", "-std=gnu++17", f"-I{work}", f"-I{runtime}", f"-I{runtime / 'vltstd'}"]
        flags.append(f"-DACC_W={formats.acc_w}")
        harness = [COMPILER, *flags, "-c", str(HARNESS), "-o", "harness.o"]
        make = ["make", "-s", f"-j{JOBS}", "-f", f"V{TOP}.mk", f"OPT_FAST={fast}", f"OPT_SLOW={SLOW}", "OPT_GLOBAL=-O1"]
        _run(harness, work, environment)
        _run([*make, f"libV{TOP}.a", "libverilated.a"], work, environment)
        whole = ["-Wl,--whole-archive", f"libV{TOP}.a", "-Wl,--no-whole-archive", "libverilated.a"]
        _run([COMPILER, "-shared", "-o", "slice.so", "harness.o", *whole, "-lpthread"], work, environment)
        folder.mkdir(exist_ok=True)
        with contextlib.suppress(OSError):
            (work / "slice.so").rename(result)
    finally:
        if not (work / "error.txt").exists():
            shutil.rmtree(work, ignore_errors=True)
    if not quiet:
        print(f"built the RTL model in {time.monotonic() - start:.0f} s", file=sys.stderr)
    return result


if __name__ == "__main__":
    try:
        print(library(BUILD))
    except InputError as error:
        sys.exit(f"splatcore: {error}")
