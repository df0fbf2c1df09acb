# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d bake --combine``: keys that correct others, alone or after in-betweens."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import numpy as np
import pytest

from qc3d_addon.cli import main

from ..solver.combinations.arm import arm, posed


@pytest.fixture
def arm_file(tmp_path: Path) -> Path:
    """A .blend with the object "Arm" and its keys Basis, Raise and Bend."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    rest, faces = arm(25, 10)
    mesh = bpy.data.meshes.new("Arm")
    mesh.from_pydata(rest.tolist(), [], faces.tolist())
    obj = bpy.data.objects.new("Arm", mesh)
    bpy.context.collection.objects.link(obj)
    for name, shape in (("Basis", rest), ("Raise", posed(rest, 60.0, 0.0)), ("Bend", posed(rest, 0.0, 60.0))):
        key = obj.shape_key_add(name=name, from_mix=False)
        key.value = 0.0
        key.points.foreach_set("co", shape.astype(np.float32).ravel())
    path = tmp_path / "arm.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def bake(file: Path, output: Path, *more: str) -> int:
    return main.main(["bake", str(file), "--object", "Arm", "--output", str(output), *more])


def test_alone(arm_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output, report = tmp_path / "out.blend", tmp_path / "report.json"
    assert bake(arm_file, output, "--combine", "Bend", "Raise", "--report", str(report)) == 0
    assert "Raise + Bend: 4 keys" in capsys.readouterr().out
    [made] = json.loads(report.read_text())["combinations"]
    assert made["combined"]["keys"] == ["Raise", "Bend"]
    bpy.ops.wm.open_mainfile(filepath=str(output))
    names = [key.name for key in bpy.data.objects["Arm"].data.shape_keys.key_blocks]
    assert names[3:] == ["Raise_Bend_50_50", "Raise_Bend_50_100", "Raise_Bend_100_50", "Raise_Bend_100_100"]


def test_after_in_betweens(arm_file: Path, tmp_path: Path) -> None:
    output = tmp_path / "out.blend"
    assert bake(arm_file, output, "--all-keys", "--frames", "1", "--combine", "Bend", "Raise") == 0
    bpy.ops.wm.open_mainfile(filepath=str(output))
    blocks = bpy.data.objects["Arm"].data.shape_keys.key_blocks
    assert {"Raise_50", "Bend_50", "Raise_Bend_50_50", "Raise_Bend_100_100"} <= set(blocks.keys())


@pytest.mark.parametrize(
    ("names", "said"), [(["Raise"], "two or three"), (["Raise", "Fall"], "no shape key 'Fall'"), ([], "in one way")]
)
def test_one_sentence_where_it_cannot_be(
    names: list[str], said: str, arm_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "out.blend"
    assert bake(arm_file, output, *(["--combine", *names] if names else [])) == 2
    text = capsys.readouterr().err
    assert said in text
    assert text.count("\n") == 1
    assert not output.exists()
