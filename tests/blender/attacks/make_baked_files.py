# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the file ``files/baked_VERSION.blend`` with the Blender that runs this: everything that a bake can leave in it.

    python -m tests.blender.attacks.make_baked_files
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

import qc3d_addon
from qc3d_addon.blender.bake.request import BakeRequest
from qc3d_addon.blender.bake.run import bake_object
from qc3d_addon.solver.fit import volume
from qc3d_addon.solver.settings import FrameOptions

from ..conftest import six_tetrahedra

FILES = Path(__file__).with_name("files")


def main() -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    qc3d_addon.register()
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6)
    obj = bpy.context.active_object
    obj.name = obj.data.name = "Figure"
    rest = np.empty(3 * len(obj.data.vertices), dtype=np.float32)
    obj.data.vertices.foreach_get("co", rest)
    rest = rest.reshape(-1, 3)
    leant = rest + np.maximum(rest[:, 2:], 0.0) ** 2 * np.float32([0.5, 0.0, 0.0])
    for name, shape in (("Basis", rest), ("Lean.L", leant), ("Long", rest * np.float32([1.0, 1.0, 1.5]))):
        key = obj.shape_key_add(name=name, from_mix=False)
        key.value = 0.0
        key.points.foreach_set("co", np.ascontiguousarray(shape, dtype=np.float32).ravel())
    volume.fill_cube = lambda *_, **__: six_tetrahedra()  # so that the maps are small
    options = FrameOptions(mode="linear")
    way = ("Basis", "Lean.L")
    bake_object(obj, BakeRequest(way, 3, frame_options=options, keyframes=(1, 25), play_on="slider"))
    bake_object(obj, BakeRequest(("Lean.L", "Basis", "Long"), 2, frame_options=options))
    for operator in (bpy.ops.qc3d.mirror, bpy.ops.qc3d.heat_map, bpy.ops.qc3d.absolute_keys):
        assert operator(slider="Basis_to_Lean.L") == {'FINISHED'}
    eased = FrameOptions(mode="linear", easing="ease-in-out")
    bake_object(obj, BakeRequest(("Basis", "Long"), 3, frame_options=eased, play_on="key"))
    version = ".".join(map(str, bpy.app.version[:2]))
    FILES.mkdir(exist_ok=True)
    path = FILES / f"baked_{version}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, copy=True)
    print(path, path.stat().st_size)


if __name__ == "__main__":
    main()
