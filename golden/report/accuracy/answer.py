"""answer.md: a study on one page, in words and numbers that a person reads."""

from __future__ import annotations

import math

from golden.report.accuracy.plan import CHANNELS, GRID, REFERENCE
from golden.report.accuracy.rows import PARTS, cheapest, front
from golden.report.accuracy.rows import text as cell

DECIBELS = (40, 50, 60, 70)
SAME_DB, SAME_TIME = 0.5, 0.02  # a knob that changes less does not matter: dB; share of time and of bytes
ENDS = "end"
NOT_SETTINGS = ("again", "random order")  # ends of the scale that nobody would build
HALF, MOST = "0.5 LSB, root mean square", "99.9 % of the pixels within 1 LSB"
LINES = 30  # of what is left out


def _number(value: float, digits: int = 3) -> str:
    return f"{value:.{digits}g}" if abs(value) < 1000 else f"{value:,.0f}"


def _db(value: float) -> str:
    return "no difference" if value == float("inf") else f"{value:.1f}"


def _table(head: list[str], lines: list[list[str]]) -> str:
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *lines)) + "\n"


def name(row: dict) -> str:
    """A point in words: machine and what differs from its reference setting."""
    words = [row["hardware"]]
    words += [f"sorting {row['sorting']}"] if row["sorting"] else []
    return " ".join([*words, *([f"`{row['set']}`"] if row["set"] else [])])


def _line(row: dict) -> list[str]:
    return [
        name(row), _db(row["psnr_min_db"]), _db(row["psnr_mean_db"]), _number(row["max_lsb"]),
        _number(row["percent_above_1_lsb"]), _number(row["ms_p50"]), _number(row["ms_p99"]), _number(row["ms_first"]),
        _number(row["mb"]), cell(row["area_mm2"]) and _number(row["area_mm2"]),
    ]  # fmt: skip


COLUMNS = [
    "setting", "worst frame, dB", "mean, dB", "largest error, LSB", "pixels above 1 LSB, %", "ms", "p99, ms",
    "first, ms", "MB a frame", "mm2",
]  # fmt: skip


def _candidates(table: list[dict]) -> list[dict]:
    """Settings on the units and the bandwidth of the reference machines, the exact one too."""
    other = {f"channels={number}" for number in CHANNELS if number != CHANNELS[1]}
    return [
        row
        for row in table
        if (row["family"] != "machine" or row["knob"] == REFERENCE)
        and row["value"] not in NOT_SETTINGS
        and not other & set(row["set"].split())
    ]


def targets(table: list[dict]) -> list[tuple[str, dict | None]]:
    """(target in words, its cheapest setting on the reference machines' units and memory)."""
    rows = _candidates(table)
    found = [(f"{db} dB", cheapest(rows, lambda row, db=db: row["psnr_min_db"] >= db)) for db in DECIBELS]
    found.append((MOST, cheapest(rows, lambda row: row["percent_above_1_lsb"] <= 0.1)))
    found.append((HALF, cheapest(rows, lambda row: row["psnr_min_db"] >= 20 * math.log10(255 / 0.5))))
    found.append(("every pixel within 1 LSB", cheapest(rows, lambda row: row["max_lsb"] <= 1)))
    return found


def _reached(table: list[dict]) -> str:
    none = ["none of these settings", *[""] * (len(COLUMNS) - 1)]
    return _table(["target", *COLUMNS], [[words, *(_line(row) if row else none)] for words, row in targets(table)])


def _price(row: dict, other: dict) -> str:
    """Time and bytes of a row over those of another."""
    return (
        f"{100 * (row['ms_p50'] / other['ms_p50'] - 1):+.0f} % time, {100 * (row['mb'] / other['mb'] - 1):+.0f} % bytes"
    )


def _sentences(table: list[dict], references: dict[str, dict]) -> list[str]:
    found = dict(targets(table))
    neo = references["neo"]
    lines = []
    for words in (HALF, MOST, "every pixel within 1 LSB"):
        row = found[words]
        if row is None:
            closest = min(_candidates(table), key=lambda r: r["max_lsb"])
            lines.append(
                f"- For *{words}* no setting is enough here; the closest is {name(closest)}: "
                f"{_number(closest['max_lsb'])} LSB, {_number(closest['ms_p50'])} ms ({_price(closest, neo)} over neo)."
            )
        else:
            lines.append(
                f"- For *{words}* you pay {_number(row['ms_p50'])} ms and {_number(row['mb'])} MB a frame "
                f"({_price(row, neo)} over neo): {name(row)}."
            )
    row = found["60 dB"]
    if row is not None:
        lines.append(f"- The cheapest way to 60 dB is {name(row)}: {_number(row['ms_p50'])} ms ({_price(row, neo)}).")
    return lines


def _range(rows: list[dict], measure) -> tuple[float, float, str]:
    """(least, most, both in words with the values that have them) of a measure of rows."""
    least, most = min(rows, key=measure), max(rows, key=measure)
    ends = dict.fromkeys((least["value"], most["value"]))
    return measure(least), measure(most), " .. ".join(ends)


