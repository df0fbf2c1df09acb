# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d bake``: from a .blend file to one with in-betweens, and one sentence for unusable input."""

from __future__ import annotations

import json
import os
from pathlib import Path

import bpy
import pytest

from qc3d_addon.cli import main

from ..command_lines import with_others

QUICK = ["--quality", "normal", "--engine", "delaunay"]


def bake(file: Path, *more: str) -> int:
    command = ["bake", str(file), "--object", "Bar", "--from", "Basis", "--to", "Bent", "--frames", "2"]
    command += ["--play-on", "slider"]
    return main.main(with_others([*command, "--output", "out.blend", *QUICK], more))


def test_the_file_gets_its_inbetweens(bar_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    before = bar_scene.read_bytes()
    assert bake(bar_scene, "--report", "out.json", "--keyframes", "10", "30") == 0
    assert bar_scene.read_bytes() == before
    assert sorted(os.listdir()) == ["out.blend", "out.json"]

    report = json.loads(Path("out.json").read_text())
    assert report["folds"]["map"] == 0
    assert len(report["folds"]["frames"]) == 4
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    obj = bpy.data.objects["Bar"]
    assert obj.data.shape_keys.key_blocks.keys() == ["Basis", "Bent", *report["keys"]]
    assert obj[report["slider"]] == 0.0
    for frame, value in ((10, 0.0), (20, 0.5), (30, 1.0)):
        bpy.context.scene.frame_set(frame)
        assert obj[report["slider"]] == pytest.approx(value, abs=1e-6)


def test_a_chain_goes_there_and_back(bar_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert bake(bar_scene, "--via", "Bent", "--to", "Basis", "--report", "out.json", "--mode", "linear") == 0
    report = json.loads(Path("out.json").read_text())
    assert report["via"] == ["Bent"]
    assert report["keys"] == [f"Basis_to_Bent_to_Basis_{100 * step / 6:.0f}" for step in range(1, 6)]
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    assert set(report["keys"]) < set(bpy.data.objects["Bar"].data.shape_keys.key_blocks.keys())


@pytest.mark.parametrize(
    ("times", "via_at", "frames"),
    [
        (["--keyframes", "10", "15", "30"], 0.25, [(10, 0.0), (15, 0.25), (30, 1.0)]),
        (["--via-at", "0.6"], 0.6, []),
        (["--via-at", "0.6", "--keyframes", "10", "15", "30"], 0.6, [(10, 0.0), (15, 0.6), (30, 1.0)]),
    ],
)
def test_keys_on_the_way_at_values_and_frames(
    bar_scene: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    times: list[str],
    via_at: float,
    frames: list[tuple[int, float]],
) -> None:
    monkeypatch.chdir(tmp_path)
    way = ["--via", "Bent", "--to", "Basis", "--report", "out.json", "--mode", "linear"]
    assert bake(bar_scene, *way, *times) == 0
    report = json.loads(Path("out.json").read_text())
    assert report["places"][3] == pytest.approx(via_at)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    for frame, value in frames:
        bpy.context.scene.frame_set(frame)
        assert bpy.data.objects["Bar"][report["slider"]] == pytest.approx(value, abs=1e-6)


def test_a_file_may_be_baked_into_itself(bar_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    copy = tmp_path / "out.blend"
    copy.write_bytes(bar_scene.read_bytes())
    assert bake(copy) == 0
    assert os.listdir() == ["out.blend"]
    bpy.ops.wm.open_mainfile(filepath=str(copy))
    assert len(bpy.data.objects["Bar"].data.shape_keys.key_blocks) > 3


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--object", "Foo"], "has no object 'Foo'; its meshes: 'Bar', 'Plain'"),
        (["--object", "Plain"], "'Plain' has fewer than two shape keys"),
        (["--to", "Up"], "no shape key 'Up'"),
        (["--to", "Basis"], "two different keys"),
        (["--via", "Up"], "no shape key 'Up'; choose inner key 1"),
        (["--frames", "0"], "0 in-betweens are not possible"),
        (["--frames", "5000"], "5000 in-betweens are not possible"),
        (["--frames", "-1"], "-1 in-betweens are not possible"),
        (["--keyframes", "9", "9"], "must come after the first"),
        (["--keyframes", "9", "10", "11"], "3 frames are given for 2 keys"),
        (["--via-at", "0.5"], "1 times are given for 0 keys"),
        (["--output", "missing/out.blend"], "out.blend cannot be written: No such file or directory"),
        (["--report", "out.blend"], "named twice"),
    ],
)
def test_unusable_options(
    options: list[str],
    said: str,
    bar_scene: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    before = bar_scene.read_bytes()
    assert bake(bar_scene, *options) == 2
    text = capsys.readouterr().err
    assert said in text
    assert text.startswith("qc3d: ")
    assert text.count("\n") == 1
    assert os.listdir() == []
    assert bar_scene.read_bytes() == before


@pytest.mark.parametrize("kind", ["missing", "text", "folder"])
def test_files_that_are_no_scene(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "odd.blend"
    if kind == "text":
        path.write_text("not a scene")
    elif kind == "folder":
        path.mkdir()
    assert bake(path) == 2
    text = capsys.readouterr().err
    assert text.startswith("qc3d: ")
    assert "odd.blend" in text
    assert text.count("\n") == 1
    assert not Path("out.blend").exists()


def bake_keys(file: Path, *options: str) -> int:
    return main.main(["bake", str(file), "--output", "out.blend", "--report", "out.json", *QUICK, *options])


def test_keys_on_themselves(
    bar_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert bake_keys(bar_scene, "--object", "Bar", "--all-keys", "--frames", "2") == 0
    assert "Bar: Bent: 2 in-betweens" in capsys.readouterr().out
    (told,) = json.loads(Path("out.json").read_text())["keys"]
    assert (told["key"], told["ended"], told["report"]["keys"]) == ("Bent", "baked", ["Bent_33", "Bent_67"])
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    assert "Bent_33" in bpy.data.objects["Bar"].data.shape_keys.key_blocks
    assert bake_keys(Path("out.blend"), "--all-objects", "--on-key", "Bent", "--tolerance", "0.001") == 0
    report = json.loads(Path("out.json").read_text())
    assert list(report) == ["Bar"]  # all that has two keys
    assert report["Bar"]["keys"][0]["report"]["count"] >= 1


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--object", "Bar", "--on-key", "Grin"], "no shape key 'Grin' on 'Bar'"),
        (["--object", "Bar", "--on-key", "Basis"], "'Basis' cannot play in-betweens"),
        (["--object", "Bar"], "Name the keys in one way"),
        (["--object", "Bar", "--all-keys", "--on-key", "Bent"], "Name the keys in one way"),
        (["--object", "Bar", "--all-keys", "--to", "Bent"], "Name the keys in one way"),
        (["--object", "Bar", "--from", "Basis"], "required: --from, --to"),
        (["--all-keys"], "ne of the arguments --object --all-objects is required"),
        (["--object", "Bar", "--all-keys", "--frames", "2", "--frames", "3"], "--frames: it is given twice"),
        (["--object", "Bar", "--all-keys", "--frames", "2", "--tolerance", "3"], "not allowed with argument --frames"),
        (["--object", "Bar", "--all-keys", "--tolerance", "0"], "it must be a distance above 0"),
        (["--object", "Bar", "--all-keys", "--keyframes", "1", "2"], "neither --keyframes nor"),
    ],
)
def test_unusable_options_of_many_keys(
    options: list[str],
    said: str,
    bar_scene: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert bake_keys(bar_scene, *options) == 2
    assert said in capsys.readouterr().err
    assert os.listdir() == []
