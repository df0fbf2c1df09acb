# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The report for a bug has what is needed, and nothing that identifies the user's work."""

from __future__ import annotations

import re

import bpy
import numpy as np
import pytest
import scipy

from qc3d_addon.blender.operators import common
from qc3d_addon.blender.operators.bug_report import report_text, version, without_names

SECRETS = ("Figure", "Lean", "Stretch", "Basis", "Secret", "alice")


@pytest.fixture(autouse=True)
def no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(common, "_errors", [])


def test_versions_settings_and_numbers(figure: bpy.types.Object) -> None:
    figure.qc3d.quality, figure.qc3d.count = "fine", 11
    figure.modifiers.new("Secret", "SUBSURF")
    text = report_text(bpy.context)
    for needed in (f"QC3D {version()}", bpy.app.version_string, f"numpy {np.__version__}", f"scipy {scipy.__version__}",
                   "42 vertices", "80 with 3 corners", "loose parts: 1", "with one: 0", "modifiers: SUBSURF",
                   "3 relative shape keys", "quality fine", "count 11", "colliders: no",
                   "Last error: none"):  # fmt: skip
        assert needed in text
    assert not any(secret in text for secret in SECRETS)


def test_results_of_bakes_are_numbers_without_names(figure: bpy.types.Object, quick_map: object) -> None:
    assert bpy.ops.qc3d.bake_inbetweens(from_key="Basis", to_key="Lean", count=2) == {'FINISHED'}
    text = report_text(bpy.context)
    assert "2 keys, 2 in-betweens, on a key: True" in text
    assert re.search(r"seconds \d", text)
    assert not any(secret in text for secret in SECRETS)


def test_the_last_error_is_there_without_names(figure: bpy.types.Object) -> None:
    with pytest.raises(RuntimeError, match="Secret"):
        bpy.ops.qc3d.bake_inbetweens(from_key="Basis", to_key="Secret")
    text = report_text(bpy.context)
    assert "Last error: QC3D_OT_bake_inbetweens: " in text
    assert not any(secret in text for secret in SECRETS)


@pytest.mark.parametrize(
    ("sentence", "expected"),
    [
        ("'Secret' is not a mesh.", "'…' is not a mesh."),
        ('The key "it\\"s" is gone.', "The key '…' is gone."),
        ("/home/alice/x.blend cannot be read.", "'…' cannot be read."),
        (r"C:\Users\alice\x.blend cannot be read.", "'…' cannot be read."),
        ("Figure stands beside Figures.", "… stands beside Figures."),
    ],
)
def test_names_are_left_out(figure: bpy.types.Object, sentence: str, expected: str) -> None:
    assert without_names(sentence) == expected


def test_without_a_mesh() -> None:
    assert "Active object: none" in report_text(bpy.context)
    bpy.ops.object.armature_add()
    assert "Active object: ARMATURE" in report_text(bpy.context)


def test_the_button_copies_it() -> None:
    assert bpy.ops.qc3d.copy_report() == {'FINISHED'}
