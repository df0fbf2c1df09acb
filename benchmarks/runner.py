# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures pairs in up to two processes, then prints, writes and checks the results."""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np

from . import report, sheets
from .catalogue import ROOT, Catalogue, Pair
from .exact import exact_shape
from .measures import Judge
from .methods import METHODS, Contest
from .results import RESULTS, Results
from .verdict import RIVALRY, Verdict

DOCUMENT = ROOT / "docs/science/inbetweens.md"


def measure_pair(pair: Pair, methods: list[str], results: Results) -> str:
    """Run the methods on the pair and store figures and frames; return a line for the log."""
    faces, key0, key1 = pair.load()
    times = np.linspace(0.0, 1.0, results.inner_frames + 2)
    judge = Judge(faces, key0, key1)
    choices = {"engine": results.engine, "quality": results.quality, "extra_turns": pair.extra_turns}
    contest = Contest(faces, key0, key1, times, choices)
    said = []
    for method in methods:
        try:
            outcome = contest.run(method)
        except Exception as error:  # any failure is a result too, and the other pairs must still run
            said.append(f"{method}: {type(error).__name__}: {error}")
            results.store(pair, method, {"error": said[-1], "worst": {}, "details": {}})
            continue
        result: dict[str, Any] = judge.sequence(outcome.frames, times)
        distances = [
            float(np.linalg.norm(frame - exact, axis=1).max()) / judge.diagonal
            for time, frame in zip(times, outcome.frames, strict=True)
            if (exact := exact_shape(pair, key0, float(time))) is not None
        ]
        result |= {"exact_distance": max(distances, default=None)}
        result |= {"seconds": outcome.seconds, "details": outcome.details}
        results.store(pair, method, result)
        results.store_frames(pair, method, faces, times, outcome.frames)
        worst = result["worst"]
        said.append(
            f"{method}: {report.figure(worst['edge_excess_p99'])}, {report.figure(worst['volume_dev'])}, "
            f"{worst['intersections']} crossings, {outcome.seconds:.1f} s"
        )
    return f"{pair}  " + "  ".join(said)


def shortfalls(verdicts: list[Verdict]) -> list[str]:
    """Sentences on where `natural` misses a limit, or is visibly worse than a classical method."""
    found = []
    for verdict in verdicts:
        if "natural" not in verdict.figures:
            found.append(f"{verdict.pair}: natural was not measured")
            continue
        found += [f"{verdict.pair}: {miss}" for miss in verdict.misses()]
        found += [
            f"{verdict.pair}: {measure} worse than a classical method"
            for measure in RIVALRY
            if verdict.rivalry(measure) == "worse"
        ]
    return found


def arguments(argv: list[str] | None, description: str) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", nargs="+", metavar="FILE:FROM:TO", help="only these (default: every pair)")
    parser.add_argument("--listed", action="store_true", help="only the pairs that have limits")
    parser.add_argument(
        "--methods",
        nargs="+",
        choices=METHODS,
        default=list(METHODS),
        help="measure only these (tables hold whatever is stored)",
    )
    parser.add_argument("--engine", default="delaunay", help="what fills the cube for linear and natural")
    parser.add_argument("--quality", default="normal", help="how fine, for linear and natural")
    parser.add_argument("--frames", type=int, default=3, help="in-betweens, evenly spaced (default: 3)")
    parser.add_argument("--jobs", type=int, choices=(1, 2), default=1, help="processes")
    parser.add_argument("--work", type=Path, default=RESULTS, help="folder of the results")
    parser.add_argument("--stored", action="store_true", help="measure nothing, use what is there, old or new")
    parser.add_argument("--write", action="store_true", help=f"write tables and sheets of {DOCUMENT.name}")
    parser.add_argument("--check", action="store_true", help="exit status 1 where natural falls short")
    return parser.parse_args(argv)


def main(argv: list[str] | None = None, description: str = "") -> int:
    """Measure, print, write, check."""
    chosen = arguments(argv, description)
    catalogue = Catalogue()
    pairs = [catalogue.find(text) for text in chosen.pairs] if chosen.pairs else catalogue.pairs
    pairs = [pair for pair in pairs if pair.listed or not chosen.listed]
    results = Results(chosen.work, chosen.frames, chosen.engine, chosen.quality)
    missing = {
        pair: [method for method in chosen.methods if results.load(pair, method) is None]
        for pair in ([] if chosen.stored else pairs)
    }
    with ProcessPoolExecutor(chosen.jobs) as pool:
        jobs = [pool.submit(measure_pair, pair, methods, results) for pair, methods in missing.items() if methods]
        for job in as_completed(jobs):
            print(job.result(), flush=True)
    verdicts = [
        Verdict(pair, figures, catalogue.always)
        for pair in pairs
        if (
            figures := {
                method: result
                for method in METHODS
                if (result := results.load(pair, method, current=not chosen.stored)) is not None
            }
        )
    ]
    text = report.document(verdicts)
    print(text)
    if chosen.write:
        report.write_between_markers(DOCUMENT, text)
        for path in sheets.save(results, ROOT / "docs/images"):
            print(f"wrote {path}")
    if not chosen.check:
        return 0
    found = shortfalls(verdicts)
    print("\n".join(found) or "natural keeps every limit and is nowhere visibly worse than the classical methods.")
    return 1 if found else 0
