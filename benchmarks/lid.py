# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles of an eyelid that cross the eyeball while it closes, with and without colliders.

``python -m benchmarks.lid`` bakes the demo file ``assets/lid.blend`` with the engine ``delaunay`` and prints the table
of the documentation.
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from qc3d_addon.blender.bake.request import BakeRequest
from qc3d_addon.blender.bake.run import bake_object
from qc3d_addon.blender.kinds import mesh_of
from qc3d_addon.blender.store.mesh_data import key_coordinates, triangles
from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.collision.crossings import crossing_pairs

FILE = Path(__file__).resolve().parents[1] / "assets" / "lid.blend"
COUNT = 24
SHOWN = (0, 3, 6, 9, 12, 15, 18, 21, 24, 25)  # of the steps


def main() -> None:
    """Print the table."""
    steps = COUNT + 1
    print("| | " + " | ".join(f"{step / steps:.2g}" for step in SHOWN) + " |")
    print("|---" * (len(SHOWN) + 1) + "|")
    for name, colliders in (("without colliders", ""), ("with colliders", "Eyeball")):
        bpy.ops.wm.open_mainfile(filepath=str(FILE), load_ui=False)
        lid = bpy.data.objects["Lid"]
        # The keys that a slider plays are whole shapes, the last one among them.
        request = BakeRequest(("Basis", "Closed"), COUNT, colliders=colliders, play_on="slider")
        result = bake_object(lid, request)
        frames = [key_coordinates(lid, key).astype(np.float64) for key in ("Basis", *result.keys)]
        if not colliders:
            blends = [(1.0 - t) * frames[0] + t * frames[-1] for t in np.linspace(0.0, 1.0, steps + 1)]
            _print_row("straight blend", crossings(lid, blends))
        _print_row(name, crossings(lid, frames))


def crossings(lid: bpy.types.Object, shapes: list[Floats]) -> list[int]:
    """Number of crossing pairs of a triangle of the lid and one of the eyeball, for each shape (n, 3) of the lid."""
    eyeball = mesh_of(bpy.data.objects["Eyeball"])
    points = np.array([vertex.co[:] for vertex in eyeball.vertices])
    faces = triangles(mesh_of(lid))
    both = np.concatenate([faces, triangles(eyeball) + len(mesh_of(lid).vertices)]).astype(np.int64)
    pairs = [crossing_pairs(np.concatenate([shape, points]), both) for shape in shapes]
    return [int(((found < len(faces)).sum(axis=1) == 1).sum()) for found in pairs]


def _print_row(name: str, counts: list[int]) -> None:
    print(f"| {name} | " + " | ".join(str(counts[step]) for step in SHOWN) + " |", flush=True)


if __name__ == "__main__":
    main()
