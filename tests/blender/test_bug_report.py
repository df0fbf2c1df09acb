# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The report for a bug has what is needed, and nothing that identifies the user's work."""

from __future__ import annotations

import re
from pathlib import Path

import bpy
import numpy as np
import pytest
import scipy

from qc3d_addon.blender.operators import common
from qc3d_addon.blender.operators.bug_report import report_text, version, without_names
from qc3d_addon.blender.store import mesh_data
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.frames.bug_reports import read_bug_report

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


def test_a_file_with_the_shapes_only_where_asked_for(figure: bpy.types.Object, tmp_path: Path) -> None:
    figure.qc3d.from_key, figure.qc3d.to_key, figure.qc3d.count = "Basis", "Lean", 4
    plain, full = tmp_path / "plain.zip", tmp_path / "full"
    assert bpy.ops.qc3d.save_report(filepath=str(plain)) == {'FINISHED'}
    assert read_bug_report(plain).task is None
    assert bpy.ops.qc3d.save_report(filepath=str(full), with_shapes=True) == {'FINISHED'}
    found = read_bug_report(full.with_suffix(".zip"))
    assert found.text == report_text(bpy.context)
    assert found.task is not None
    assert found.task.play is not None
    assert found.task.play.count == 4
    (pair,) = found.task.pairs.values()
    np.testing.assert_array_equal(pair.key1, mesh_data.key_coordinates(figure, "Lean"))


def test_a_half_comes_back_as_the_whole(figure: bpy.types.Object, tmp_path: Path) -> None:
    figure.qc3d.from_key, figure.qc3d.to_key = "Basis", "Lean"
    figure.modifiers.new("Mirror", "MIRROR")
    path = tmp_path / "report.zip"
    assert bpy.ops.qc3d.save_report(filepath=str(path), with_shapes=True) == {'FINISHED'}
    task = read_bug_report(path).task
    assert task is not None
    ((pair,), (baked,)) = task.pairs.values(), mesh_data.read_pairs(figure, ("Basis", "Lean")).values()
    assert pair.planes == baked.planes
    np.testing.assert_array_equal(pair.key1, baked.key1)


def test_a_file_is_written_where_nothing_can_be_baked(figure: bpy.types.Object, tmp_path: Path) -> None:
    path = tmp_path / "report.zip"
    figure.qc3d.from_key = figure.qc3d.to_key = "Basis"
    assert bpy.ops.qc3d.save_report(filepath=str(path), with_shapes=True) == {'FINISHED'}
    with pytest.raises(InputError, match="two different"):
        read_bug_report(path)
    bpy.ops.object.armature_add()
    assert bpy.ops.qc3d.save_report(filepath=str(path)) == {'FINISHED'}
    assert "Active object: ARMATURE" in read_bug_report(path).text
    with pytest.raises(RuntimeError, match="no shape keys to include"):
        bpy.ops.qc3d.save_report(filepath=str(path), with_shapes=True)


def test_a_file_that_cannot_be_written_is_an_error_of_one_sentence(figure: bpy.types.Object, tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match=r"report\.zip"):
        bpy.ops.qc3d.save_report(filepath=str(tmp_path / "no folder" / "report.zip"))
    with pytest.raises(RuntimeError, match="Name a file"):
        bpy.ops.qc3d.save_report(filepath="")
