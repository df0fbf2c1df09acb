# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps saved after a bake and loaded for the same mesh in another file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.store.records import Record
from qc3d_addon.solver.settings import FitOptions

State = Callable[[], dict[str, Any]]


def bake(**choices: object) -> None:
    assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", mode="linear", **choices) == {"FINISHED"}


@pytest.fixture
def saved(figure: bpy.types.Object, quick_map: list[FitOptions], tmp_path: Path) -> Path:
    """The maps of a chain, saved; then the file from before the bake again."""
    blend, path = tmp_path / "before.blend", tmp_path / "figure.qc3dmap"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    bake(from_key="Basis", via=[{"name": "Lean"}], to_key="Stretch", quality="finest", engine="delaunay", seed=3)
    assert bpy.ops.qc3d.save_map(filepath=str(path.with_suffix(""))) == {"FINISHED"}
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    quick_map.clear()
    return path


def test_loaded_maps_are_used(saved: Path, quick_map: list[FitOptions]) -> None:
    obj = bpy.context.active_object
    assert not Record.read(obj.data.shape_keys).maps
    assert bpy.ops.qc3d.load_map(filepath=str(saved)) == {"FINISHED"}
    panel = obj.qc3d
    assert (panel.from_key, [inner.name for inner in panel.via], panel.to_key) == ("Basis", ["Lean"], "Stretch")
    assert (panel.quality, panel.engine, panel.seed) == ("finest", "delaunay", 3)
    bake()
    assert not quick_map  # nothing was meshed
    bake(from_key="Basis", to_key="Lean", quality="finest", engine="delaunay", seed=3)
    assert not quick_map
    bake(from_key="Basis", to_key="Lean", quality="normal")
    assert len(quick_map) == 1


def test_the_frames_are_those_of_the_bake(
    saved: Path, shapes: Callable[[bpy.types.Object], dict[str, np.ndarray]]
) -> None:
    obj = bpy.context.active_object
    bake(from_key="Basis", via=[{"name": "Lean"}], to_key="Stretch", quality="finest", engine="delaunay", seed=3)
    made = shapes(obj)
    bpy.ops.qc3d.remove()
    assert bpy.ops.qc3d.load_map(filepath=str(saved)) == {"FINISHED"}
    bake()
    for name, positions in shapes(obj).items():
        np.testing.assert_array_equal(positions, made[name])


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ("moved", "From 'Basis' to 'Lean': The stored map belongs to other keys or another mesh"),
        ("renamed", "has maps for 'Lean', but 'Figure' has no shape key of that name"),
        ("damaged", "The stored map is damaged"),
        ("cut", "sizes of its maps do not fit"),
        ("other", "is not a file of maps between shape keys"),
    ],
)
def test_what_does_not_belong_changes_nothing(saved: Path, change: str, sentence: str, state: State) -> None:
    keys = bpy.context.active_object.data.shape_keys
    data = bytearray(saved.read_bytes())
    if change == "moved":
        keys.key_blocks["Lean"].points[0].co.x += 0.001
    elif change == "renamed":
        keys.key_blocks["Lean"].name = "Other"
    elif change == "damaged":
        data[-1] ^= 1
    elif change == "cut":
        del data[-1]
    else:
        data[0] ^= 1
    saved.write_bytes(data)
    before = state()
    with pytest.raises(RuntimeError, match=sentence):
        bpy.ops.qc3d.load_map(filepath=str(saved))
    assert state() == before
    assert bpy.context.active_object.qc3d.from_key == ""


def test_maps_of_keys_that_were_changed_are_not_saved(
    figure: bpy.types.Object, quick_map: list[FitOptions], tmp_path: Path
) -> None:
    bake(from_key="Basis", to_key="Lean")
    figure.data.shape_keys.key_blocks["Lean"].points[0].co.x += 0.001
    with pytest.raises(RuntimeError, match="no longer matches the keys; re-bake first"):
        bpy.ops.qc3d.save_map(filepath=str(tmp_path / "a.qc3dmap"))
    assert not list(tmp_path.iterdir())


def test_a_file_must_be_named(figure: bpy.types.Object, quick_map: list[FitOptions], tmp_path: Path) -> None:
    bake(from_key="Basis", to_key="Lean")
    with pytest.raises(RuntimeError, match="Name a file to write"):
        bpy.ops.qc3d.save_map()
    with pytest.raises(RuntimeError, match="Name a file to read"):
        bpy.ops.qc3d.load_map()
    with pytest.raises(RuntimeError, match="cannot be written"):
        bpy.ops.qc3d.save_map(filepath=str(tmp_path / "none" / "a.qc3dmap"))
    with pytest.raises(RuntimeError, match="cannot be read"):
        bpy.ops.qc3d.load_map(filepath=str(tmp_path / "none.qc3dmap"))
