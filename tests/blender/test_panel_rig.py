# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sliders that the panel shows while a rig is active."""

from __future__ import annotations

import bpy
import pytest

from qc3d_addon.blender.ui import panel_rig

from .conftest import add_key
from .test_panel_results import Context, Layout

pytestmark = pytest.mark.usefixtures("quick_map")


@pytest.fixture
def rig() -> bpy.types.Object:
    """An armature in the scene."""
    obj = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(obj)
    return obj


def shown(rig: bpy.types.Object) -> list[str]:
    layout = Layout()
    bpy.context.view_layer.objects.active = rig
    panel_rig.draw(Context(rig), layout, rig)  # type: ignore[arg-type]
    return layout.texts


def test_nothing_baked_is_said(figure: bpy.types.Object, rig: bpy.types.Object) -> None:
    figure.parent = rig
    assert shown(rig) == ["No mesh of 'Rig' has in-betweens yet; select a mesh with shape keys to bake some."]


@pytest.mark.parametrize("how", ["modifier", "child", "child of a child"])
def test_the_sliders_of_its_meshes(figure: bpy.types.Object, rig: bpy.types.Object, how: str) -> None:
    for play_on, key in (("key", "Lean"), ("slider", "Stretch")):
        assert bpy.ops.qc3d.bake_inbetweens(
            from_key="Basis", to_key=key, play_on=play_on, mode="linear", count=1
        ) == {"FINISHED"}
    assert "No mesh" in shown(rig)[0]  # it does not move the figure yet
    if how == "modifier":
        figure.modifiers.new("Armature", 'ARMATURE').object = rig
    else:
        figure.parent = rig
    if how == "child of a child":
        figure.parent = bpy.data.objects.new("Between", None)
        figure.parent.parent = rig
    assert shown(rig) == ["Figure", '["Basis_to_Stretch"]', "value"]


def test_a_mesh_without_bakes_and_a_lost_slider(figure: bpy.types.Object, rig: bpy.types.Object) -> None:
    bpy.ops.mesh.primitive_cube_add()
    other = bpy.context.active_object
    add_key(other, "Basis", lambda rest: rest)
    bpy.context.view_layer.objects.active = figure
    assert bpy.ops.qc3d.bake_inbetweens(
        from_key="Basis", to_key="Lean", play_on="slider", mode="linear", count=1
    ) == {"FINISHED"}
    figure.parent = other.parent = rig
    del figure["Basis_to_Lean"]
    assert shown(rig) == ["Figure", "The slider 'Basis_to_Lean' was deleted; re-bake it first."]
