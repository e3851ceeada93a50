"""Pictures of a study. Time and bytes are of whole frames with memory; every point is a run, none is projected."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from golden.report.accuracy import measure, rows
from golden.report.accuracy.plan import GRID, REFERENCE

FAMILIES = {
    "keys": "depth key",
    "order": "order of work, strategies of sorting",
    "stop": "where blending stops, which subtiles are tested",
    "colour": "colour",
    "machine": "units, bandwidth, caches",
    "formats": "all widths together",
}
MARKERS = {"neo": "o", "splatcore": "s"}
CEILING = 120.0  # dB at which a picture without any difference is drawn
SHOWN = ("reference", "small", "random order", "exact")  # values of the difference pictures


def _pyplot():
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot


def _save(figure, path: Path) -> None:
    part = path.with_name(path.name + ".part")
    figure.savefig(part, format="png", dpi=100, metadata={"Software": None})
    _pyplot().close(figure)
    os.replace(part, path)


def _db(value: float) -> float:
    return min(value, CEILING)


def _area(row: dict) -> float:
    """Marker size in points^2: bytes of a frame."""
    return 8 + 12 * row["mb"] ** 0.5


def _points(axes, table: list[dict], **look) -> None:
    """Marker at the mean frame, its error bar from the worst to the best."""
    for row in table:
        mean = _db(row["psnr_mean_db"])
        low, high = mean - _db(row["psnr_min_db"]), _db(row["psnr_max_db"]) - mean
        axes.errorbar(row["ms_p50"], mean, [[max(low, 0)], [max(high, 0)]], color=look["color"], alpha=0.35, lw=0.8)
        axes.scatter(row["ms_p50"], mean, _area(row), marker=MARKERS[row["machine"]], alpha=0.75, **look)


def _panel(pyplot, top, low, table: list[dict], references: list[dict]) -> None:
    """One family: quality over time; below, apart, the times of the slowest frame in a hundred and of the first."""
    names = list(dict.fromkeys(row["knob"] for row in table))
    colours = dict(zip(names, pyplot.cm.tab10.colors * 3))
    for name in names:
        mine = [row for row in table if row["knob"] == name]
        _points(top, mine, color=colours[name])
        for machine in MARKERS:
            own = [(row["ms_p50"], _db(row["psnr_mean_db"])) for row in mine if row["machine"] == machine]
            if own and all(row["value"].replace(".", "", 1).isdigit() for row in mine):
                top.plot(*zip(*own), color=colours[name], lw=0.4, alpha=0.5)
        top.scatter([], [], 30, color=colours[name], label=name)
        for row in mine:
            at = row["ms_p50"], _db(row["psnr_mean_db"])
            top.annotate(row["value"], at, (2, 3), textcoords="offset points", fontsize=5, alpha=0.8)
        for height, column in ((1, "ms_p99"), (0, "ms_first")):
            low.plot([row[column] for row in mine], [height] * len(mine), "|", color=colours[name], ms=9)
    _points(top, references, color="black", zorder=3)
    for row in references:
        at = row["ms_p50"], _db(row["psnr_mean_db"])
        top.annotate(row["machine"], at, (4, -8), textcoords="offset points", fontsize=7, weight="bold")
    top.legend(fontsize=6)
    top.grid(alpha=0.3)
    low.set_yticks([0, 1], ["first", "p99"], fontsize=6)
    low.set_ylim(-0.7, 1.7)
    low.tick_params(labelsize=6)
    low.grid(axis="x", alpha=0.3)


def overview(path: Path, head: dict, table: list[dict]) -> None:
    """accuracy.png: a panel a family."""
    pyplot = _pyplot()
    references = [row for row in table if row["knob"] == REFERENCE]
    families = [f for f in FAMILIES if any(row["family"] == f for row in table if _timed(row))]
    if not families:
        return
    columns = min(3, len(families))
    blocks = -(-len(families) // columns)
    figure, axes = pyplot.subplots(
        2 * blocks, columns, figsize=(5.2 * columns, 4.4 * blocks), squeeze=False, layout="constrained",
        gridspec_kw={"height_ratios": [6, 1] * blocks},
    )  # fmt: skip
    for k in range(blocks * columns):
        top, low = axes[k // columns * 2][k % columns], axes[k // columns * 2 + 1][k % columns]
        if k >= len(families):
            top.axis("off")
            low.axis("off")
            continue
        mine = [row for row in table if row["family"] == families[k] and _timed(row)]
        _panel(pyplot, top, low, mine, references)
        top.set_title(FAMILIES[families[k]], fontsize=9)
        top.set_xlabel("ms a frame (median)", fontsize=7)
        top.set_ylabel("PSNR against the oracle, dB", fontsize=7)
        low.set_xlabel("ms", fontsize=6)
    figure.suptitle(
        f"{_title(head)}: each knob alone; marker size: bytes of a frame; bars: worst to best frame",
        fontsize=9,
    )
    _save(figure, path)


def _timed(row: dict) -> bool:
    """Widths of single fields change area, not time: they have a picture of their own."""
    return row["family"] != "formats" or row["knob"] == "setting"


def widths(path: Path, head: dict, table: list[dict]) -> None:
    """bits.png: error over each width, in LSB, given the frame's order."""
    pyplot = _pyplot()
    mine = [row for row in table if row["family"] == "formats" and row["knob"] != "setting"]
    names = list(dict.fromkeys(row["knob"] for row in mine))
    if not names:
        return
    columns = min(5, len(names))
    lines = -(-len(names) // columns)
    figure, axes = pyplot.subplots(
        lines, columns, figsize=(3.1 * columns, 2.7 * lines), squeeze=False, layout="constrained"
    )
    reference = next(row for row in table if row["knob"] == REFERENCE)
    for k, own in enumerate(axes.ravel()):
        if k >= len(names):
            own.axis("off")
            continue
        rows_ = [row for row in mine if row["knob"] == names[k] and row["machine"] == reference["machine"]]
        x = [float(row["value"]) for row in rows_]
        for column, look in (
            ("decisions_max_lsb", "o-"), ("arithmetic_max_lsb", "s-"), ("arithmetic_rms_lsb", "^-"),
        ):  # fmt: skip
            (line,) = own.plot(x, [row[column] for row in rows_], look, ms=4, lw=0.8, label=column[:-4])
            own.axhline(reference[column], color=line.get_color(), lw=0.6, ls=":")
        own.set_yscale("log")
        own.set_title(names[k], fontsize=8)
        own.set_xlabel(rows_[0]["unit"] or "segments", fontsize=7)
        own.tick_params(labelsize=6)
        own.grid(alpha=0.3)
    axes[0][0].set_ylabel("LSB", fontsize=7)
    axes[0][0].legend(fontsize=6)
    figure.suptitle(
        f"{_title(head)}: error of each width alone, given the order (dotted: the reference setting)", fontsize=9
    )
    _save(figure, path)


def grid(path: Path, head: dict, table: list[dict]) -> None:
    """grid.png: the joint grid, what is on its Pareto front and what is dominated."""
    pyplot = _pyplot()
    mine = [row for row in table if row["knob"] == GRID]
    if not mine:
        return
    figure, axes = pyplot.subplots(figsize=(8.5, 5.5), layout="constrained")
    best = rows.front(mine)
    kinds = list(dict.fromkeys(kind(row) for row in mine))
    for name, colour in zip(kinds, pyplot.cm.tab10.colors):
        own = [row for row in mine if kind(row) == name]
        front = [row for row in own if row in best]
        axes.scatter(
            [row["ms_p50"] for row in own], [_db(row["psnr_min_db"]) for row in own], [_area(row) for row in own],
            marker=MARKERS[own[0]["machine"]], color=colour, alpha=0.3, label=name,
        )  # fmt: skip
        axes.scatter(
            [row["ms_p50"] for row in front], [_db(row["psnr_min_db"]) for row in front],
            [_area(row) for row in front], marker=MARKERS[own[0]["machine"]], color=colour, edgecolor="black",
        )  # fmt: skip
    for row in best:
        at = row["ms_p50"], _db(row["psnr_min_db"])
        text = rows.text(row["area_mm2"])
        axes.annotate(f"{text} mm2" if text else "", at, (3, -7), textcoords="offset points", fontsize=5)
    axes.plot([row["ms_p50"] for row in best], [_db(row["psnr_min_db"]) for row in best], "k-", lw=0.8, label="front")
    axes.set_xlabel("ms a frame (median)")
    axes.set_ylabel("PSNR of the worst frame, dB")
    axes.set_xscale("log")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7)
    axes.set_title(f"{_title(head)}: joint grid; faint points are dominated", fontsize=9)
    _save(figure, path)


