# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender --command qc3d …``, with the add-on running."""

from __future__ import annotations

from pathlib import Path

import bpy
import pytest

from qc3d_addon.blender import cli

from ..command_lines import with_others

pytestmark = pytest.mark.usefixtures("quick_map")


@pytest.fixture
def command(figure: bpy.types.Object, tmp_path: Path) -> list[str]:
    """A command that bakes the figure."""
    path = tmp_path / "figure.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    pair = ["--object", "Figure", "--from", "Basis", "--to", "Lean", "--frames", "2"]
    return ["bake", str(path), *pair, "--output", str(tmp_path / "baked.blend")]


def test_it_bakes_a_file(command: list[str], tmp_path: Path) -> None:
    assert cli.run_command([*command, "--mode", "linear"]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "baked.blend"))
    made = [key.name for key in bpy.data.objects["Figure"].data.shape_keys.key_blocks if "_" in key.name]
    assert made == ["Lean_33", "Lean_67"]


def test_it_keeps_what_the_panel_showed(command: list[str], figure: bpy.types.Object, tmp_path: Path) -> None:
    figure.qc3d.to_key, figure.qc3d.count = "Stretch", 7
    bpy.ops.wm.save_mainfile()
    assert cli.run_command(command) == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "baked.blend"))
    settings = bpy.data.objects["Figure"].qc3d
    assert (settings.to_key, settings.count) == ("Stretch", 7)


def test_it_says_what_is_wrong(command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run_command(with_others(command, ["--to", "Grin"])) == 2
    text = capsys.readouterr().err
    assert text == "qc3d: There is no shape key 'Grin'; choose the second key from those of the mesh.\n"
    assert not (tmp_path / "baked.blend").exists()


@pytest.mark.parametrize("request_for_words", ["--help", "--version"])
def test_it_can_be_asked(request_for_words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run_command([request_for_words]) == 0
    assert "qc3d" in capsys.readouterr().out
