# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From the click to the shape keys: bakes one after the other in one Blender.

    python -m benchmarks.clicks              # the body, or a limb where the shapes are missing
    python -m benchmarks.clicks --write      # the table of docs/science/speed.md

Every round is a process of its own, with Blender's Python module; the operator is called as the button calls it, and
its time includes reading the keys and writing the new ones. In a window, choosing a key in the panel starts the child
process: some rounds wait a while between that and the click. The fastest of all rounds is shown, because other work
on the machine only ever adds to it.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time as clock
from pathlib import Path
from typing import Any

import numpy as np

from qc3d_addon.worker.standby import Standby

from .catalogue import DATA, ROOT, Floats, Ints
from .report import table, write_between_markers
from .stage_cases import limb

DOCUMENT = ROOT / "docs/science/speed.md"
_VERTICES = 7_000  # of the limb
CHOOSING = 2.0  # seconds between the choice of a key and the click
FIRST, SECOND = "t_pose", "arms_overhead"
# What is baked, one after the other: the second key, and the number of in-betweens.
BAKES = (
    ("the first", FIRST, 4),
    ("another key of the mesh", SECOND, 4),
    ("the first keys, other in-betweens", FIRST, 7),
)

# The process stays, or ends after each bake, or has been started by the choice of the keys.
HOW = ("stays", "each", "chosen")


def main(argv: list[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5, metavar="N", help="how often everything is done (default: 5)")
    parser.add_argument("--write", action="store_true", help=f"put the table into {DOCUMENT.name}")
    parser.add_argument("--round", choices=HOW, help=argparse.SUPPRESS)
    chosen = parser.parse_args(argv)
    if chosen.round is not None:
        print(json.dumps(one_round(chosen.round)))
        return
    found: dict[str, list[list[float]]] = {how: [] for how in HOW}
    for _ in range(chosen.rounds):
        for how, rounds in found.items():
            command = [sys.executable, "-m", "benchmarks.clicks", "--round", how]
            done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
            rounds.append(json.loads(done.stdout.strip().splitlines()[-1]))
    waited = f"s, chosen {CHOOSING:g} s before"
    text = table(["bake", "s", "CPU s", "s, a process each", "CPU s, a process each", waited], rows(found))
    print(text)
    if chosen.write:
        write_between_markers(DOCUMENT, text, "benchmarks/clicks.py")


def rows(found: dict[str, list[list[float]]]) -> list[list[str]]:
    """The rows of the table, from the seconds of all rounds: of each bake on the clock, then of the processors."""
    best = {how: np.min(rounds, axis=0) for how, rounds in found.items()}
    count = len(BAKES)
    return [
        [
            what,
            *(f"{best[how][place]:.2f}" for how in ("stays", "each") for place in (number, number + count)),
            "" if number else f"{best['chosen'][0]:.2f}",
        ]
        for number, (what, *_) in enumerate(BAKES)
    ]


def one_round(how: str) -> list[float]:
    """Seconds of each bake on the clock, then those of the child's processors."""
    import bpy

    import qc3d_addon
    from qc3d_addon.blender.bake import jobs

    bpy.ops.wm.read_factory_settings(use_empty=True)
    qc3d_addon.register()
    _add_mesh()
    if how == "chosen":
        jobs.prepare()
        clock.sleep(CHOOSING)
    operators: Any = bpy.ops  # whose stubs do not know this one
    seconds, processor = [], []
    for _, key, count in BAKES:
        before = _used(jobs.standby())
        started = clock.perf_counter()
        operators.qc3d.bake_inbetweens(play_on="slider", from_key="rest", to_key=key, count=count - 1, more=False)
        seconds.append(clock.perf_counter() - started)
        processor.append(_used(jobs.standby()) - before)
        if how == "each":
            jobs.standby().close()
    qc3d_addon.unregister()
    sys.stdout.flush()
    return [*seconds, *processor]


def _add_mesh() -> None:
    import bpy

    from qc3d_addon.blender.kinds import present

    faces, shapes = _mesh()
    mesh = bpy.data.meshes.new("Mesh")
    mesh.from_pydata(shapes["rest"].tolist(), [], faces.tolist())
    obj = bpy.data.objects.new("Mesh", mesh)
    present(bpy.context.scene).collection.objects.link(obj)
    present(bpy.context.view_layer).objects.active = obj
    for name, shape in shapes.items():
        key = obj.shape_key_add(name=name, from_mix=False)
        key.points.foreach_set("co", shape.astype(np.float32).ravel())


def _mesh() -> tuple[Ints, dict[str, Floats]]:
    if (DATA / "body.npz").exists():
        with np.load(DATA / "body.npz", allow_pickle=False) as stored:
            names = stored["shape_names"].tolist()
            return stored["faces"], {name: stored[f"V{names.index(name)}"] for name in ("rest", FIRST, SECOND)}
    faces, sphere, bent = limb(_VERTICES)
    return faces, {"rest": sphere, FIRST: bent, SECOND: 0.4 * sphere + 0.6 * bent}


def _used(kept: Standby) -> float:
    """Processor seconds of the child that waits; 0 where there is none, or no /proc."""
    child = kept._child
    if child is None or not Path("/proc").exists():
        return 0.0
    fields = Path(f"/proc/{child.process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    main()
