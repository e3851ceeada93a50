"""`splatcore reproduce`: every figure and table of the paper beside this project's numbers (docs/reproduction.md)."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from golden.errors import InputError
from golden.report import sweep
from golden.report.stats import Output, write_json

NAMES = (
    "fig3", "fig4", "fig5", "fig6", "fig7", "fig10", "fig15", "fig16", "fig17a", "fig17b", "fig18", "fig19", "table2",
    "table3", "table4", "beyond", "slices", "accounting", "summary",
)  # fmt: skip


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `splatcore reproduce`."""
    parser.add_argument("names", nargs="*", default=["all"], metavar="NAME", help=f"all, page, {', '.join(NAMES)}")
    parser.add_argument("-o", dest="out", metavar="DIR", help="folder for CSV, PNG and the runs behind them")
    parser.add_argument("--frames", type=int, help="of each run, 2 or more (default: 3)")
    parser.add_argument("--quick", action="store_true", help="small built-in scenes and pictures, 2 frames: a trial")
    parser.add_argument("--scenes", metavar="LIST", help="kinds or SCENEs with commas between (default: all six kinds)")
    parser.add_argument("--sizes", metavar="LIST", help="picture sizes with commas between (default: hd,fhd,qhd)")
    parser.add_argument("--jobs", type=int, default=0, metavar="N", help="processes (default: cores, as memory allows)")
    sweep.add_arguments(parser)
    parser.add_argument("--page", metavar="FILE", help="write the page there (page: docs/reproduction.md)")


def chosen(names: list[str]) -> list[str]:
    """Names of figures, in order; InputError for what is none."""
    wanted: list[str] = []
    for name in names:
        if name not in ("all", "page", *NAMES):
            raise InputError(f"reproduce {name}: wants all, page, {', '.join(NAMES)}")
        wanted += NAMES if name == "all" else [name]
    return [name for name in NAMES if name in wanted]


def reproduce(args: argparse.Namespace, on_step: Callable[[int, int], None] = lambda done, total: None) -> int:
    """Run the command; on_step(work done, all work) is called behind each run."""
    names = chosen(args.names)
    if args.out is None:
        raise InputError("reproduce: wants -o DIR for its tables and pictures")
    if args.jobs < 0:
        raise InputError(f"--jobs {args.jobs}: wants 0 (as many as fit) or more")
    folder = Path(args.out)
    if names:
        _figures(args, names, folder, on_step)
    if "page" in args.names or args.page:
        from golden.report.reproduce import page
        from golden.report.reproduce.plan import ROOT

        file = Path(args.page) if args.page else ROOT / "docs/reproduction.md"
        page.write(folder, file)
        print(f"{file.name} written")
    return 0


def _figures(args: argparse.Namespace, names: list[str], folder: Path, on_step: Callable) -> None:
    """Measure what is missing, and write each figure as soon as its runs are there."""
    from golden.report.reproduce import plan as planning
    from golden.report.reproduce import plots, rows
    from golden.report.reproduce.figures import all_figures
    from golden.report.reproduce.runs import Runs

    plan = planning.make(args)
    Output(args.out, {})  # makes the folder, or says why not
    write_json(folder / "plan.json", plan.describe())
    runs = Runs(plan, folder)
    waiting = {name: all_figures()[name] for name in names}

    def write_ready() -> None:
        for figure in [f for f in waiting.values() if not runs.missing(f.cases(plan))]:
            table = figure.make(plan, runs)
            rows.write(folder / f"{figure.name}.csv", table)
            plots.draw(folder / f"{figure.name}.png", figure.title, figure.panels, table)
            del waiting[figure.name]
            print(f"{figure.name} written", flush=True)

    write_ready()
    cases = [case for figure in waiting.values() for case in figure.cases(plan)]
    for line in runs.fill(cases, args, on_step):
        print(line, flush=True)
        write_ready()
