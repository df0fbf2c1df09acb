# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory and time of bakes of large meshes (Linux).

    python -m benchmarks.large [PARTS ...] [--engine ENGINE] [--quality QUALITY] [--frames FRAMES]

Every edge of the body of the data folder is divided into so many parts: 12 make a million vertices. The bake runs in a
child process, as in Blender. The memory is the peak of the proportional set sizes (PSS) of all descendants of this
process.
"""

from __future__ import annotations

import argparse
import os
import resource
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

# Of the body's 6,890 vertices: parts of each edge, for 7 thousand vertices to a million.
PARTS = (1, 2, 4, 8, 12)
KEYS = ("rest", "arms_overhead")
_PAUSE = 0.05


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", type=int, default=PARTS)
    parser.add_argument("--engine", default="delaunay")
    parser.add_argument("--quality", default="normal")
    parser.add_argument("--frames", type=int, default=4, help="in-betweens (default: 4)")
    parser.add_argument("--keys", nargs=2, default=KEYS, help="of the body")
    chosen = parser.parse_args()
    options = FitOptions(engine=chosen.engine, quality=chosen.quality)
    print("| vertices | engine | processor s | µs a vertex | s | MB | estimated MB | seconds by stage |")
    print("|---|---|---|---|---|---|---|---|")
    for parts in chosen.parts:
        pair = divided(read_pair(DATA / "body.npz", *chosen.keys), parts)
        ends = ("first", "second")
        task = Task({ends: pair}, ends, options, times=evenly_spaced(chosen.frames))
        started, used = clock.perf_counter(), _processor_seconds()
        with PeakMemory() as peak:
            bake = client.run(task, peak.note).bake
        assert bake is not None
        stages = ", ".join(f"{name} {seconds:.1f}" for name, seconds in bake.report.seconds.items())
        taken, used = clock.perf_counter() - started, _processor_seconds() - used
        count = len(pair.key0)
        print(
            f"| {count:,} | {bake.report.engine} | {used:.1f} | {1e6 * used / count:.0f} | {taken:.0f} "
            f"| {peak.megabytes:.0f} | {task.estimated_mb:.0f} | {stages} |",
            flush=True,
        )
        print(f"  by stage: {peak.stages}", file=sys.stderr, flush=True)


def _processor_seconds() -> float:
    """Processor seconds used by the children of this process that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def divided(pair: KeyPair, parts: int) -> KeyPair:
    """The pair with every edge divided into so many parts, and every triangle into their square."""
    edges, place = np.unique(np.sort(sides(pair.faces), axis=1), axis=0, return_inverse=True)
    place = place.reshape(3, -1)
    first, second = np.meshgrid(np.arange(parts + 1), np.arange(parts + 1), indexing="ij")
    chosen = first + second <= parts
    lattice = np.stack([parts - first - second, first, second], axis=-1)[chosen]
    row = np.full(first.shape, -1)
    row[chosen] = np.arange(len(lattice))
    on_edges = np.arange(1, parts)
    number = np.empty((len(pair.faces), len(lattice)), dtype=np.int64)
    inner = (lattice > 0).all(axis=1)
    count = len(pair.key0) + len(edges) * (parts - 1)
    number[:, inner] = count + np.arange(len(pair.faces) * inner.sum()).reshape(len(pair.faces), -1)
    for corner, at in enumerate(np.argmax(lattice == parts, axis=0)):
        number[:, at] = pair.faces[:, corner]
    for side in range(3):
        tail, head = side, (side + 1) % 3
        along = np.zeros((parts - 1, 3), dtype=np.int64)
        along[:, tail], along[:, head] = parts - on_edges, on_edges
        forward = (pair.faces[:, tail] < pair.faces[:, head])[:, None]
        steps = np.where(forward, on_edges, parts - on_edges) - 1
        number[:, row[along[:, 1], along[:, 2]]] = len(pair.key0) + place[side][:, None] * (parts - 1) + steps
    share = on_edges[:, None] / parts
    keys = []
    for key in (pair.key0, pair.key1):
        between = key[edges[:, None, 0]] * (1.0 - share) + key[edges[:, None, 1]] * share
        within = np.einsum("lc,mcd->mld", lattice[inner] / parts, key[pair.faces])
        keys.append(np.concatenate([key, between.reshape(-1, 3), within.reshape(-1, 3)]))
    low, high = row[:-1, :-1], row[1:, 1:]
    right, up = row[1:, :-1], row[:-1, 1:]
    upward, downward = right[right >= 0], (high >= 0)
    corners = [np.stack([low[right >= 0], upward, up[right >= 0]], axis=1)]
    corners.append(np.stack([right[downward], high[downward], up[downward]], axis=1))
    faces = number[:, np.concatenate(corners)].reshape(-1, 3)
    return KeyPair.checked(keys[0], keys[1], faces)


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
