# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A baked file plays without the add-on and without scripts; saved there, it comes back undamaged."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.store.records import Record

OPEN_ALONE = """
import json, sys
import bpy, numpy as np
bpy.ops.wm.open_mainfile(filepath=sys.argv[1], use_scripts=False)
assert not any(name.startswith("qc3d_addon") for name in sys.modules)
assert not hasattr(bpy.types, "QC3D_PT_inbetweens")
obj = bpy.data.objects["Figure"]
shown = []
for value in (0.0, 0.3, 0.5, 1.0):
    obj["Basis_to_Lean"] = value
    obj.update_tag()
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    positions = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", positions)
    shown.append(positions.tolist())
invalid = [curve.data_path for curve in obj.data.shape_keys.animation_data.drivers if not curve.driver.is_valid]
bpy.ops.wm.save_mainfile()
print("FOUND" + json.dumps([shown, invalid, list(obj.data.shape_keys.key_blocks.keys())]))
"""


@pytest.mark.usefixtures("quick_map")
def test_a_baked_file_plays_without_the_addon_and_comes_back(figure: bpy.types.Object, shown, tmp_path: Path) -> None:  # noqa: ANN001
    bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", count=3, use_keyframes=True)
    bpy.ops.qc3d.heat_map(measure='stretch')
    keys = figure.data.shape_keys
    names, record = keys.key_blocks.keys(), Record.read(keys)
    kept = {name: bytes(value) for name, value in keys.items() if isinstance(value, bytes)}
    figure.animation_data_clear()  # the slider is set by hand below
    expected = [shown(figure, Basis_to_Lean=value) for value in (0.0, 0.3, 0.5, 1.0)]
    path = tmp_path / "baked.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))

    done = subprocess.run([sys.executable, "-c", OPEN_ALONE, str(path)], capture_output=True, text=True, check=True)
    line = next(line for line in done.stdout.splitlines() if line.startswith("FOUND"))
    found, invalid, found_names = json.loads(line.removeprefix("FOUND"))
    assert invalid == []
    assert found_names == list(names)
    np.testing.assert_array_equal(np.array(found, dtype=np.float32).reshape(4, -1, 3), expected)

    bpy.ops.wm.open_mainfile(filepath=str(path))
    figure = bpy.data.objects["Figure"]
    keys = figure.data.shape_keys
    assert Record.read(keys) == record
    assert {name: bytes(value) for name, value in keys.items() if isinstance(value, bytes)} == kept
    bpy.context.view_layer.objects.active = figure
    assert bpy.ops.qc3d.rebake() == {'FINISHED'}
    assert list(keys.key_blocks.keys()) == list(names)
