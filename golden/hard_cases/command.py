"""`splatcore hard-cases`: every case at given settings, its figures beside their bounds."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict

from rich.console import Console
from rich.table import Table

from golden import settings
from golden.errors import InputError
from golden.hard_cases.case import Case, Check, cases
from golden.hard_cases.run import Run
from golden.report.stats import write_json

WIDTH = 150  # characters of a table that goes into a file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("names", nargs="*", metavar="CASE", help="P01, S, ...: cases or whole groups (default: all)")
    parser.add_argument("--rtl", action="store_true", help="draw every frame by the RTL too, equal to the last bit")
    parser.add_argument("--json", metavar="FILE", help="write the figures there")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="see `splatcore info --keys`")


def chosen(names: Iterable[str]) -> list[Case]:
    """The cases of names such as "P01", "D-P01" or "P"; all without a name."""
    known = cases()
    wanted = [name.upper().removeprefix("D-") for name in names]
    for name in wanted:
        if not any(key == name or key[0] == name for key in known):
            raise InputError(f"hard-cases {name}: no such case; known are {', '.join(known)}")
    return [found for key, found in known.items() if not wanted or key in wanted or key[0] in wanted]


def judge(one: Case, base: settings.Settings, rtl: bool = False) -> list[Check]:
    """Run a case; empty where its unit does not exist yet."""
    if one.work is None:
        return []
    run = Run(base, rtl)
    one.work(run)
    run.finish()
    return run.found


def judge_all(todo: list[Case], base: settings.Settings, rtl: bool, progress: Callable[[int], None]) -> list[dict]:
    """One record a case, as --json holds it; an interrupt ends the list early."""
    records = []
    try:
        for number, one in enumerate(todo):
            progress(number)
            begin = time.perf_counter()
            found = judge(one, base, rtl)
            records.append(
                {
                    "case": one.name,
                    "title": one.title,
                    "status": status(one, found),
                    "checks": [asdict(check) for check in found],
                    "benches": list(one.benches),
                    "seconds": round(time.perf_counter() - begin, 3),
                }
            )
    except KeyboardInterrupt:
        pass
    return records


def status(one: Case, found: list[Check]) -> str:
    if one.work is None:
        return "later"
    return "fail" if any(check.ok is False for check in found) else "pass"


def shown(figure) -> str:
    return f"{figure:.5g}" if isinstance(figure, float) else f"{figure:,}" if isinstance(figure, int) else figure


def show(records: list[dict]) -> None:
    """The table on the terminal."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=WIDTH)
    table = Table("case", "what is asked", "figure", "bound", "", header_style="bold")
    for record in records:
        table.add_section()
        table.add_row(f"[bold]{record['case']}", f"[bold]{record['title']}", "", "", record["status"])
        for check in record["checks"]:
            mark = {True: "pass", False: "[bold red]FAIL", None: ""}[check["ok"]]
            table.add_row("", check["what"], shown(check["figure"]), check["bound"], mark)
        for bench in record["benches"]:
            table.add_row("", f"RTL: {bench}", "", "", "bench")
    console.print(table)
    counts = {name: sum(r["status"] == name for r in records) for name in ("pass", "fail", "later")}
    checks = sum(len(r["checks"]) for r in records)
    seconds = sum(r["seconds"] for r in records)
    console.print(
        f"{counts['pass']} cases pass, {counts['fail']} fail, {counts['later']} wait for their unit;"
        f" {checks} figures in {seconds:.0f} s"
    )


def run(args: argparse.Namespace, progress: Callable[[int, int], None]) -> int:
    """0: every case passes; 1: one fails; 130: interrupted. progress gets (cases done, of how many)."""
    base = settings.parse(args.set)
    todo = chosen(args.names)
    if args.json and (os.path.isdir(args.json) or not os.path.isdir(os.path.dirname(args.json) or ".")):
        raise InputError(f"--json {args.json}: wants the name of a file in a folder that exists")
    records = judge_all(todo, base, args.rtl, lambda done: progress(done, len(todo)))
    show(records)
    if args.json:
        write_json(args.json, {"set": asdict(base), "rtl": args.rtl, "cases": records})
    if len(records) < len(todo):
        return 130
    return int(any(record["status"] == "fail" for record in records))
