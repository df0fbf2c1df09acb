# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Many keys of one base in one run, beside as many bakes of their own.

    python -m benchmarks.keys                     # 20 keys of the head, made of its shapes and their parts
    python -m benchmarks.keys --keys 52 --only run
    python -m benchmarks.keys --write             # the table of docs/science/speed.md

Every bake and the run take place in child processes, as in Blender. Without the head, the keys are bumps and turned
parts of a sphere with 10,000 vertices. The frames of the run are compared with those of the bakes, and these with
bakes of another seed, whose tetrahedra are others too.
"""

from __future__ import annotations

import argparse
import os
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from qc3d_addon.solver.frames.many import Run
from qc3d_addon.solver.frames.task import Outcome, Task
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.settings import FitOptions, PlayOptions
from qc3d_addon.solver.triangles.polygons import flat_quads
from qc3d_addon.worker import client

from .catalogue import DATA, ROOT, Floats, Ints
from .report import table, write_between_markers
from .stage_cases import limb

DOCUMENT = ROOT / "docs/science/speed.md"
IN_BETWEENS = 3
_FADING = 0.2  # of the size: width of the border between parts of a key
_SPHERE = 10_000

T = TypeVar("T")


@dataclass(frozen=True)
class Taken:
    """What a piece of work took: seconds on the clock, seconds of the processors, and the largest peak in megabytes."""

    seconds: float
    processor: float
    megabytes: float


def main(argv: list[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keys", type=int, default=20, metavar="N", help="number of keys (default: 20)")
    parser.add_argument("--only", choices=("run",), help="leave out the bakes of their own")
    parser.add_argument("--write", action="store_true", help=f"put the table into {DOCUMENT.name}")
    chosen = parser.parse_args(argv)
    name, faces, base, keys = library(chosen.keys)
    text = measured(name, faces, base, keys, with_single=chosen.only is None)
    print(text)
    if chosen.write:
        write_between_markers(DOCUMENT, text, "benchmarks/keys.py")


def library(count: int) -> tuple[str, Ints, Floats, list[Floats]]:
    """A mesh with keys: its name, triangles (m, 3), base (n, 3), and the keys (n, 3)."""
    if (DATA / "head.npz").exists():
        with np.load(DATA / "head.npz", allow_pickle=False) as stored:
            shapes = [stored[f"V{number}"].astype(np.float64) for number in range(len(stored["shape_names"]))]
            return "head", stored["faces"].astype(np.int64), shapes[0], parts_of(shapes[0], shapes[1:], count)
    faces, sphere, _ = limb(_SPHERE)
    return "sphere", faces, sphere, caps_of(sphere, count)


def parts_of(base: Floats, shapes: Sequence[Floats], count: int) -> list[Floats]:
    """Keys that show each shape whole, on one side, above or below only, then all of these weaker."""
    low, size = base.min(axis=0), np.ptp(base, axis=0)
    place = (base - low) / size - 0.5
    side, height = (np.clip(0.5 + place[:, axis] / _FADING, 0.0, 1.0) for axis in (0, 1))
    masks = [np.ones(len(base)), *(soft for part in (side, height) for soft in (part, 1.0 - part))]
    masks = [mask * mask * (3.0 - 2.0 * mask) for mask in masks]
    made: list[Floats] = []
    strength = 1.0
    while len(made) < count:
        made += [base + strength * mask[:, None] * (shape - base) for mask in masks for shape in shapes]
        strength *= 0.8
    return made[:count]


def caps_of(sphere: Floats, count: int) -> list[Floats]:
    """Keys that turn a cap of a sphere and raise it, each at another place."""
    random = np.random.default_rng(0)
    made = []
    for axis in random.normal(size=(count, 3)):
        axis /= np.linalg.norm(axis)
        fading = np.clip((sphere @ axis - 0.5) / 0.3, 0.0, 1.0)[:, None]
        turned = np.einsum("nij,nj->ni", rotation_matrices(1.2 * fading * axis), sphere)
        made.append(turned + 0.2 * fading**2 * axis)
    return made


def measured(name: str, faces: Ints, base: Floats, keys: Sequence[Floats], with_single: bool = True) -> str:
    """The table of one run and of as many bakes of their own."""
    quads = flat_quads([base, *keys], faces)
    tasks = [_task(faces, base, key, quads) for key in keys]
    together, run = _timed(lambda: client.run(Run.of(tasks)))
    outcomes = [_whole(outcome) for outcome in together]
    run = replace(run, megabytes=_peak(outcomes))
    rows = [[f"{name}, {len(base):,} vertices", str(len(keys)), "in one run", *_cells(run), "", "", ""]]
    if with_single:
        alone, single = _timed(lambda: [client.run(task) for task in tasks])
        single = replace(single, megabytes=_peak(alone))
        seeded = [client.run(replace(task, fit_options=FitOptions(seed=1))) for task in tasks]
        size = float(np.linalg.norm(np.ptp(base, axis=0)))
        apart = _apart(outcomes, alone) / size
        ratios = [f"{run.seconds / single.seconds:.2f}", f"{run.processor / single.processor:.2f}"]
        rows[0][-3:] = [*ratios, f"{apart:.1e}"]
        rows.append(["", str(len(keys)), "bakes of their own", *_cells(single), "1", "1", ""])
        rows.append(["", "", "with another seed", "", "", "", "", "", f"{_apart(seeded, alone) / size:.1e}"])
    head = ["mesh", "keys", "", "s", "CPU s", "MB", "s / bakes", "CPU s / bakes", "frames differ by"]
    return table(head, rows)


def _task(faces: Ints, base: Floats, key: Floats, quads: Ints) -> Task:
    task = Task.of_keys({"base": base, "key": key}, faces, None, ("base", "key"), polygons=quads, mirror="none")
    return replace(task, play=PlayOptions(IN_BETWEENS))


def _timed(work: Callable[[], T]) -> tuple[T, Taken]:
    before, started = os.times(), clock.perf_counter()
    result = work()
    after = os.times()
    spent = after.children_user + after.children_system - before.children_user - before.children_system
    return result, Taken(clock.perf_counter() - started, spent, 0.0)


def _whole(outcome: object) -> Outcome:
    if not isinstance(outcome, Outcome):
        raise SystemExit(f"A key was not baked: {outcome}")
    return outcome


def _peak(outcomes: Sequence[Outcome]) -> float:
    return max(outcome.bake.report.peak_memory_mb or 0.0 for outcome in outcomes if outcome.bake is not None)


def _apart(first: Sequence[Outcome], second: Sequence[Outcome]) -> float:
    """The largest distance between the frames of bakes."""
    largest = 0.0
    for one, other in zip(first, second, strict=True):
        assert one.bake is not None
        assert other.bake is not None
        largest = max(largest, float(np.linalg.norm(one.bake.frames - other.bake.frames, axis=2).max()))
    return largest


def _cells(taken: Taken) -> list[str]:
    return [f"{taken.seconds:.1f}", f"{taken.processor:.1f}", f"{taken.megabytes:.0f}"]


if __name__ == "__main__":
    main()
