"""`make synth`: map units, measure them, keep and print the results.

python -m synth [UNIT | all] [--page]        LIBERTY=PATH takes another library than the one of asap7_cells.csv
"""

from __future__ import annotations

import argparse
import hashlib
import os
import resource
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache
from itertools import product
from multiprocessing import get_context
from pathlib import Path

from golden import formats
from golden.errors import InputError
from synth import cells, characterise, flow, liberty, netlist, page, results, units
from synth.flow import BUILD, Library, Module

WORKERS = 4  # processes at once; each may take 2 GB


def own_library() -> Library:
    """The library of asap7_cells.csv."""
    table = cells.load()
    path = BUILD / "asap7.lib"
    liberty.write(table, path)
    return Library(path, table, "asap7")


def users_library(path: Path) -> Library:
    """A complete Liberty file: mapping reads it as it is, our timing a reduction of it."""
    if not path.is_file():
        raise InputError(f"LIBERTY={path}: no such file")
    try:
        text = path.read_text()
    except UnicodeDecodeError:
        raise InputError(f"LIBERTY={path}: not a text file (unpack it first?)") from None
    try:
        table = characterise.cells_of(characterise.parse(text))
    except InputError as error:
        raise InputError(f"LIBERTY={path}: {error}") from None
    for what in ("flop", "buffer", "nand2", "1", "0"):
        cells.cheapest(table, what)
    return Library(path, table, f"{path.stem}-{hashlib.sha256(text.encode()).hexdigest()[:8]}")


@cache
def library_of(liberty_path: str | None) -> Library:
    """The library that a run maps to: the user's, or our own."""
    return users_library(Path(liberty_path)) if liberty_path else own_library()


def measured(module: str, liberty_path: str | None, plain: bool) -> dict:
    """A unit's results, in a process of its own."""
    start = time.monotonic()
    library = library_of(liberty_path)
    if plain:
        library = replace(library, plain=True, name=f"{library.name}-plain")
    found = results.measure(module, library)
    seconds = sum(flow.map_module(m, library).seconds for m in netlist.mapped_tree(Module(module), library))
    what = f"{module}{', plain' if plain else ''}"
    print(f"{what}: {time.monotonic() - start:.0f} s, mapping it and its parts takes {seconds:.0f} s", flush=True)
    return found


def setting_area(setting: str, module: str) -> float:
    """um2 of a core at a setting of the formats, in a process of its own."""
    return results.setting_area(setting, module, library_of(None))


def together(jobs: dict) -> Iterator[tuple]:
    """(key, result) of {key: (function, arguments ...)}, as many at once as there are cores up to WORKERS."""
    workers = min(len(os.sched_getaffinity(0)), WORKERS)
    with ProcessPoolExecutor(workers, mp_context=get_context("fork")) as pool:
        runs = {key: pool.submit(*job) for key, job in jobs.items()}
        try:
            for key, run in runs.items():
                yield key, run.result()
        finally:
            pool.shutdown(cancel_futures=True)


def measure_all(chosen: list[units.Unit], liberty_path: str | None) -> dict[str, dict]:
    """Results of units by module; those of our own library are kept."""
    runs = product((unit.module for unit in chosen), (True, False))
    jobs = {(module, plain): (measured, module, liberty_path, plain) for module, plain in runs}
    library_of(liberty_path)  # known to the processes to come
    found, plain_one = {}, {}
    for (module, plain), result in together(jobs):
        if plain:
            plain_one = result
        else:
            found[module] = results.with_plain(plain_one, result)
            if not liberty_path:
                results.save(found[module])
    return found


def spent() -> float:
    """s of processors that this run and its processes have used."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m synth", description="Area and timing of the units.")
    parser.add_argument("unit", nargs="?", default="all", help="a module of synth/units.py")
    parser.add_argument(
        "--page", action="store_true", help="write the table of docs/synthesis.md from the kept results"
    )
    parser.add_argument("--settings", action="store_true", help="areas at each setting, for the accuracy study")
    args = parser.parse_args()
    try:
        if args.settings:
            library_of(None)
            jobs = {key: (setting_area, *key) for key in product(formats.PRESETS, results.CORES)}
            results.save_settings(dict(together(jobs)))
            return 0
        if args.page:
            page.write()
            return 0
        chosen = units.named(args.unit or "all")
        path = os.environ.get("LIBERTY")
        start = time.monotonic()
        found = measure_all(chosen, path)
        print(f"{len(found)} units: {time.monotonic() - start:.0f} s, {spent():.0f} s of processors")
        if not path:
            page.write()
        print(page.table(found))
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    except RuntimeError as error:  # Yosys failed
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
