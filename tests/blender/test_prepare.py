# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Kept fits: a pair is fitted once, and its map stays in the file until a key, the mesh or the settings change."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

import bpy
import pytest

from qc3d_addon.blender.store.records import Record
from qc3d_addon.solver.fit import storage
from qc3d_addon.solver.settings import Mode

PAIR = {"from_key": "Basis", "to_key": "Lean"}


def bake(**choices: object) -> None:
    assert bpy.ops.qc3d.bake_inbetweens(
        play_on="slider", **{**PAIR, "count": 1, "mode": 'linear', **choices}
    ) == {'FINISHED'}


def map_properties() -> dict[str, bytes]:
    keys = bpy.data.objects["Figure"].data.shape_keys
    return {name: data for name, data in keys.items() if name.startswith("qc3d_map")}


def reload(folder: Path) -> None:
    path = str(folder / "kept.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)


def test_a_real_map_survives_saving_and_loading(
    figure: bpy.types.Object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, work_here: None
) -> None:
    from qc3d_addon.solver.frames import task

    real = {"quality": 'normal', "engine": 'delaunay'}
    assert bpy.ops.qc3d.prepare(**PAIR, **real) == {'FINISHED'}
    kept = map_properties()
    reload(tmp_path)
    assert map_properties() == kept
    monkeypatch.setattr(task, "fit_pair", None)  # a call would raise
    bake(**real)
    assert map_properties() == kept


def test_bakes_after_it_skip_meshing_and_fitting(figure: bpy.types.Object, quick_map: list[Any]) -> None:
    bpy.ops.qc3d.prepare(**PAIR)
    assert len(quick_map) == 1
    assert [key.name for key in figure.data.shape_keys.key_blocks] == ["Basis", "Lean", "Stretch"]
    bake()
    bake(count=5)
    assert len(quick_map) == 1


def test_a_bake_keeps_its_map_for_the_next(figure: bpy.types.Object, quick_map: list[Any], tmp_path: Path) -> None:
    bake()
    reload(tmp_path)
    bake(count=2)
    assert len(quick_map) == 1


@pytest.mark.parametrize("name", ["Basis", "Lean"])
def test_a_sculpted_key_asks_for_a_new_map(figure: bpy.types.Object, quick_map: list[Any], name: str) -> None:
    bake()
    figure.data.shape_keys.key_blocks[name].points[3].co.z += 1e-3
    bake()
    assert len(quick_map) == 2
    assert len(map_properties()) == 1


def test_other_settings_ask_for_a_new_map(figure: bpy.types.Object, quick_map: list[Any]) -> None:
    fine = {"quality": 'finest', "engine": 'auto'}
    for choices in ({}, {"quality": 'finest'}, fine, fine):
        bake(**choices)
    assert len(quick_map) == 3


def test_the_same_map_serves_every_mode(figure: bpy.types.Object, quick_map: list[Any]) -> None:
    for mode in get_args(Mode):
        bake(mode=mode)
    assert len(quick_map) == 1


def test_each_pair_has_its_own_and_a_deleted_keys_map_goes(figure: bpy.types.Object, quick_map: list[Any]) -> None:
    bake()
    bake(to_key="Stretch")
    bake()
    assert len(quick_map) == 2
    assert len(map_properties()) == 2
    figure.shape_key_remove(figure.data.shape_keys.key_blocks["Stretch"])
    bake()
    assert len(map_properties()) == 1


def test_prepare_makes_the_map_anew(figure: bpy.types.Object, quick_map: list[Any]) -> None:
    bpy.ops.qc3d.prepare(**PAIR)
    bpy.ops.qc3d.prepare(**PAIR)
    assert len(quick_map) == 2


@pytest.mark.parametrize(("version", "which"), [(-3, "an earlier"), (1, "a later")])
def test_a_map_of_another_version_is_made_again_and_a_note_says_so(
    figure: bpy.types.Object, quick_map: list[Any], monkeypatch: pytest.MonkeyPatch, version: int, which: str
) -> None:
    monkeypatch.setattr(storage, "FORMAT_VERSION", storage.FORMAT_VERSION + version)
    assert bpy.ops.qc3d.prepare(**PAIR) == {'FINISHED'}
    monkeypatch.undo()
    bake()
    note = f"The stored map from 'Basis' to 'Lean' was made by {which} version of QC3D and was computed again."
    assert note in Record.read(figure.data.shape_keys).chains[0].result.notes
    (data,) = map_properties().values()
    assert storage.why_unusable(bytes(data)) is None
    before = map_properties()
    bake(count=2)
    assert note not in Record.read(figure.data.shape_keys).chains[0].result.notes
    assert map_properties() == before


def test_a_map_of_another_version_is_not_saved_as_a_file(
    figure: bpy.types.Object, quick_map: list[Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    bake()
    monkeypatch.setattr(storage, "FORMAT_VERSION", storage.FORMAT_VERSION - 1)
    with pytest.raises(RuntimeError, match="no longer matches the keys; re-bake first"):
        bpy.ops.qc3d.save_map(filepath=str(tmp_path / "a.qc3dmap"))
    assert list(tmp_path.iterdir()) == []


def test_a_damaged_map_is_made_again_and_a_note_says_so(figure: bpy.types.Object, quick_map: list[Any]) -> None:
    bake()
    (name,) = map_properties()
    whole = map_properties()[name]
    figure.data.shape_keys[name] = whole[:100]
    bake(count=2)
    note = "The stored map from 'Basis' to 'Lean' is damaged and was computed again."
    assert note in Record.read(figure.data.shape_keys).chains[0].result.notes
    assert len(quick_map) == 2
    assert len(map_properties()[name]) == len(whole)
    bake(count=2)
    assert note not in Record.read(figure.data.shape_keys).chains[0].result.notes
    assert len(quick_map) == 2
