# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender plays of a bake, beside the frames that the solver computes: python -m benchmarks.played [PAIR …].

Each pair, the listed ones unless some are named, becomes two shape keys, is baked with the default settings on the
key's own value and on a slider, and is evaluated by Blender at 49 even positions. The figures are the worst of the
inner positions, as in ``measures``: ``edge_excess_p99`` / ``volume_dev``, and the largest distance of a vertex from the
computed frame, over the diagonal. "new crossings" are pairs of triangles beyond those of the worse key, at 12 positions
between the in-betweens.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import bpy
import numpy as np

from qc3d_addon.blender.bake.request import BakeRequest, PlayOn
from qc3d_addon.blender.bake.run import bake_object
from qc3d_addon.blender.kinds import keys_of, mesh_of, present
from qc3d_addon.blender.store.mesh_data import set_key_coordinates
from qc3d_addon.solver.frames.task import Task, carry_out
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import finish

from .catalogue import Catalogue, Floats, Ints, Pair
from .measures import Judge, count_crossings

POSITIONS = 49
CONTROLS: tuple[PlayOn, ...] = ("key", "slider")


def main(arguments: list[str]) -> None:
    """Print the table."""
    catalogue = Catalogue()
    pairs = [catalogue.find(text) for text in arguments] or [pair for pair in catalogue.pairs if pair.listed]
    print("| pair | straight blend | computed | on the key, d | on a slider, d | new crossings: computed, played |")
    print("|---|---|---|---|---|---|")
    for pair in pairs:
        faces, first, second = pair.load()
        times = np.linspace(0.0, 1.0, POSITIONS)
        judge = Judge(faces, first, second, crossings=False)
        straight = judge.sequence(first + times[:, None, None] * (second - first), times)
        frames = computed(pair, faces, first, second, times)
        known = judge.sequence(frames, times)["worst"]
        cells, crossings = [], [new_crossings(faces, first, second, frames)]
        for control in CONTROLS:
            shapes = played(pair, faces, first, second, times, control)
            found = judge.sequence(shapes, times)["worst"]
            distance = float(np.linalg.norm(shapes - frames, axis=2).max()) / judge.diagonal
            cells.append(f"{figures(found)}, {distance:.0e}")
            if control == "key":
                crossings.append(new_crossings(faces, first, second, shapes))
        cells = [str(pair), figures(straight["worst"]), figures(known), *cells, ", ".join(map(str, crossings))]
        print(f"| {' | '.join(cells)} |", flush=True)


def figures(worst: dict[str, Any]) -> str:
    """Lengths and volume of the worst position."""
    volume = "" if worst["volume_dev"] is None else f" / {worst['volume_dev']:.4f}"
    return f"{worst['edge_excess_p99']:.4f}{volume}"


def new_crossings(faces: Ints, first: Floats, second: Floats, shapes: Floats) -> int:
    """The most crossing pairs of triangles beyond those of the worse key, between the in-betweens."""
    keys, between = ([count_crossings(shape, faces) or 0 for shape in some] for some in ((first, second), shapes[2::4]))
    return max(0, *(count - max(keys) for count in between))


def computed(pair: Pair, faces: Ints, first: Floats, second: Floats, times: Floats) -> Floats:
    """Frames (k, n, 3) of the solver, default settings."""
    options = FitOptions(extra_turns=pair.extra_turns)
    task = Task.of_keys({"a": first, "b": second}, faces, None, ("a", "b"), options)
    bake = finish(carry_out(replace(task, times=times))).bake
    assert bake is not None
    return bake.frames


def played(pair: Pair, faces: Ints, first: Floats, second: Floats, times: Floats, control: PlayOn) -> Floats:
    """Shapes (k, n, 3) that Blender shows as a control of a bake is moved, default settings."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("Mesh")
    mesh.from_pydata(first.tolist(), [], faces.tolist())
    obj = bpy.data.objects.new("Object", mesh)
    present(bpy.context.collection).objects.link(obj)
    for name, shape in (("Basis", first), ("Up", second)):
        key = obj.shape_key_add(name=name, from_mix=False)
        key.value = 0.0
        set_key_coordinates(key, shape.astype(np.float32))
    options = FitOptions(extra_turns=pair.extra_turns)
    result = bake_object(obj, BakeRequest(("Basis", "Up"), fit_options=options, play_on=control, more=True))
    shapes = []
    for time in times.tolist():
        if control == "key":
            keys_of(obj).key_blocks["Up"].value = time
            keys_of(obj).update_tag()
        else:
            obj[result.slider] = time
            obj.update_tag()
        evaluated = mesh_of(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()))
        values = np.empty(3 * len(evaluated.vertices), dtype=np.float32)
        evaluated.vertices.foreach_get("co", values)
        shapes.append(values.reshape(-1, 3).astype(np.float64))
    return np.stack(shapes)


if __name__ == "__main__":
    main(sys.argv[1:])
