# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The shipped demo files are exactly what their script makes, and can be baked."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

from benchmarks.lid import crossings
from qc3d_addon.blender.store.mesh_data import key_coordinates, triangles

FILES = {
    "limb": ("Arm", ["Basis", "Bend 90", "Twist 120", "Bend and twist"]),
    "suzanne": ("Suzanne", ["Basis", "Jaw drop", "Ears back", "Surprise"]),
    "lid": ("Lid", ["Basis", "Closed"]),
    "figure": ("Arm", ["Basis", "Bend", "Fist"]),
}
FOLDERS = {"figure": "qc3d_addon/demo"}


@pytest.fixture(scope="module")
def made_again(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("assets")
    command = [sys.executable, str(repository / "assets" / "make_assets.py"), str(folder)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    return folder


def shapes(path: Path, name: str) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Names of the shape keys, their positions (k, n, 3), and the triangles."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    obj = bpy.data.objects[name]
    names = obj.data.shape_keys.key_blocks.keys()
    return names, np.stack([key_coordinates(obj, key) for key in names]), triangles(obj.data)


@pytest.mark.parametrize("name", FILES)
def test_the_shipped_file_is_what_the_script_makes(name: str, repository: Path, made_again: Path) -> None:
    obj, expected = FILES[name]
    names, positions, faces = shapes(repository / FOLDERS.get(name, "assets") / f"{name}.blend", obj)
    names_again, positions_again, faces_again = shapes(made_again / f"{name}.blend", obj)
    assert names == names_again == expected
    np.testing.assert_array_equal(faces, faces_again)
    np.testing.assert_allclose(positions, positions_again, atol=1e-4 if name in ("limb", "figure") else 1e-5)


@pytest.mark.parametrize("name", ["limb", "suzanne"])
def test_a_part_of_it_stays_still_and_every_key_moves(name: str, repository: Path) -> None:
    _, positions, _ = shapes(repository / "assets" / f"{name}.blend", FILES[name][0])
    motion = np.linalg.norm(positions[1:] - positions[0], axis=2)
    diagonal = np.linalg.norm(np.ptp(positions[0], axis=0))
    assert ((motion == 0.0).mean(axis=1) > 0.15).all()
    assert (motion.max(axis=1) > 0.05 * diagonal).all()


@pytest.mark.parametrize("name", FILES)
def test_it_is_small(name: str, repository: Path) -> None:
    size = (repository / FOLDERS.get(name, "assets") / f"{name}.blend").stat().st_size
    assert size < (1_000_000 if name == "figure" else 400_000)


@pytest.mark.parametrize("name", ["Face", "Lids", "Brows"])
def test_the_figures_other_meshes_are_what_the_script_makes(name: str, repository: Path, made_again: Path) -> None:
    names, positions, faces = shapes(repository / "qc3d_addon/demo/figure.blend", name)
    names_again, positions_again, faces_again = shapes(made_again / "figure.blend", name)
    assert names == names_again
    np.testing.assert_array_equal(faces, faces_again)
    np.testing.assert_allclose(positions, positions_again, atol=1e-4)  # they are rounded


@pytest.mark.slow
def test_the_figures_lids_and_arm_are_baked_without_folds_or_crossings(repository: Path, tmp_path: Path) -> None:
    from qc3d_addon.cli import main

    file = str(repository / "qc3d_addon/demo/figure.blend")
    for name, key, more in (("Arm", "Bend", []), ("Lids", "Blink.L", ["--colliders", "Eyes"])):
        report = tmp_path / f"{name}.json"
        files = ["--output", str(tmp_path / f"{name}.blend"), "--report", str(report)]
        assert main.main(["bake", file, "--object", name, "--on-key", key, "--frames", "3", *more, *files]) == 0
        found = json.loads(report.read_text())["keys"][0]["report"]
        assert found["folds"] == {"map": 0, "frames": [0] * 5}
        assert found["crossings"] == [0] * 5
        assert found["played"]["folds"] == found["played"]["crossings"] == 0
        assert found["collider_crossings"] == ([0] * 5 if more else None)


def test_a_straight_blend_of_the_lid_goes_through_the_eyeball_and_ours_does_not(
    repository: Path, tmp_path: Path
) -> None:
    from qc3d_addon.cli import main

    file, report = repository / "assets" / "lid.blend", tmp_path / "report.json"
    keys = ["--object", "Lid", "--from", "Basis", "--to", "Closed", "--frames", "7"]
    files = ["--output", str(tmp_path / "lid.blend"), "--report", str(report)]
    assert main.main(["bake", str(file), *keys, "--engine", "delaunay", "--colliders", "Eyeball", *files]) == 0
    _, positions, _ = shapes(tmp_path / "lid.blend", "Lid")
    lid = bpy.data.objects["Lid"]
    straight = crossings(lid, [(1.0 - t) * positions[0] + t * positions[1] for t in np.linspace(0.0, 1.0, 9)])
    assert straight[0] == straight[-1] == 0
    assert min(straight[2:-1]) > 50
    assert crossings(lid, list(positions)) == [0] * len(positions)
    assert json.loads(report.read_text())["collider_crossings"] == [0] * 9
