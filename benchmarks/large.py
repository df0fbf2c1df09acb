# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory and time of bakes of large meshes (Linux).

    python -m benchmarks.large [VERTICES ...] [--engine ENGINE] [--quality QUALITY] [--frames FRAMES]

The body of the data folder is subdivided until it has about the given number of vertices. The bake runs in a child
process, as in Blender. The memory is the peak of the proportional set sizes (PSS) of all descendants of this process.
"""

from __future__ import annotations

import argparse
import os
import sys
import threading
import time as clock
from pathlib import Path

import numpy as np

from qc3d_addon.solver.frames.bake import evenly_spaced
from qc3d_addon.solver.frames.task import Task
from qc3d_addon.solver.keys.files import read_pair
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import Progress
from qc3d_addon.solver.triangles.topology import sides
from qc3d_addon.worker import client

from .catalogue import DATA

SIZES = (6_890, 27_554, 110_210, 440_834)
KEYS = ("rest", "arms_overhead")
_PAUSE = 0.05


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("vertices", nargs="*", type=int, default=SIZES)
    parser.add_argument("--engine", default="tetwild")
    parser.add_argument("--quality", default="normal")
    parser.add_argument("--frames", type=int, default=5, help="in-betweens (default: 5)")
    chosen = parser.parse_args()
    options = FitOptions(engine=chosen.engine, quality=chosen.quality)
    print("| vertices | engine | s | MB | seconds by stage |")
    print("|---|---|---|---|---|")
    for wanted in chosen.vertices:
        pair = divided(read_pair(DATA / "body.npz", *KEYS), wanted)
        task = Task({KEYS: pair}, KEYS, options, times=evenly_spaced(chosen.frames))
        started = clock.perf_counter()
        with PeakMemory() as peak:
            bake = client.run(task, peak.note).bake
        assert bake is not None
        stages = ", ".join(f"{name} {seconds:.0f}" for name, seconds in bake.report.seconds.items())
        taken = clock.perf_counter() - started
        print(f"| {len(pair.key0)} | {bake.report.engine} | {taken:.0f} | {peak.megabytes:.0f} | {stages} |")
        print(f"  by stage: {peak.stages}", file=sys.stderr, flush=True)


def divided(pair: KeyPair, vertices: int) -> KeyPair:
    """The pair with every triangle split into four, repeatedly, until it has at least the given number of vertices."""
    key0, key1, faces = pair.key0, pair.key1, pair.faces
    while len(key0) < vertices:
        edges, place = np.unique(np.sort(sides(faces), axis=1), axis=0, return_inverse=True)
        middle = len(key0) + place.reshape(3, -1)
        key0, key1 = (np.concatenate([key, key[edges].mean(axis=1)]) for key in (key0, key1))
        (first, second, third), (a, b, c) = middle, faces.T
        parts = ((a, first, third), (first, b, second), (third, second, c), (first, second, third))
        faces = np.concatenate([np.stack(part, axis=1) for part in parts])
    return KeyPair.checked(key0, key1, faces)


class PeakMemory:
    """Context manager that measures the peak memory of this process's descendants during its block."""

    def __init__(self) -> None:
        self.megabytes = 0.0
        self.stages: dict[str, int] = {}
        self._stage = "start"
        self._over = threading.Event()
        self._watch = threading.Thread(target=self._look)

    def __enter__(self) -> PeakMemory:
        self._watch.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._watch.join()

    def note(self, progress: Progress) -> None:
        """Record the stage that the work is in."""
        self._stage = progress.stage

    def _look(self) -> None:
        while not self._over.wait(_PAUSE):
            held = sum(map(_megabytes, _descendants(os.getpid())))
            self.megabytes = max(self.megabytes, held)
            self.stages[self._stage] = max(self.stages.get(self._stage, 0), round(held))


def _descendants(process: int) -> list[int]:
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
        except (OSError, ValueError):
            continue
        found.append((parent, int(folder.name)))
    below, level = [], [process]
    while level:
        level = [child for parent, child in found if parent in level]
        below += level
    return below


def _megabytes(process: int) -> float:
    try:
        lines = Path(f"/proc/{process}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0.0
    return sum(int(line.split()[1]) for line in lines if line.startswith("Pss:")) / 1024


if __name__ == "__main__":
    main()
