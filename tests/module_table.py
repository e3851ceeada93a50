"""Writes docs/modules.md: every module with its sentence, its parameters and its streams, read off rtl/.

python -m tests.module_table
"""

from __future__ import annotations

import re
from pathlib import Path

from tests.builds import ROOT

TARGET = ROOT / "docs" / "modules.md"


def sentence(text: str) -> str:
    """The header's first sentence, without the module's name."""
    head = []
    for line in text.splitlines():
        if not line.startswith("//") or line.strip() == "//":
            break
        head.append(line.removeprefix("//").strip())
    return " ".join(head).partition(": ")[2].rstrip(".")


def parameters(text: str) -> str:
    """Names and defaults."""
    found = re.findall(r"^\s*parameter\s+(?:\[[^]]*\]\s*)?(\w+)\s*=\s*(`?\w+)", text, re.MULTILINE)
    return ", ".join(f"`{name}`" if value.startswith("`") else f"`{name}` = {value}" for name, value in found)


def streams(text: str, direction: str) -> str:
    """Channels whose valid goes in this direction."""
    names = re.findall(rf"^\s*{direction}\s+(?:wire|reg)\s+(\w+?)_?valid\b", text, re.MULTILINE)
    return ", ".join(f"`{name}`" for name in names)


def page() -> str:
    """Text of docs/modules.md."""
    lines = [
        "# Modules",
        "",
        "Written by `make docs` from the headers and ports in `rtl/`. A parameter without a value",
    ]
    lines += ["takes its default from `golden/params.py`.", ""]
    lines += ["| module | what it does | parameters | streams in | streams out |", "|---|---|---|---|---|"]
    for path in sorted((ROOT / "rtl").rglob("*.v"), key=lambda p: (p.parent.name, p.stem)):
        text = path.read_text()
        unit = Path(*path.relative_to(ROOT / "rtl").parts[:-1]) / f"{path.stem.removeprefix('gs_')}.md"
        cells = [f"[`{path.stem}`]({unit.as_posix()})", sentence(text), parameters(text)]
        lines.append(f"| {' | '.join([*cells, streams(text, 'input'), streams(text, 'output')])} |")
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    TARGET.write_text(page())
