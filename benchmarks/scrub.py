# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed and accuracy of live scrub: python -m benchmarks.scrub [FOLDER OF THE DATA].

For each pair: the error of the preview at times between its frames; the seconds until it is ready, for which a child
process computes the frames from the kept map, and the processor time among them; its memory; the time to evaluate it;
and the time of a whole step in Blender, from the slider to the evaluated mesh with normals, without drawing. The last
two are medians, which other work on the same machine affects least.
"""

from __future__ import annotations

import resource
import sys
import time as clock
from pathlib import Path

import numpy as np

from qc3d_addon.solver.api import Fit
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.fit.storage import to_bytes
from qc3d_addon.solver.frames.bake import evenly_spaced
from qc3d_addon.solver.frames.preview import PreviewCurve
from qc3d_addon.solver.frames.task import Task
from qc3d_addon.solver.frames.weights import Weights
from qc3d_addon.solver.keys.files import read_pair
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.worker import client

from .catalogue import DATA

PAIRS = (("body", "rest", "t_pose"), ("body", "rest", "arms_overhead"), ("head", "neutral", "jawOpen"))
STEPS = (24, 48)
BAKED = Weights.smooth(np.linspace(0.0, 1.0, 7))
_BETWEEN = (0.031, 0.17, 0.262, 0.443, 0.51, 0.689, 0.813, 0.987)
_EVALUATIONS = 200
_UPDATES = 60


def main(arguments: list[str]) -> None:
    """Print the table."""
    folder = Path(arguments[0]) if arguments else DATA
    columns = ("pair", "vertices", "steps", "largest error / diagonal", "s until it shows", "processor s", "MB")
    print(f"| {' | '.join((*columns, 'ms an evaluation', 'ms a step'))} |")
    print("|---|---|---|---|---|---|---|---|---|")
    for file, first, second in PAIRS:
        pair = read_pair(folder / f"{file}.npz", first, second)
        fitted = finish(fit_pair(pair, FitOptions()))
        known = Fit(fitted).inbetweens(_BETWEEN).frames
        ends = (first, second)
        for steps in STEPS:
            started, used = clock.perf_counter(), _processor_seconds()
            task = Task({ends: pair}, ends, times=evenly_spaced(steps - 1), kept={ends: to_bytes(fitted)})
            bake = client.run(task, None).bake
            assert bake is not None
            curve = PreviewCurve(bake.frames)
            waited, used = clock.perf_counter() - started, _processor_seconds() - used
            error = max(np.abs(curve.at(time) - frame).max() for time, frame in zip(_BETWEEN, known, strict=True))
            marks = [clock.perf_counter()]
            for number in range(_EVALUATIONS):
                curve.beyond(number / _EVALUATIONS, BAKED)
                marks.append(clock.perf_counter())
            print(
                f"| {file} {first} → {second} | {len(pair.key0)} | {steps} | {error / pair.diagonal:.1e} "
                f"| {waited:.1f} | {used:.1f} | {curve.nbytes / 1e6:.1f} | {1e3 * np.median(np.diff(marks)):.2f} "
                f"| {1e3 * _step_in_blender(pair, curve):.1f} |",
                flush=True,
            )


def _processor_seconds() -> float:
    """Processor seconds used by this process and by its children that have ended."""
    return sum(
        usage.ru_utime + usage.ru_stime
        for usage in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    )


def _step_in_blender(pair: KeyPair, curve: PreviewCurve) -> float:
    """Median seconds from moving the slider to the evaluated mesh."""
    import bpy

    from qc3d_addon.blender.kinds import keys_of, mesh_of, present
    from qc3d_addon.blender.store.mesh_data import key_coordinates, set_key_coordinates

    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("Mesh")
    mesh.from_pydata(pair.key0.tolist(), [], pair.faces.tolist())
    obj = bpy.data.objects.new("Object", mesh)
    present(bpy.context.collection).objects.link(obj)
    obj.shape_key_add(name="Basis")
    for knot in BAKED.knots[1:]:
        key = obj.shape_key_add(name=str(knot), from_mix=False)
        set_key_coordinates(key, curve.at(knot))
        key.value = 0.5
    preview = obj.shape_key_add(name="Preview", from_mix=False)
    preview.value = 1.0
    marks = [clock.perf_counter()]
    for number in range(_UPDATES):
        basis = key_coordinates(obj, "Basis")
        set_key_coordinates(preview, basis + curve.beyond(number / _UPDATES, BAKED))
        keys_of(obj).update_tag()
        evaluated = mesh_of(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()))
        evaluated.corner_normals[0].vector.copy()
        marks.append(clock.perf_counter())
    return float(np.median(np.diff(marks)))


if __name__ == "__main__":
    main(sys.argv[1:])
