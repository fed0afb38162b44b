"""The pages of a report: one to be grasped in a minute, and one for each paper with curves of error against time."""

from __future__ import annotations

import csv
import io
import math
import os
import textwrap
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from ..io import replacing
from .rounds import Row, machine

__all__ = ["as_number", "as_time", "write"]

_PAGES = {
    "aoas": "Stylised skies (aoas)",
    "realistic_sky": "Day, twilight and night (realistic_sky)",
    "corot": "Painted landscapes (corot)",
    "inverse_clouds": "Clouds and their fits (inverse_clouds)",
    "image": "Histograms, thresholds and fills",
    "color": "Colour",
    "import": "Imports",
}


def as_number(x: float) -> str:
    """Two digits, a dash for what is not known."""
    return "–" if math.isnan(x) else "0" if x == 0 else f"{x:.2g}"


def as_time(seconds: float) -> str:
    """Three digits in the unit that suits them."""
    if math.isnan(seconds):
        return "–"
    for scale, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns")):
        if seconds >= scale:
            return f"{seconds / scale:.3g} {unit}"
    return f"{seconds:.3g} s"


def _error(row: Row) -> str:
    unit = "" if row.unit == "1" else f" {row.unit}"
    return "–" if math.isnan(row.error) else f"{as_number(row.error)}{unit}"


def _times(ratio: float) -> str:
    if math.isnan(ratio):
        return "–"
    return f"{ratio:.3g} ×" if ratio >= 0.1 else f"1/{1 / ratio:.3g}"


def write(rows: Iterable[Row], folder: str | os.PathLike[str], targets: Sequence[dict[str, Any]] = ()) -> None:
    """Write the pages, their figures and ``rows.csv`` into `folder`.

    Parameters
    ----------
    rows : iterable of Row
        What was measured.
    folder : path
        Where the files go; each is written beside its place and renamed.
    targets : sequence of dict
        Of ``benches/TARGETS.toml``: those with a ``headline`` stand on the first page.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write([Row("aoas", "b", "c", "ours", 1e-3, 0.0, "1", 1.0)], folder)
    ...     sorted(p.name for p in pathlib.Path(folder).iterdir())
    ['README.md', 'aoas.md', 'rows.csv']
    """
    table = list(rows)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    stream = io.StringIO()
    writer = csv.DictWriter(stream, [f.name for f in fields(Row)])
    writer.writeheader()
    writer.writerows(asdict(row) for row in table)
    _write(folder / "rows.csv", stream.getvalue())
    rooms = list(dict.fromkeys(row.room for row in table))
    for room in rooms:
        _page([row for row in table if row.room == room], folder, room)
    _write(folder / "README.md", _first_page(table, rooms, targets))


def _first_page(table: list[Row], rooms: list[str], targets: Sequence[dict[str, Any]]) -> str:
    lines = []
    for target in targets:
        if "headline" not in target:
            continue
        for row in table:
            named = row.task == target["task"] and target.get("input", row.input) == row.input
            if named and row.method.startswith(target.get("rival", target.get("method", "pleinair"))):
                ours = next((r for r in table if _place(r) == _place(row) and r.method.startswith("pleinair")), row)
                mark = "met" if row.met else "**missed**"
                faster = _times(row.ratio) if "ratio" in target else "–"
                rival = row.method if row is not ours else "the truth"
                cells = [target["headline"], rival, faster, _error(ours), _error(row), f"{row.goal} {mark}"]
                lines.append((bool(row.met), f"| {' | '.join(cells)} |"))
                break
    aimed = [row for row in table if row.met is not None]
    met = sum(bool(row.met) for row in aimed)
    text = [
        "# Speed against error",
        "",
        "Written by `make report`; do not edit. Faster: the rival's CPU time over ours, one thread, turn by turn on the same input",
        "in one run. Errors: of ours, of theirs, from the truth that the bench names.",
        "",
        "| what | against | faster | our error | their error | goal |",
        "|---|---|--:|--:|--:|---|",
        # What is missed stands first.
        *(line for _, line in sorted(lines, key=lambda pair: pair[0])),
        "",
        f"{met} of {len(aimed)} targets are met. Missed:",
        "",
        *(
            f"- {row.task}, {row.input}, {row.method}: "
            f"{f'error {_error(row)}' if row.goal.startswith('error') else _times(row.ratio)} ({row.goal})"
            for row in aimed
            if not row.met
        ),
        "",
        *(f"- [{_PAGES.get(room, room)}]({room}.md)" for room in rooms),
        "",
        f"Machine: {machine()}. `pleinair report --check` measures again and fails where a ratio has fallen beyond its noise;",
        "all numbers: [rows.csv](rows.csv).",
    ]
    return "\n".join(text) + "\n"


def _place(row: Row) -> tuple[str, str, str]:
    return row.room, row.task, row.input


