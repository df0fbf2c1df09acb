# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys that a bone drives, baked on themselves in a window: all of them in one run, stopped, and undone in one step."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from .harness import Window

KEYS = "qc3d.bake_keys"
OWN = ["Basis", "Bend 90", "Twist 120", "Bend and twist"]
RIG = """
import numpy as np
rig = bpy.data.objects.new('Rig', bpy.data.armatures.new('Rig'))
bpy.context.scene.collection.objects.link(rig)
rig.location.x = 3.0
bpy.context.view_layer.objects.active = rig
bpy.ops.object.mode_set(mode='EDIT')
rig.data.edit_bones.new('control').tail = (0.0, 0.0, 1.0)
bpy.ops.object.mode_set(mode='OBJECT')
bpy.context.view_layer.objects.active = arm()
keys = arm().data.shape_keys
driver = keys.driver_add('key_blocks["Bend and twist"].value').driver
driver.type = 'AVERAGE'
target = driver.variables.new()
target.type = 'TRANSFORMS'
target = target.targets[0]
target.id, target.bone_target, target.transform_type, target.transform_space = rig, 'control', 'LOC_X', 'LOCAL_SPACE'


def pull(place):
    '''Move the bone; the shape that the arm has then.'''
    rig.pose.bones['control'].location.x = place
    bpy.context.view_layer.update()
    mesh = arm().evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    values = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get('co', values)
    return values.tolist()


arm().qc3d.play_on = 'auto'
remember('Rig')
"""


@pytest.fixture
def rigged(window: Window) -> Window:
    window.ask(RIG)
    return window


def begin(window: Window) -> None:
    window.ask(f"with inside('UI'): bpy.ops.{KEYS}('INVOKE_DEFAULT', which='all')")
    window.wait_for("child()")


def shoot_arm(window: Window, path: Path) -> None:
    """A picture of the arm in the 3D view, without the sidebar over it."""
    window.ask("view()[1].spaces.active.show_region_ui = False")
    window.ask("with inside('WINDOW'): bpy.ops.view3d.view_axis(type='FRONT'), bpy.ops.view3d.view_selected()")
    time.sleep(1.0)
    window.shoot(path)
    window.ask("view()[1].spaces.active.show_region_ui = True")


def test_a_bone_drives_the_key_before_and_after(rigged: Window, tmp_path: Path) -> None:
    before: dict[float, Any] = {place: np.array(rigged.ask(f"pull({place})")) for place in (0.0, 0.5, 1.0)}
    rigged.ask("pull(0.5)")
    shoot_arm(rigged, tmp_path / "before.png")
    drivers = rigged.ask("state()")[5]
    begin(rigged)
    assert rigged.wait_for("job().label if job() else ''") == "Bake Keys"
    rigged.wait_for("job() is None")
    names = rigged.ask("names()")
    assert names[:4] == OWN
    assert any(name.startswith("Bend and twist_") for name in names)
    assert drivers[0] in rigged.ask("state()")[5]
    after = {place: np.array(rigged.ask(f"pull({place})")) for place in before}
    rigged.ask("pull(0.5)")
    shoot_arm(rigged, tmp_path / "after.png")
    for place in (0.0, 1.0):
        np.testing.assert_allclose(after[place], before[place], atol=1e-6)
    assert np.abs(after[0.5] - before[0.5]).max() > 0.1  # round the corner, not through it
    rigged.press("ctrl+z")
    rigged.wait_for(f"names() == {OWN}")


def test_escape_stops_all_of_them(rigged: Window) -> None:
    before = rigged.ask("state()")
    begin(rigged)
    rigged.hover_sidebar()
    rigged.press("Escape")
    rigged.wait_for("job() is None")
    rigged.wait_for("'Bake Keys was canceled; nothing was changed.' in reports()")
    assert rigged.ask("state()") == before


def test_escape_stops_a_combination(rigged: Window, tmp_path: Path) -> None:
    before = rigged.ask("state()")
    keys = "first='Bend 90', second='Twist 120'"
    rigged.ask(f"with inside('UI'): bpy.ops.qc3d.combine_keys('INVOKE_DEFAULT', {keys})")
    rigged.wait_for("child()")
    rigged.shoot(tmp_path / "combining.png")
    rigged.hover_sidebar()
    rigged.press("Escape")
    rigged.wait_for("job() is None")
    rigged.wait_for("'Combine Keys was canceled; nothing was changed.' in reports()")
    assert rigged.ask("state()") == before
    rigged.ask(f"with inside('UI'): bpy.ops.qc3d.combine_keys('INVOKE_DEFAULT', {keys})")
    rigged.wait_for(f"len(names()) == {len(OWN) + 4}")
