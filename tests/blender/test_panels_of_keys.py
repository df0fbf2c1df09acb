# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sub-panels for keys that are on at once, and for other programs."""

from __future__ import annotations

import bpy
import pytest

from qc3d_addon.blender.store import combined_keys
from qc3d_addon.blender.ui.panel_combinations import QC3D_PT_combinations
from qc3d_addon.blender.ui.panel_exports import QC3D_PT_exports

from .test_combinations import rig  # noqa: F401 - a fixture
from .test_panel_results import Context, Layout


def drawn(panel: type[bpy.types.Panel], obj: bpy.types.Object) -> Layout:
    class Panel:
        layout = Layout()

    assert panel.poll(Context(obj))
    panel.draw(Panel(), Context(obj))
    return Panel.layout


def names(layout: Layout) -> list[str]:
    return [name for name, _ in layout.buttons]


def test_verdicts_and_what_was_made(rig: bpy.types.Object) -> None:  # noqa: F811
    assert names(drawn(QC3D_PT_combinations, rig)) == ["combine_keys", "judge_pairs"]
    assert bpy.ops.qc3d.judge_pairs() == {"FINISHED"}
    layout = drawn(QC3D_PT_combinations, rig)
    name, button = layout.buttons[-1]
    assert (name, button.first, button.second) == ("combine_keys", "Raise", "Bend")
    assert any(text.startswith("Raise + Bend: ") for text in layout.texts)
    assert bpy.ops.qc3d.combine_keys(first=button.first, second=button.second) == {"FINISHED"}
    layout = drawn(QC3D_PT_combinations, rig)
    assert names(layout)[2:] == ["combine_keys", "combine_keys", "remove_combination"]
    again, turned, removed = (button for _, button in layout.buttons[2:])
    assert (again.first, again.second, again.third, again.find_order) == ("Raise", "Bend", "", False)
    assert (turned.first, turned.second, turned.find_order) == ("Bend", "Raise", False)
    assert bpy.ops.qc3d.remove_combination(label=removed.label) == {"FINISHED"}


def test_a_damaged_record_is_said(rig: bpy.types.Object) -> None:  # noqa: F811
    rig.data.shape_keys[combined_keys.PROPERTY] = "{}"
    assert any("damaged" in text for text in drawn(QC3D_PT_combinations, rig).texts)


def test_other_programs(rig: bpy.types.Object) -> None:  # noqa: F811
    layout = drawn(QC3D_PT_exports, rig)
    assert names(layout) == ["export_in_betweens"] * 3 + ["read_usd"]
    assert [button.format for name, button in layout.buttons[:3]] == [".usdc", ".fbx", ".glb"]


@pytest.mark.parametrize("panel", [QC3D_PT_combinations, QC3D_PT_exports])
def test_not_without_shape_keys(panel: type[bpy.types.Panel]) -> None:
    bpy.ops.mesh.primitive_cube_add()
    assert not panel.poll(Context(bpy.context.active_object))