def _knobs(table: list[dict], references: dict[str, dict]) -> tuple[str, list[str]]:
    """(table of what each knob moves, those that move nothing on either machine)."""
    lines, idle = [], []
    names = [n for n in dict.fromkeys(row["knob"] for row in table) if n not in (REFERENCE, ENDS, GRID)]
    for knob in names:
        still = True
        for machine, reference in references.items():
            mine = [row for row in table if row["knob"] == knob and row["machine"] == machine]
            if not mine:
                continue
            cells = []
            for column in ("psnr_min_db", "ms_p50", "mb"):
                base = reference[column]
                if column == "psnr_min_db":
                    low, high, values = _range(mine, lambda row: row["psnr_min_db"])
                    still &= max(abs(low - base), abs(high - base)) < SAME_DB
                    cells.append(f"{_db(low)} .. {_db(high)} ({values})")
                else:
                    low, high, values = _range(mine, lambda row, c=column, base=base: 100 * (row[c] / base - 1))
                    still &= max(abs(low), abs(high)) < 100 * SAME_TIME
                    cells.append(f"{low:+.0f} .. {high:+.0f} ({values})")
            lines.append([knob, machine, *cells])
        if still:
            idle.append(knob)
    head = ["knob", "machine", "worst frame, dB (values)", "time, % (values)", "bytes, % (values)"]
    return _table(head, lines), idle


def _sources(references: dict[str, dict]) -> str:
    """Where the error of the reference machines comes from."""
    lines = [
        [machine, part, *(_number(row[f"{part}_{kind}"]) for kind in ("max_lsb", "rms_lsb", "percent_above_1_lsb"))]
        for machine, row in references.items()
        for part in PARTS
    ]
    head = ["last frame", "error by", "largest, LSB", "root mean square, LSB", "pixels above 1 LSB, %"]
    return _table(head, lines)


def _ends(table: list[dict], references: dict[str, dict]) -> list[str]:
    lines = []
    for row in (row for row in table if row["knob"] == ENDS):
        if row["value"] == "again":
            same = all(row[k] == references["neo"][k] for k in row if k not in ("knob", "family", "value"))
            lines.append(f"- the reference a second time: {'0 differences' if same else 'NOT THE SAME'}")
        else:
            lines.append(
                f"- {row['value']} ({name(row)}): {_db(row['psnr_min_db'])} dB, at most {_number(row['max_lsb'])} LSB; "
                f"of it by the order alone {_number(row['order_max_lsb'])} LSB, by arithmetic alone "
                f"{_number(row['arithmetic_max_lsb'])} LSB"
            )
    return lines


def text(head: dict, table: list[dict], left_out: list[str], simulators: list[dict]) -> str:
    """The page."""
    references = {row["machine"]: row for row in table if row["knob"] == REFERENCE}
    knobs, idle = _knobs(table, references)
    parts = [
        f"# What accuracy costs: {head['scene']}\n",
        f"{head['size'][0]}x{head['size'][1]}, frames {head['frames']}, motion {head['motion']}"
        + (f", {' '.join(head['set'])}" if head["set"] else "")
        + f"; inputs sha256 {head['inputs_sha256'][:16]}. Error: distance to the exact float64 picture of the same "
        "scene. Time: whole frames with preprocessing and LPDDR4; steady frames, the first (sorted from scratch) "
        "apart. Written by `splatcore accuracy`; all points are in `accuracy.csv`.\n",
        "\n".join(_sentences(table, references)) + "\n",
        "The two reference machines:\n",
        _table(COLUMNS, [_line(row) for row in references.values()]),
        _sources(references),
        "Cheapest setting for each target, in the worst frame, on the reference machines' units and memory:\n",
        _reached(table),
    ]
    for machine in references:
        own = [row for row in table if row["machine"] == machine]
        parts += [f"The same on {machine} alone:\n", _reached(own)]
    best = front([row for row in table if row["knob"] == GRID])
    if best:
        parts += ["Pareto front of the joint grid (worst frame over time):\n", _table(COLUMNS, map(_line, best))]
    if knobs.count("\n") > 2:
        parts += ["What each knob moves, alone (price over its reference machine):\n", knobs]
        parts.append(
            f"Knobs that do not matter on this scene (less than {SAME_DB} dB, {SAME_TIME:.0%} of time and of bytes): "
            f"{', '.join(idle) or 'none'}.\n"
        )
    parts += ["Ends of the scale:\n", "\n".join(_ends(table, references)) + "\n"]
    if left_out:
        lines = "\n".join(f"- {line}" for line in left_out[:LINES])
        more = f"\n- and {len(left_out) - LINES} more, in `accuracy.json`" if len(left_out) > LINES else ""
        parts.append(f"Left out, since this build does not know it:\n\n{lines}{more}\n")
    if simulators:
        cells = [list(row.values()) for row in simulators]
        parts += [
            "Which model to run for what (seconds and memory on the machine that made this page):\n",
            _table(["model", "answers", "s a frame", "peak MB", "what it misses"], cells),
        ]
    return "\n".join(parts)
