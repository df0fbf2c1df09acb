# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Entries in Blender's own menus."""

from __future__ import annotations

import bpy
import pytest

from .test_panel_results import Button


class Layout:
    """Takes note of what a menu has."""

    def __init__(self) -> None:
        self.entries: list[tuple[str, str]] = []

    def separator(self, **options: object) -> None:
        pass

    def operator(self, name: str, text: str = "", **options: object) -> Button:
        assert hasattr(bpy.ops.qc3d, name.removeprefix("qc3d."))
        self.entries.append((name, text))
        return Button()


@pytest.mark.parametrize("menu", ["VIEW3D_MT_object_animation", "MESH_MT_shape_key_context_menu"])
def test_entries(menu: str) -> None:
    class Menu:
        layout = Layout()

    for draw in getattr(bpy.types, menu).draw._draw_funcs:
        if draw.__module__.startswith("qc3d_addon"):
            draw(Menu, bpy.context)
    assert {"qc3d.bake_inbetweens", "qc3d.bake_keys"} <= {name for name, _ in Menu.layout.entries}
    if menu == "VIEW3D_MT_object_animation":  # search looks at the texts
        for word in ("in-between", "breakdown", "tween"):
            assert all(word in text.lower() for _, text in Menu.layout.entries)


def test_the_help_menu_has_the_demo_and_the_report() -> None:
    class Menu:
        layout = Layout()

    for draw in bpy.types.TOPBAR_MT_help.draw._draw_funcs:
        if draw.__module__.startswith("qc3d_addon"):
            draw(Menu, bpy.context)
    assert [name for name, _ in Menu.layout.entries] == ["qc3d.open_demo", "qc3d.copy_report", "qc3d.save_report"]
    assert Menu.layout.operator_context == 'INVOKE_DEFAULT'  # otherwise nothing asks about unsaved changes
