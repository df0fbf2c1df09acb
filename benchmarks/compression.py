# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes of maps and frames at equal error, by QC3D and by other ways, as Markdown tables.

    pip install "qc3d[benchmark]"
    python -m benchmarks.compression --data FOLDER [--errors 1e-3] [--only maps|frames] [--write]

FOLDER contains head.npz, body.npz and horse.npz. ``--write`` puts all tables into docs/reference/compression.md.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple, get_args

import numpy as np

from benchmarks.catalogue import ROOT
from benchmarks.report import write_between_markers
from benchmarks.rivals import Rivals
from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.compression.codec import Codec
from qc3d_addon.solver.compression.compressed import Scheme
from qc3d_addon.solver.compression.files import Packer, Source
from qc3d_addon.solver.compression.pack import Small, diagonal_of, small_frames, small_maps
from qc3d_addon.solver.compression.search import Compressor
from qc3d_addon.solver.errors import ReconstructionError
from qc3d_addon.solver.frames.bake_settings import Settings
from qc3d_addon.solver.frames.key_times import KeyTimes
from qc3d_addon.solver.frames.remade import small_bake
from qc3d_addon.solver.frames.task import Task, carry_out
from qc3d_addon.solver.keys.files import read_pairs
from qc3d_addon.solver.settings import FrameOptions
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.solver.tets.mesh import TetMesh
from qc3d_paper.experiments import shapes

DOCUMENT = ROOT / "docs/reference/compression.md"
ERRORS = (1e-2, 3e-3, 1e-3, 1e-4, 1e-5)
COUNTS = (16, 60)  # of modes
HORSE = shapes.Pose("horse.npz", "", "bind", "Gallop_0", "y")
MAPS = (shapes.DATA_FACES[1], shapes.DATA_BODIES[2], HORSE)
CHAINS = ((("rest", "arms_overhead"), 24), (("rest", "t_pose", "arms_overhead"), 3))

OfError = Callable[[float], Small]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--errors", type=float, nargs="+", default=ERRORS, metavar="E")
    chosen = parser.add_mutually_exclusive_group()
    chosen.add_argument("--only", choices=("maps", "frames"))
    chosen.add_argument("--write", action="store_true", help=f"write the tables of {DOCUMENT.name}")
    arguments = parser.parse_args()
    wanted, page = arguments.errors, Page([])
    for pose in MAPS if arguments.only != "frames" else ():
        fitted = shapes.fitted(shapes.read(pose, arguments.data))
        mesh, targets = fitted.mesh, fitted.mapped[None]
        ways: dict[str, OfError] = {"**QC3D**": partial(_small_map, mesh, targets)}
        _compare(page, f"Map {pose.label}, {len(mesh.points)} vertices", mesh.points, targets, ways, wanted)
        _compare_named(page, mesh, targets)
    for through, between in CHAINS if arguments.only != "maps" else ():
        frames, faces, settings, polygons = _baked(arguments.data / "body.npz", through, between)
        ways = {
            "**QC3D**": partial(_small_bake, frames, faces, settings, polygons),
            "QC3D, scheme stored": partial(_small_frames, frames, faces),
        }
        label = f"{len(frames) - 1} frames of a body of {len(frames[0])} vertices, {' → '.join(through)}"
        _compare(page, label, frames[0], frames[1:], ways, wanted)
    if arguments.write:
        write_between_markers(DOCUMENT, "\n".join(page.lines).strip(), "benchmarks/compression.py")


class Page(NamedTuple):
    """The lines that were printed."""

    lines: list[str]

    def say(self, line: str = "") -> None:
        """Print a line and keep it."""
        print(line, flush=True)
        self.lines.append(line)

    def row(self, name: str, cells: Sequence[str]) -> None:
        """Print a row of a table and keep it."""
        self.say("| " + " | ".join([name, *cells]) + " |")


def _small_map(mesh: TetMesh, targets: Floats, error: float) -> Small:
    return finish(small_maps(mesh, targets, error))


def _small_bake(frames: Floats, faces: Ints, settings: Settings, polygons: Ints, error: float) -> Small:
    return finish(small_bake(frames, faces, error, settings, polygons))


def _small_frames(frames: Floats, faces: Ints, error: float) -> Small:
    return finish(small_frames(frames, faces, error))


def _baked(path: Path, through: Sequence[str], between: int) -> tuple[Floats, Ints, Settings, Ints]:
    pairs = read_pairs(path, through)
    times = KeyTimes.of(FrameOptions(), len(through) - 1).between(between)
    task = Task(pairs, tuple(through), times=times)
    bake = finish(carry_out(task)).bake
    assert bake is not None
    settings, pair = Settings.of_task(task, bake.frames), next(iter(pairs.values()))
    assert settings is not None
    return bake.frames, pair.faces, settings, pair.polygons


def _compare(
    page: Page, label: str, points: Floats, targets: Floats, ways: dict[str, OfError], wanted: Sequence[float]
) -> None:
    unit = diagonal_of(points)
    moved = targets - points
    rivals = Rivals(points, moved, unit)
    still = float(np.sqrt((moved**2).sum(axis=2).mean(axis=1).max())) / unit
    errors = [error for error in wanted if error < still]  # above it nothing need be stored
    page.say(f"\n**{label}** ({4 * moved.size:,} bytes raw; {still:.1e} without anything)\n")
    page.row("bytes", [f"{error:.0e}" for error in errors])
    page.say("|---" * (len(errors) + 1) + "|")
    notes: dict[str, list[str]] = {}
    for name, way in ways.items():
        cells = []
        for error in errors:
            start = time.process_time()
            small = way(error)
            cells.append(f"**{len(small.data)}**" if name.startswith("**") else str(len(small.data)))
            folds = f", {sum(small.folds)} folds" if small.folds else ""
            notes.setdefault(name, []).append(f"{small.way}, {time.process_time() - start:.1f} s{folds}")
        page.row(name, cells)
    others = [rivals.sizes(error) for error in errors]
    for name in others[0]:
        page.row(name, ["not installed" if sizes[name] is None else str(sizes[name]) for sizes in others])
    for name, cells in notes.items():
        page.row(f"how, and seconds of one core: {name.strip('*')}", cells)


def _compare_named(page: Page, mesh: TetMesh, targets: Floats) -> None:
    """Modes alone by the schemes that have names, and what the smallest way needs for the same error."""
    page.say()
    page.row("scheme, modes", ["error", "bytes", "folds", "seconds", "QC3D at that error", "folds"])
    page.say("|---" * 7 + "|")
    packer = Packer(Source("maps", mesh.points, mesh.tets), max(COUNTS))
    for scheme in get_args(Scheme):
        compressor = Compressor(Codec(mesh, max(COUNTS), scheme), targets, packer)
        for count in COUNTS:
            start = time.process_time()
            try:
                choice = compressor.with_modes(count)
            except ReconstructionError:
                page.row(f"{scheme}, {count}", ["no map"] * 6)
                continue
            seconds = time.process_time() - start
            small = _small_map(mesh, targets, choice.error)
            cells = [choice.size, sum(choice.folds), f"{seconds:.0f}", len(small.data), sum(small.folds)]
            page.row(f"{scheme}, {count}", [f"{choice.error:.1e}", *map(str, cells)])


if __name__ == "__main__":
    main()