def kind(row: dict) -> str:
    """Order of work of a point of the grid."""
    depth = next((pair for pair in row["set"].split() if pair.startswith("depth=")), "late sort")
    return f"{row['machine']}, {depth.replace('depth=', 'keys ')}"


def differences(path: Path, head: dict, table: list[dict], common: str) -> None:
    """difference.png: where the error of the last frame sits, with its scale."""
    pyplot = _pyplot()
    from matplotlib.colors import LogNorm

    shown = [row for value in SHOWN for row in table if row["value"] == value and row["knob"] != GRID]
    errors = [measure.last_error(common, row) for row in shown]
    columns = min(3, len(shown))
    lines = -(-len(shown) // columns)
    height, width = errors[0].shape
    figure, axes = pyplot.subplots(
        lines, columns, figsize=(4.2 * columns, (4.2 * height / width + 0.3) * lines), squeeze=False,
        layout="constrained",
    )  # fmt: skip
    for own in axes.ravel()[len(shown) :]:
        own.axis("off")
    for own, row, error in zip(axes.ravel(), shown, errors):
        picture = own.imshow(np.maximum(error, 1e-3), norm=LogNorm(0.01, 100), cmap="magma")
        own.set_title(f"{row['machine']}, {row['value']}: {error.max():.3g} LSB at most", fontsize=8)
        own.axis("off")
    figure.colorbar(picture, ax=axes, label="LSB (1/255), largest channel")
    figure.suptitle(f"{_title(head)}: distance of the last frame from the oracle", fontsize=9)
    _save(figure, path)


def _title(head: dict) -> str:
    return f"{head['scene']}, {'x'.join(map(str, head['size']))}, {head['motion']}"


def draw(folder: Path, head: dict, table: list[dict], common: str) -> None:
    """Every picture of a study."""
    overview(folder / "accuracy.png", head, table)
    widths(folder / "bits.png", head, table)
    grid(folder / "grid.png", head, table)
    differences(folder / "difference.png", head, table, common)
