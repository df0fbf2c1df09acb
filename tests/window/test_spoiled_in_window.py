# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of a damaged file: it draws, says what is wrong, and its button repairs it."""

from __future__ import annotations

import time

import pytest

from .harness import Window

SLIDER = "Basis_to_Bend and twist"


@pytest.fixture
def baked(window: Window) -> Window:
    window.ask("arm().qc3d.quality = 'normal'; arm().qc3d.mode = 'straight'; remember('Draft')")
    window.ask("with inside('UI'): bpy.ops.qc3d.bake_inbetweens('EXEC_DEFAULT', True)")
    return window


def complaints(window: Window) -> list[str]:
    """What Blender writes to its terminal while it draws the sidebar."""
    before = len(window.log)
    for _ in range(3):
        window.ask("region('UI').tag_redraw()")
        time.sleep(0.3)
    return [line for line in window.log[before:].splitlines() if "Error" in line or "Traceback" in line]


def test_sliders_of_any_type(baked: Window) -> None:
    for value in ("'text'", "b'ab'", "[1.0, 2.0]", "[1, 2]", "['a', 'b']", "{'a': 1}", "arm()", "True", "7", "None"):
        baked.ask(f"del arm()[{SLIDER!r}]; arm()[{SLIDER!r}] = {value}; arm().update_tag()")
        assert complaints(baked) == [], value
    baked.find("qc3d.rebake")
    baked.ask(f"del arm()[{SLIDER!r}]; arm()[{SLIDER!r}] = float('nan'); arm().update_tag()")
    assert not [line for line in complaints(baked) if "Traceback" in line]
    baked.ask(f"del arm()[{SLIDER!r}]")
    assert complaints(baked) == []


def test_a_damaged_record_is_forgotten_by_its_button(baked: Window) -> None:
    names = baked.ask("names()")
    for value in ("7", "'{'", "'[' * 100_000", "{'a': 1}"):
        baked.ask(f"arm().data.shape_keys.pop('qc3d'); arm().data.shape_keys['qc3d'] = {value}")
        assert complaints(baked) == []
    baked.ask("remember('Damaged')")
    baked.push("qc3d.forget_record")
    baked.wait_for("list(arm().data.shape_keys.keys()) == []")
    assert baked.ask("names()") == names
    assert complaints(baked) == []
    baked.press("ctrl+z")
    baked.wait_for("'qc3d' in arm().data.shape_keys")


def test_a_heat_map_that_was_changed(baked: Window) -> None:
    baked.ask("arm().qc3d.mode = 'natural'; view()[1].spaces.active.overlay.show_overlays = True")
    baked.ask("with inside('UI'): bpy.ops.qc3d.bake_inbetweens('EXEC_DEFAULT', True)")
    baked.ask("with inside('UI'): bpy.ops.qc3d.heat_map('EXEC_DEFAULT', True)")
    scale = """'{"slider": "a", "measure": "stretch", "scale": ["a", "b", "c", "d"]}'"""
    for value in ("7", "'{'", "'[' * 100_000", scale):
        baked.ask(f"arm().pop('qc3d_heat_map'); arm()['qc3d_heat_map'] = {value}; region('WINDOW').tag_redraw()")
        assert complaints(baked) == []
    baked.ask("with inside('UI'): bpy.ops.qc3d.heat_map('EXEC_DEFAULT', True, show='off')")
    assert baked.ask("[a.name for a in arm().data.attributes if 'QC3D' in a.name]") == []
