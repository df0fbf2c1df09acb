# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of the panel's options, and the preferences."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

from qc3d_addon.blender import preferences
from qc3d_addon.blender.bake import jobs
from qc3d_addon.blender.ui import presets
from qc3d_addon.worker.client import Limits


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user folder of the test's own."""
    monkeypatch.setattr(bpy.utils, "user_resource", lambda kind, path="", create=False: str(tmp_path / path))
    # Blender names the menu after the preset that was chosen last.
    monkeypatch.setattr(presets.QC3D_PT_presets, "bl_label", presets.QC3D_PT_presets.bl_label)
    (tmp_path / "presets" / "qc3d").mkdir(parents=True)
    return tmp_path / "presets" / "qc3d"


def test_saved_and_taken_up_again(figure: bpy.types.Object, folder: Path) -> None:
    chosen = {"count": 11, "use_tolerance": True, "mode": "linear", "quality": "fine", "engine": "delaunay", "seed": 5}
    for name, value in chosen.items():
        setattr(figure.qc3d, name, value)
    figure.qc3d.from_key = "Basis"
    assert bpy.ops.qc3d.add_preset(name="My faces") == {"FINISHED"}
    (path,) = folder.glob("*.py")
    for name in chosen:
        figure.qc3d.property_unset(name)
    figure.qc3d.from_key = "Lean"
    bpy.ops.script.execute_preset(filepath=str(path), menu_idname=presets.QC3D_PT_presets.__name__)
    assert {name: getattr(figure.qc3d, name) for name in chosen} == chosen
    assert figure.qc3d.from_key == "Lean"  # keys belong to one character
    assert presets.QC3D_PT_presets.bl_label == "My faces"


def test_every_choice_but_the_keys_and_frames_is_saved(figure: bpy.types.Object) -> None:
    keys = {"from_key", "via", "via_timing", "to_key", "extra_turns"}
    keys |= {"first", "last"}
    other = keys | {"use_keyframes", "frame_start", "frame_end", "measure", "colliders", "chosen", "row"}
    known = set(figure.qc3d.bl_rna.properties.keys()) - {"rna_type", "name"}
    assert set(presets.SETTINGS) == known - other


def test_the_button_says_why_it_is_disabled(figure: bpy.types.Object) -> None:
    figure.shape_key_clear()
    assert not bpy.ops.qc3d.add_preset.poll()
    with pytest.raises(RuntimeError, match="fewer than two shape keys"):
        bpy.ops.qc3d.add_preset(name="No")


class TestPreferences:
    def context(self, **values: int) -> SimpleNamespace:
        package = preferences.QC3DPreferences.bl_idname
        addons = {package: SimpleNamespace(preferences=SimpleNamespace(**values))} if values else {}
        return SimpleNamespace(preferences=SimpleNamespace(addons=addons))

    def test_what_is_set(self) -> None:
        limits = preferences.limits(self.context(time_limit=7, memory_limit=3000))  # type: ignore[arg-type]
        assert limits == Limits(seconds=420, memory_mb=3000)

    def test_the_defaults(self) -> None:
        for context in (self.context(), self.context(time_limit=60, memory_limit=0)):
            limits = preferences.limits(context)  # type: ignore[arg-type]
            assert limits.seconds == 3600
            assert limits.memory_mb > 500


def test_cancel_has_nothing_to_cancel() -> None:
    assert jobs.current() is None
    assert not bpy.ops.qc3d.cancel.poll()
    with pytest.raises(RuntimeError, match="No bake is running"):
        bpy.ops.qc3d.cancel()
