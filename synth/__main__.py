"""`make synth`: map units, measure them, keep and print the results.

python -m synth [UNIT | all] [--page]        LIBERTY=PATH takes another library than the one of asap7_cells.csv
"""

from __future__ import annotations

import argparse
import hashlib
import os
import sys
import time
from pathlib import Path

from golden.errors import InputError
from synth import cells, characterise, flow, liberty, netlist, page, results, units
from synth.flow import BUILD, Library, Module


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
            results.save_settings(own_library())
            return 0
        if args.page:
            page.write()
            return 0
        chosen = units.named(args.unit or "all")
        path = os.environ.get("LIBERTY")
        library = users_library(Path(path)) if path else own_library()
        found = {}
        for unit in chosen:
            start = time.monotonic()
            found[unit.module] = results.with_plain(unit.module, library)
            seconds = sum(
                flow.map_module(m, library).seconds for m in netlist.mapped_tree(Module(unit.module), library)
            )
            if not path:
                results.save(found[unit.module])
            print(f"{unit.module}: {time.monotonic() - start:.0f} s, mapping it and its parts takes {seconds:.0f} s")
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
