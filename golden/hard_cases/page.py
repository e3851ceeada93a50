"""The table of docs/hard_cases.md: `python -m golden.hard_cases.page` runs every case and writes it."""

from __future__ import annotations

from pathlib import Path

from golden.hard_cases.case import cases
from golden.hard_cases.command import judge_all, shown
from golden.settings import Settings

PAGE = Path(__file__).resolve().parent.parent.parent / "docs" / "hard_cases.md"
MARK = "<!-- figures: python -m golden.hard_cases.page -->\n"


def table(records: list[dict]) -> str:
    """Markdown: a row a case, a row a figure."""
    lines = ["| case | what is asked | figure | bound | |", "|---|---|---|---|---|"]
    for record in records:
        lines.append(f"| {record['case']} | {record['title']} | | | {record['status']} |")
        for check in record["checks"]:
            what = check["what"].replace("|", "\\|")
            ok = {True: "pass", False: "FAIL", None: ""}[check["ok"]]
            lines.append(f"| | {what} | {shown(check['figure'])} | {check['bound']} | {ok} |")
        lines += [f"| | in RTL: `tb/{bench}` | | | bench |" for bench in record["benches"]]
    return "\n".join(lines) + "\n"


def main() -> None:
    records = judge_all(list(cases().values()), Settings(), False, lambda _: None)
    head, _, _ = PAGE.read_text().partition(MARK)
    PAGE.write_text(head + MARK + "\n" + table(records))


if __name__ == "__main__":
    main()
