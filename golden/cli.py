"""The command `splatcore`."""

from __future__ import annotations

import argparse
import sys

from golden import __version__
from golden.errors import InputError


class _Parser(argparse.ArgumentParser):
    """Errors of usage are errors of input: one line, status 2."""

    def error(self, message: str):
        raise InputError(f"{message}; see `{self.prog} --help`")


def _arguments(argv: list[str]) -> list[str]:
    """--camera's value may begin with a minus: glue it to its option."""
    out: list[str] = []
    for argument in argv:
        if out and out[-1] == "--camera":
            out[-1] = f"--camera={argument}"
        else:
            out.append(argument)
    return out


def parser() -> argparse.ArgumentParser:
    """The whole command line."""
    from golden.hard_cases import command as hard_cases
    from golden.job import add_common
    from golden.report import accuracy, reproduce
    from golden.timing import traces
    from golden.timing.hardware import HARDWARE

    top = _Parser(prog="splatcore", description="Neo's reuse-and-update 3D Gaussian rendering as verified hardware.")
    top.add_argument("--version", action="version", version=__version__)
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    info = commands.add_parser("info", help="what a scene file holds; --keys lists the settings")
    info.add_argument("scene", nargs="?", metavar="SCENE")
    info.add_argument("--keys", action="store_true", help="every --set key with unit, range and default")
    render = commands.add_parser("render", help="pictures by the oracle, the golden model or the RTL")
    add_common(render)
    render.add_argument("--model", choices=("oracle", "golden", "rtl"), default="golden", help="default: %(default)s")
    cosim = commands.add_parser("cosim", help="the RTL beside the golden model; status 1 at the first difference")
    add_common(cosim)
    cosim.add_argument("--no-oracle", action="store_true", help="leave out the PSNR against the oracle")
    simulate = commands.add_parser("simulate", help="frames a second, cycles, bytes and quality of an accelerator")
    add_common(simulate)
    simulate.add_argument("--hardware", default="splatcore", metavar="NAME", help="|".join(HARDWARE))
    simulate.add_argument("--json", metavar="FILE", help="write the result there")
    simulate.add_argument("--no-oracle", action="store_true", help="leave out the quality of each frame")
    export = commands.add_parser("export", help="traces for other simulators")
    traces.add_arguments(export)
    study = commands.add_parser("accuracy", help="what each knob does to the picture, the time and the bytes")
    accuracy.add_arguments(study)
    figures = commands.add_parser("reproduce", help="the paper's figures and tables beside ours")
    reproduce.add_arguments(figures)
    cases = commands.add_parser("hard-cases", help="what breaks naive designs, by name: figures beside bounds")
    hard_cases.add_arguments(cases)
    return top


def run(argv: list[str]) -> int:
    """Run one command; returns its exit status."""
    args = parser().parse_args(_arguments(argv))
    from golden import commands

    return getattr(commands, args.command.replace("-", "_"))(args)


def main() -> None:
    try:
        status = run(sys.argv[1:])
    except InputError as error:
        print(f"splatcore: {error}", file=sys.stderr)
        status = 2
    except KeyboardInterrupt:
        print("splatcore: interrupted; finished frames are kept", file=sys.stderr)
        status = 130
    sys.exit(status)


if __name__ == "__main__":
    main()
