# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Times of all stages of a bake, each case in a process of its own.

    python -m benchmarks.stages                                  # real pairs, both engines, against the yardstick
    python -m benchmarks.stages --growth                         # the limb that a sphere becomes, 1k to 200k vertices
    python -m benchmarks.stages --small                          # meshes of 8 to 800 vertices
    python -m benchmarks.stages --methods                        # real pairs by other methods, processor seconds
    python -m benchmarks.stages --against HEAD~3 [--cases ...]   # two revisions in turn, ratios by stage
    python -m benchmarks.stages --write                          # the tables of docs/science/speed.md

The yardstick is the time of fTetWild with its own defaults on the same surface, in the same run.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from .catalogue import DATA, ROOT
from .methods import METHODS
from .report import NAMES, table, write_between_markers
from .stage_cases import LIMITS, SIZES, SMALL

DOCUMENT = ROOT / "docs/science/speed.md"
STAGES = ("mesh", "locate", "path", "fit", "factor", "frames", "measure", "write")
_ROUNDS = 3


def main(argv: list[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+", default=list(LIMITS), help="like body:rest:t_pose or limb:10000")
    parser.add_argument("--engines", nargs="+", default=["delaunay", "tetwild"])
    parser.add_argument("--frames", type=int, default=24, help="in-betweens (default: 24)")
    parser.add_argument("--growth", action="store_true", help="the limb in all sizes, delaunay engine")
    parser.add_argument("--small", action="store_true", help="meshes of 8 to 800 vertices of several kinds")
    parser.add_argument("--methods", action="store_true", help="other methods beside QC3D, one thread each")
    parser.add_argument("--against", metavar="REVISION", help="compare with another revision, alternating")
    parser.add_argument("--write", action="store_true", help=f"put the table into {DOCUMENT.name}")
    chosen = parser.parse_args(argv)
    if chosen.against:
        compare(chosen.against, chosen.cases, chosen.engines, chosen.frames)
        return
    option = next((name for name in ("growth", "small", "methods") if getattr(chosen, name)), None)
    tables: dict[str, Callable[[int], str]]
    tables = {"growth": growth, "small": small, "methods": partial(by_method, chosen.cases)}
    text = pairs(chosen) if option is None else tables[option](chosen.frames)
    print(text)
    if chosen.write:
        write_between_markers(DOCUMENT, text, "benchmarks/stages.py" + ("" if option is None else f" --{option}"))


def run(case: str, *arguments: object, root: Path = ROOT) -> dict[str, Any]:
    """One measurement in a process of its own, with BLAS in one thread as in a bake."""
    command = [sys.executable, "-m", "benchmarks.stage_run", case, *(str(argument) for argument in arguments)]
    one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    environment = os.environ | {"PYTHONPATH": str(root), "QC3D_DATA": str(DATA)}
    environment |= {} if "yardstick" in arguments else one_thread
    output = subprocess.run(command, cwd=root, env=environment, check=True, capture_output=True, text=True).stdout
    found: dict[str, Any] = json.loads(output.splitlines()[-1])
    return found


def pairs(chosen: argparse.Namespace) -> str:
    """The table of real pairs."""
    rows = []
    for case in chosen.cases:
        yardstick = run(case, "yardstick")["yardstick"] if case in LIMITS else None
        for engine in chosen.engines:
            found = run(case, engine, chosen.frames, "one")
            cells = [case.replace(":", " "), engine, *_stage_cells(found), f"{found['cold']:.1f}"]
            if yardstick:
                share, limit = found["cold"] / yardstick, LIMITS[case][engine]
                cells += [f"{yardstick:.0f}", f"{share:.2f} (limit {limit})"]
            else:
                cells += ["", ""]
            cells += [f"{found['warm']:.2f}", _times(found["warm"], found["count"] * found["floor"])]
            cells += [f"{1e3 * found['one']:.0f}", f"{1e3 * found['floor']:.0f}", _times(found["one"], found["floor"])]
            cells += [f"{1e3 * found['floor_alone']:.0f}", f"{found['peak_mb']:.0f}", str(found["folds"])]
            rows.append(cells)
    head = ["pair", "engine", *STAGES, "cold", "Y", "cold / Y", "warm", "/ floors"]
    return table([*head, "one, ms", "floor, ms", "/ floor", "alone, ms", "MB", "folds"], rows)


def growth(frames: int) -> str:
    """The table of the limb in all sizes."""
    rows = []
    for size in SIZES:
        found = run(f"limb:{size}", "delaunay", frames)
        rows.append([f"{size:,}", str(found["tetrahedra"]), *_stage_cells(found), f"{found['cold']:.1f}"])
        rows[-1] += [f"{found['peak_mb']:.0f}", str(found["folds"])]
    return table(["vertices", "tetrahedra", *STAGES, "cold", "MB", "folds"], rows)


def small(frames: int) -> str:
    """The table of small meshes: medians of a few first bakes, each in a process of its own."""
    rows = []
    for case in SMALL:
        runs = [run(case, "delaunay", frames) for _ in range(_ROUNDS)]
        middle = {name: median(one[name] for one in runs) for name in ("tetrahedra", "cold_processor", "cold")}
        kind, count = case.split(":")
        rows.append([kind, count, f"{middle['tetrahedra']:.0f}", f"{middle['cold_processor']:.2f}"])
        rows[-1] += [f"{middle['cold']:.2f}", f"{max(one['folds'] for one in runs)}"]
    return table(["kind", "vertices", "tetrahedra", "processor s", "s", "folds"], rows)


def by_method(cases: list[str], frames: int) -> str:
    """The table of what other methods take for the same in-betweens, and how much that is beside mode natural."""
    rows = []
    for case in cases:
        seconds = {method: run(case, method, frames, "method")["processor"] for method in METHODS}
        ours = seconds["natural"]
        cells = (
            "-" if value is None else f"{value:.2f}" if value is ours else f"{value:.2f} ({value / ours:.2g})"
            for value in seconds.values()
        )
        rows.append([case.replace(":", " "), *cells])
    return table(["pair", *(NAMES[method] for method in METHODS)], rows)


def compare(revision: str, cases: list[str], engines: list[str], frames: int) -> None:
    """Print, for each stage, the median ratio of this revision's time to the other's; the two run alternately."""
    with tempfile.TemporaryDirectory(prefix="qc3d-") as name:
        other = Path(name) / "other"
        subprocess.run(["git", "worktree", "add", "--detach", "--quiet", str(other), revision], cwd=ROOT, check=True)
        try:
            # The other revision is measured with this revision's benchmark.
            for file in ("stage_run.py", "stage_cases.py"):
                (other / "benchmarks" / file).write_bytes((ROOT / "benchmarks" / file).read_bytes())
            rows = []
            for case in cases:
                for engine in engines:
                    turns = [[run(case, engine, frames, root=root) for root in (ROOT, other)] for _ in range(_ROUNDS)]
                    cells = [case, engine]
                    for stage in ("cold", "warm", *(f"stage_{stage}" for stage in STAGES)):
                        ratios = [ours[stage] / theirs[stage] for ours, theirs in turns if theirs.get(stage)]
                        cells.append(f"{median(ratios):.2f}" if ratios else "")
                    rows.append(cells)
            print(table(["pair", "engine", "cold", "warm", *STAGES], rows))
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", str(other)], cwd=ROOT, check=True)


def _stage_cells(found: dict[str, Any]) -> list[str]:
    return [f"{found[f'stage_{stage}']:.2f}" if f"stage_{stage}" in found else "" for stage in STAGES]


def _times(value: float, floor: float) -> str:
    return f"{value / floor:.1f}×"


if __name__ == "__main__":
    main()
