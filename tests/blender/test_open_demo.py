# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo figure: it opens from the menu, its rig drives its keys, and they can be baked."""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.bake import jobs
from qc3d_addon.blender.operators import open_demo

KEYS = {"Arm": ["Bend", "Fist"], "Brows": ["Brows"], "Face": ["Jaw", "Brows"], "Lids": ["Blink.L", "Blink.R"]}


@pytest.fixture
def demo() -> bpy.types.Scene:
    assert bpy.ops.qc3d.open_demo() == {'FINISHED'}
    return bpy.context.scene


def test_it_opens_as_a_new_file_and_leaves_the_addon_on(demo: bpy.types.Scene) -> None:
    assert bpy.data.filepath == ""
    assert {name: obj.data.shape_keys.key_blocks.keys()[1:] for name, obj in bpy.data.objects.items()
            if obj.type == 'MESH' and obj.data.shape_keys} == KEYS  # fmt: skip
    assert bpy.context.active_object.name == "Arm"
    assert hasattr(bpy.context.active_object, "qc3d")
    assert (demo.frame_start, demo.frame_end) == (1, 96)
    assert demo.camera is not None
    assert len(bpy.data.collections["Eyes"].objects) == 2


def test_every_key_is_driven_by_the_bone_of_its_name(demo: bpy.types.Scene) -> None:
    rig = bpy.data.objects["Rig"]
    rig.animation_data_clear()
    for bone in {key for keys in KEYS.values() for key in keys}:
        for pulled, expected in ((0.1, 0.5), (0.2, 1.0), (0.0, 0.0)):
            rig.pose.bones[bone].location[1] = pulled
            bpy.context.view_layer.update()
            for name, keys in KEYS.items():
                values = bpy.data.objects[name].data.shape_keys.key_blocks
                for key in keys:
                    assert values[key].value == pytest.approx(expected if key == bone else 0.0, abs=1e-6)


def test_the_motion_uses_every_key_and_is_a_loop(demo: bpy.types.Scene) -> None:
    moments = {}
    for frame in range(demo.frame_start, demo.frame_end + 1):
        demo.frame_set(frame)
        moments[frame] = [bpy.data.objects[name].data.shape_keys.key_blocks[key].value
                          for name, keys in KEYS.items() for key in keys]  # fmt: skip
    values = np.array(list(moments.values()))
    np.testing.assert_allclose(values.max(axis=0), 1.0, atol=1e-6)
    np.testing.assert_allclose(values[[0, -1]], 0.0, atol=1e-6)


def test_unsaved_work_is_asked_about_first(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[dict[str, str]] = []

    def invoke_confirm(*arguments: object, **options: str) -> set[str]:
        asked.append(options)
        return {'RUNNING_MODAL'}

    opened = []
    operator = SimpleNamespace(execute=lambda context: opened.append(context) or {'FINISHED'})
    context = SimpleNamespace(window_manager=SimpleNamespace(invoke_confirm=invoke_confirm))
    for is_dirty in (True, False):
        monkeypatch.setattr(open_demo, "bpy", SimpleNamespace(data=SimpleNamespace(is_dirty=is_dirty)))
        open_demo.QC3D_OT_open_demo.invoke(operator, context, None)
    assert len(asked) == len(opened) == 1
    assert "will be lost" in asked[0]["message"]


def test_not_during_a_bake(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jobs, "busy_problem", lambda: "A bake is on its way.")
    assert not bpy.ops.qc3d.open_demo.poll()