def _page(rows: list[Row], folder: Path, room: str) -> None:
    text = [f"# {_PAGES.get(room, room)}", "", "Written by `make report`; do not edit."]
    groups: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        if row.family:
            groups.setdefault(_place(row), []).append(row)
    if groups:
        _figure(list(groups.values()), folder / f"{room}_settings.png", _curves)
        text += [
            "",
            "## Error against time",
            "",
            f"![error against time, by setting]({room}_settings.png)",
            "",
            "Each point is a setting of a method, named beside it; grey: below it the truth itself is not known.",
            f"`{_command(r for g in groups.values() for r in g)}`",
        ]
    grown: dict[str, list[Row]] = {}
    for row in rows:
        if math.isfinite(row.size):
            grown.setdefault(row.task, []).append(row)
    grown = {task: members for task, members in grown.items() if len({r.size for r in members}) > 1}
    if grown:
        _figure(list(grown.values()), folder / f"{room}_growth.png", _growth)
        text += [
            "",
            "## How cost grows",
            "",
            f"![time against size]({room}_growth.png)",
            "",
            "In the legend the exponent of time in size, by least squares.",
            f"`{_command(r for g in grown.values() for r in g)}`",
        ]
    text += [
        "",
        "## All rows",
        "",
        "| task | input | method | time | error | ratio | memory | goal |",
        "|---|---|---|--:|--:|--:|--:|---|",
    ]
    for row in rows:
        mark = "" if row.met is None else " met" if row.met else " **missed**"
        memory = f"{row.memory / 1e6:.0f} MB" if math.isfinite(row.memory) else ""
        ratio = as_number(row.ratio) if math.isnan(row.ratio) else format(row.ratio, ".3g")
        cells = [row.task, row.input, row.method, as_time(row.seconds), _error(row), ratio, memory, row.goal + mark]
        text.append(f"| {' | '.join(cells)} |")
    text += ["", f"`{_command(rows)}`"]
    _write(folder / f"{room}.md", "\n".join(text) + "\n")


def _write(path: Path, text: str) -> None:
    replacing(path, lambda stream: stream.write(text.encode()))


def _command(rows: Iterable[Row]) -> str:
    benches = dict.fromkeys(row.bench.removeprefix("bench_") for row in rows if row.bench)
    return "; ".join(f"pleinair report --only {bench}" for bench in benches) or "pleinair report"


def _figure(groups: list[list[Row]], path: Path, draw: Callable[[Any, list[Row]], None]) -> None:
    import matplotlib as mpl

    mpl.use("Agg", force=False)
    import matplotlib.pyplot as plt
    from matplotlib.ticker import NullFormatter

    columns = min(3, len(groups))
    high = math.ceil(len(groups) / columns)
    figure, axes = plt.subplots(high, columns, figsize=(4.4 * columns, 3.4 * high), squeeze=False, layout="constrained")
    for axis in axes.flat[len(groups) :]:
        axis.set_visible(False)
    for axis, members in zip(axes.flat, groups, strict=False):
        axis.set(xscale="log", yscale="log")
        draw(axis, members)
        for each in (axis.xaxis, axis.yaxis):
            each.set_minor_formatter(NullFormatter())
        axis.tick_params(labelsize=7)
        axis.grid(alpha=0.3)
        axis.legend(fontsize=6.5)
    replacing(path, lambda stream: figure.savefig(stream, dpi=85, format="png"))
    plt.close(figure)


def _lines(members: list[Row], name: Callable[[Row], str]) -> dict[str, list[Row]]:
    """Rows of each curve, ours first."""
    found: dict[str, list[Row]] = {}
    for row in members:
        found.setdefault(name(row), []).append(row)
    return dict(sorted(found.items(), key=lambda item: not item[0].startswith("pleinair")))


def _curves(axis: Any, members: list[Row]) -> None:
    seen = [row for row in members if row.seconds > 0 and not math.isnan(row.error)]
    least = min((row.error for row in seen if row.error > 0), default=1e-8) / 3
    for k, (family, points) in enumerate(_lines(seen, lambda row: row.family).items()):
        x, y = [p.seconds for p in points], [max(p.error, least) for p in points]
        axis.plot(x, y, "o-", ms=5 if k == 0 else 3.5, lw=2 if k == 0 else 1, label=family, zorder=3 - 0.1 * k)
        for p, at, error in zip(points, x, y, strict=True):
            axis.annotate(p.setting, (at, error), fontsize=6, xytext=(3, 3), textcoords="offset points")
    floor = members[0].floor
    if math.isfinite(floor) and floor > 0:
        axis.axhspan(min(least, floor / 3), floor, color="0.85", zorder=0)
    unit = "" if members[0].unit == "1" else f" [{members[0].unit}]"
    axis.set_title(textwrap.fill(f"{members[0].task}, {members[0].input}", 52), fontsize=8)
    axis.set_xlabel("CPU time of a call [s]", fontsize=7)
    axis.set_ylabel(f"error{unit}", fontsize=7)


def _growth(axis: Any, members: list[Row]) -> None:
    for k, (method, points) in enumerate(_lines(members, lambda row: row.family or row.method).items()):
        points = sorted((p for p in points if p.seconds > 0), key=lambda p: p.size)
        if len(points) < 2:
            continue
        x, y = [math.log(p.size) for p in points], [math.log(p.seconds) for p in points]
        mx, my = sum(x) / len(x), sum(y) / len(y)
        slope = sum((a - mx) * (b - my) for a, b in zip(x, y, strict=True)) / sum((a - mx) ** 2 for a in x)
        label = f"{method}: {slope:.2f}"
        axis.plot([p.size for p in points], [p.seconds for p in points], "o-", ms=4, lw=2 if k == 0 else 1, label=label)
    axis.set_title(textwrap.fill(members[0].task, 52), fontsize=8)
    axis.set_xlabel(members[0].size_unit, fontsize=7)
    axis.set_ylabel("CPU time of a call [s]", fontsize=7)
