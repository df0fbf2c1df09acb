# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast live scrub is, and how near: python -m benchmarks.scrub [FOLDER OF THE DATA].

For each pair: the error of the preview against frames computed at times it does not know, the time to evaluate it, and
the time of a whole step in Blender, shape key and evaluated mesh included, without drawing.
"""

from __future__ import annotations

import sys
import time as clock
from pathlib import Path

import numpy as np

from qc3d_addon.solver.array_files import read_pairs
from qc3d_addon.solver.keypair import KeyPair
from qc3d_addon.solver.pipeline import evenly_spaced, finish, inbetweens, prepare
from qc3d_addon.solver.preview import PreviewCurve
from qc3d_addon.solver.settings import Settings

from .catalogue import DATA

PAIRS = (("body", "rest", "t_pose"), ("body", "rest", "arms_overhead"), ("head", "neutral", "jawOpen"))
STEPS = (24, 48, 96)
_BETWEEN = (0.031, 0.17, 0.262, 0.443, 0.51, 0.689, 0.813, 0.987)
_EVALUATIONS = 200
_UPDATES = 60


def main(arguments: list[str]) -> None:
    """Print the table."""
    folder = Path(arguments[0]) if arguments else DATA
    settings = Settings(engine="delaunay")
    print("| pair | vertices | steps | largest error / diagonal | ms an evaluation | ms a step in Blender |")
    print("|---|---|---|---|---|---|")
    for file, first, second in PAIRS:
        pair = read_pairs(folder / f"{file}.npz", (first, second))[0]
        prepared = finish(prepare(pair, settings))
        known = finish(inbetweens(prepared, _BETWEEN, settings)).frames
        for steps in STEPS:
            curve = PreviewCurve(finish(inbetweens(prepared, evenly_spaced(steps - 1), settings)).frames)
            error = max(np.abs(curve.at(time) - frame).max() for time, frame in zip(_BETWEEN, known, strict=True))
            started = clock.perf_counter()
            for number in range(_EVALUATIONS):
                curve.at(number / _EVALUATIONS)
            evaluation = (clock.perf_counter() - started) / _EVALUATIONS
            print(
                f"| {file} {first} → {second} | {len(pair.key0)} | {steps} | {error / pair.diagonal:.1e} "
                f"| {1e3 * evaluation:.2f} | {1e3 * _in_blender(pair, curve):.1f} |"
            )


def _in_blender(pair: KeyPair, curve: PreviewCurve) -> float:
    """Seconds from a place of the slider to the mesh that is drawn."""
    import bpy

    from qc3d_addon.blender.mesh_data import set_key_coordinates

    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("Mesh")
    mesh.from_pydata(pair.key0.tolist(), [], pair.faces.tolist())
    obj = bpy.data.objects.new("Object", mesh)
    bpy.context.collection.objects.link(obj)
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Preview", from_mix=False)
    obj.active_shape_key_index, obj.show_only_shape_key = 1, True
    started = clock.perf_counter()
    for number in range(_UPDATES):
        set_key_coordinates(key, curve.at(number / _UPDATES))
        mesh.shape_keys.update_tag()
        evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        evaluated.vertices[0].co.copy()
    return (clock.perf_counter() - started) / _UPDATES


if __name__ == "__main__":
    main(sys.argv[1:])
