# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far what other programs show is from what Blender shows, on the demo figure's arm::

    python -m benchmarks.readers FOLDER

Bakes and exports the arm into FOLDER, installs three.js and Babylon.js there by npm, lets them read the files, and
prints the largest distance of a vertex over the scene's frames. Needs Blender's module, and Node 20 or later.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from qc3d_addon.cli.main import main as qc3d
from qc3d_addon.solver.arrays import Floats

_FIGURE = Path(__file__).parents[1] / "qc3d_addon" / "demo" / "figure.blend"
_OBJECT, _KEY, _EVERY = "Arm", "Bend", 3
_PACKAGES = ("three", "@babylonjs/core", "@babylonjs/loaders")
# The script, the file's ending, and the size of its unit in Blender's.
_READERS = (
    ("read_by_three.mjs", "glb", 1.0),
    ("read_by_babylon.mjs", "glb", 1.0),
    ("read_by_three.mjs", "fbx", 0.01),
)


def main(folder: Path) -> None:
    """Write the files, let the programs read them, and print the distances."""
    folder.mkdir(parents=True, exist_ok=True)
    baked = folder / "arm.blend"
    _run_qc3d("bake", str(_FIGURE), f"--object={_OBJECT}", f"--on-key={_KEY}", "--frames=5", f"--output={baked}")
    for ending in dict.fromkeys(ending for _, ending, _ in _READERS):
        _run_qc3d("export", str(baked), f"--object={_OBJECT}", f"--output={folder / f'arm.{ending}'}")
    rest, shown, seconds = _in_blender(baked)
    (folder / "times.json").write_text(json.dumps(seconds))
    (folder / "package.json").write_text("{}")
    subprocess.run(["npm", "install", "--no-save", *_PACKAGES], cwd=folder, check=True, capture_output=True)
    size = float(np.linalg.norm(np.ptp(rest, axis=0)))
    print(f"without the keys: {np.linalg.norm(shown - rest, axis=2).max() / size:.2g} of the size")
    for script, ending, unit in _READERS:
        shutil.copy(Path(__file__).with_name(script), folder)
        subprocess.run(["node", script, f"arm.{ending}", "times.json", "read.json"], cwd=folder, check=True)
        read = json.loads((folder / "read.json").read_text())
        number = np.asarray(cKDTree(rest).query(_in_blenders_axes(read["rest"], unit))[1])
        frames = [_in_blenders_axes(points, unit) for points in read["frames"]]
        largest = np.linalg.norm(np.array(frames) - shown[:, number], axis=2).max()
        print(f"{script} arm.{ending}: {largest / size:.2g} of the size, {len(set(number))} of {len(rest)} vertices")


def _run_qc3d(*words: str) -> None:
    if qc3d(words) != 0:
        raise SystemExit(f"qc3d {' '.join(words)} failed")


def _in_blender(path: Path) -> tuple[Floats, Floats, list[float]]:
    """The vertices at rest (n, 3) and in some frames (f, n, 3), and the seconds of these."""
    import bpy

    from qc3d_addon.blender.kinds import keys_of, mesh_of, present

    bpy.ops.wm.open_mainfile(filepath=str(path))
    obj, scene = bpy.data.objects[_OBJECT], present(bpy.context.scene)
    frames = range(scene.frame_start, scene.frame_end + 1, _EVERY)

    def placed(shown: bpy.types.Object, flat: Floats) -> Floats:
        matrix = np.array(shown.matrix_world)
        points: Floats = flat.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
        return points

    flat = np.empty(3 * len(mesh_of(obj).vertices))
    shown = []
    for frame in frames:
        scene.frame_set(frame)
        evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
        present(evaluated.to_mesh()).vertices.foreach_get("co", flat)
        shown.append(placed(evaluated, flat))
    keys_of(obj).key_blocks[0].data.foreach_get("co", flat)
    fps = scene.render.fps / scene.render.fps_base
    return placed(obj, flat), np.array(shown), [frame / fps for frame in frames]


def _in_blenders_axes(values: list[float], unit: float) -> Floats:
    """Points (n, 3) of a program in which y points up."""
    return unit * np.array(values).reshape(-1, 3)[:, [0, 2, 1]] * [1.0, -1.0, 1.0]


if __name__ == "__main__":
    main(Path(sys.argv[1]))
