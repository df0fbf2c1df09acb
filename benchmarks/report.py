# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Markdown tables of the results."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .catalogue import EXTRA_TURNS
from .methods import METHODS
from .verdict import CLASSICAL, RIVALRY, Verdict, always_measure

WRITER = "benchmarks/inbetweens.py"
BEGIN, END = (f"<!-- {place}: written by {WRITER} -->" for place in ("begin", "end"))
NAMES = {
    "straight": "straight", "rotational": "arcs", "smooth": "smooth", "surface": "ARAP surface", "poisson": "Poisson",
    "arap": "ARAP", "linear": "`linear`", "natural": "`natural`",
}  # fmt: skip
ORDER = METHODS


def figure(value: float | None) -> str:
    """A relative measure with two or three significant digits."""
    if value is None:
        return "-"
    return "0" if value < 5e-6 else f"{value:.2g}" if value < 0.1 else f"{value:.3f}"


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def measure_table(verdicts: Sequence[Verdict], measure: str) -> str:
    """Table of one measure: all methods, the limit, and whether `natural` is better than the classical methods."""
    methods = [method for method in ORDER if any(method in verdict.figures for verdict in verdicts)]
    rows = []
    for verdict in verdicts:
        limit = verdict.limits.get(measure)
        cells = [figure(verdict.worst(method, measure)) for method in methods]
        rows.append([_name(verdict), *cells, figure(limit)])
        if "natural" in methods:
            rows[-1].append(verdict.rivalry(measure) if "natural" in verdict.figures else "-")
    header = ["pair", *(NAMES[method] for method in methods), "limit"]
    return table(header + ["against Poisson, ARAP"] * ("natural" in methods), rows)


def crossings_table(verdicts: Sequence[Verdict]) -> str:
    """Table of the most new crossings of all methods in an inner frame."""
    rows = []
    for verdict in verdicts:
        found = [verdict.worst(method, "intersections") for method in ORDER]
        rows.append([_name(verdict), *("-" if count is None else f"{count:.0f}" for count in found)])
    return table(["pair", *(NAMES[method] for method in ORDER)], rows)


def seconds_table(verdicts: Sequence[Verdict]) -> str:
    """Table of the seconds that all methods took for all frames; ours with what the fit takes."""
    rows = []
    for verdict in verdicts:
        figures = [verdict.figures.get(method, {}).get("seconds") for method in ORDER]
        rows.append([_name(verdict), *("-" if value is None else f"{value:.2f}" for value in figures)])
    return table(["pair", *(NAMES[method] for method in ORDER)], rows)


def _name(verdict: Verdict) -> str:
    return f"{verdict.pair.file} {verdict.pair.first} → {verdict.pair.second}"


def health_table(verdicts: Sequence[Verdict], method: str = "natural") -> str:
    """Table of what must always hold, and of the cost."""
    rows = []
    for verdict in verdicts:
        result = verdict.figures.get(method)
        if result is None:
            continue
        name = _name(verdict)
        if "error" in result:
            rows.append([name, *["-"] * 9, verdict.misses(method)[0]])
            continue
        report = result["details"]["report"]
        worst = result["worst"]
        rows.append([
            name,
            str(report["tetrahedra"]),
            str(report["folds"]["map"]),
            " ".join(str(count) for count in report["folds"]["frames"]),
            f"{report['residual']['max']:.1e}",
            "-" if worst["intersections"] is None else str(worst["intersections"]),
            "-" if worst["still_drift"] is None else f"{worst['still_drift']:.0e}",
            f"{always_measure(result, 'key_error'):.0e}",
            f"{result['jerk']:.2f}",
            f"{result['seconds']:.0f}",
            "; ".join(verdict.misses(method)) or "all kept",
        ])  # fmt: skip
    header = [
        "pair", "tetrahedra", "folds of the map", "folds per frame", "largest residual", "new crossings", "still drift",
        "key error", "jerk", "seconds", "limits",
    ]  # fmt: skip
    return table(header, rows)


def exact_table(verdicts: Sequence[Verdict]) -> str:
    """Table of the largest distance from the exact in-betweens, where these are known."""
    known = [v for v in verdicts if any(figures.get("exact_distance") is not None for figures in v.figures.values())]
    methods = [method for method in ORDER if any(method in verdict.figures for verdict in known)]
    rows = [
        [verdict.pair.second, *(figure(verdict.figures.get(method, {}).get("exact_distance")) for method in methods)]
        for verdict in known
    ]
    return table(["bar", *(NAMES[method] for method in methods)], rows)


def document(verdicts: Sequence[Verdict]) -> str:
    """Everything between the markers of the document."""
    listed = [verdict for verdict in verdicts if verdict.pair.listed]
    further = [verdict for verdict in verdicts if not verdict.pair.listed]
    parts = [summary(verdicts)] if any("natural" in verdict.figures for verdict in verdicts) else []
    titles = {"edge_excess_p99": "Lengths (`edge_excess_p99`)", "volume_dev": "Volume (`volume_dev`)"}
    for heading, chosen in (("Pairs with limits", listed), ("Further pairs", further)):
        if chosen:
            parts.append(f"## {heading}")
            for measure in RIVALRY:
                parts += [f"### {titles[measure]}", measure_table(chosen, measure)]
            parts += ["### New crossings", crossings_table(chosen)]
            parts += ["### Seconds for five frames", seconds_table(chosen)]
            if any("natural" in verdict.figures for verdict in chosen):
                parts += ["### What must always hold, of `natural`", health_table(chosen)]
    if any(verdict.pair.file == "bar" for verdict in verdicts):
        parts += ["## Distance from the exact in-betweens of the bar", exact_table(verdicts)]
    return "\n\n".join(parts)


def summary(verdicts: Sequence[Verdict]) -> str:
    """Counts in one sentence each."""
    ours = [v for v in verdicts if "natural" in v.figures]
    revisions = sorted({verdict.figures["natural"]["revision"] for verdict in ours})
    lines = [
        f"- Measured at {', '.join(revisions)}.",
        "- Extra turns asked for by option: "
        + ", ".join(f"{turns:+d} on {pair}" for pair, turns in EXTRA_TURNS.items())
        + ".",
        f"- `natural` keeps every limit on {sum(not v.misses() for v in ours)} of {len(ours)} pairs.",
    ]
    for measure, name in zip(RIVALRY, ("lengths", "volume"), strict=True):
        said: list[Any] = [state for v in ours if (state := v.rivalry(measure)) != "-"]
        lines.append(
            f"- Against {' and '.join(NAMES[one] for one in CLASSICAL)}, where they were run, in {name}: better on "
            f"{said.count('better')} of {len(said)} pairs, not better but below the visible floor on "
            f"{said.count('below floor')}, worse on {said.count('worse')}."
        )
    return "\n".join(lines)


def write_between_markers(path: Path, text: str, writer: str = WRITER) -> None:
    """Replace the text between the markers of a document that name the writer."""
    begin, end = (marker.replace(WRITER, writer) for marker in (BEGIN, END))
    whole = path.read_text(encoding="utf-8")
    before, found, rest = whole.partition(begin)
    _, closed, after = rest.partition(end)
    if not found or not closed:
        raise SystemExit(f"{path} has no lines {begin!r} and {end!r} to write between.")
    path.write_text(f"{before}{begin}\n\n{text}\n\n{end}{after}", encoding="utf-8")
