# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d analyze`` on keys and on meshes: its files, and its error messages."""

from __future__ import annotations

import json
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib import image, pyplot
from matplotlib.figure import Figure
from scipy.spatial import Delaunay

from qc3d_addon.cli import main
from qc3d_addon.solver.maps.analysis import Analysis
from qc3d_addon.solver.maps.files import EIGEN_FORM, STRETCH, TARGET, TetFile, read_tets, write_tets
from qc3d_addon.solver.maps.mapping import Mapping
from qc3d_paper.drawing.shading import upright
from qc3d_paper.drawing.slices import cut, save_histograms


@pytest.fixture
def blob() -> TetFile:
    """Tetrahedra of random points, twice as long along x after the map."""
    points = np.random.default_rng(0).uniform(size=(60, 3))
    return TetFile(points, Delaunay(points).simplices, {TARGET: points * [2.0, 1.0, 1.0]})


@pytest.fixture
def keys(tmp_path: Path) -> Path:
    """A tetrahedron-like closed surface that grows."""
    path = tmp_path / "keys.npz"
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    np.savez(path, faces=faces, shape_names=["small", "long"], V0=points, V1=points * [1.0, 1.0, 1.5])
    return path


@pytest.mark.parametrize("ending", ["npz", "vtu"])
def test_a_mesh(blob: TetFile, tmp_path: Path, ending: str) -> None:
    write_tets(tmp_path / "map.npz", blob)
    folder = tmp_path / "new" / "folder"
    assert main.main(["analyze", str(tmp_path / "map.npz"), "--format", ending, "--output", str(folder)]) == 0
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["tetrahedra"] == len(blob.tets)
    for name, value in {"a": 2.0, "b": 1.0, "c": 1.0, "dilatation": 2.0, "volume_ratio": 2.0}.items():
        np.testing.assert_allclose([summary[name]["smallest"], summary[name]["largest"]], value, rtol=1e-6)
    written = read_tets(folder / f"mapping.{ending}")
    np.testing.assert_allclose(written.at_tets[STRETCH], np.tile([2, 0, 0, 1, 0, 1], (len(blob.tets), 1)), atol=1e-6)
    assert written.at_tets[EIGEN_FORM].shape == (len(blob.tets), 6)
    np.testing.assert_allclose(written.at_vertices["outer_dilatation_at_vertices"], 4.0, rtol=1e-6)
    for name in ("histograms", "slices"):
        assert image.imread(folder / f"{name}.png").std() > 0.05


def test_what_it_writes_can_be_rebuilt(blob: TetFile, tmp_path: Path) -> None:
    write_tets(tmp_path / "map.npz", blob)
    assert main.main(["analyze", str(tmp_path / "map.npz"), "--output", str(tmp_path)]) == 0
    rebuilt = tmp_path / "rebuilt.npz"
    command = ["reconstruct", str(tmp_path / "mapping.npz"), "--boundary", "fixed", "--output", str(rebuilt)]
    assert main.main(command) == 0
    np.testing.assert_allclose(read_tets(rebuilt).at_vertices[TARGET], blob.at_vertices[TARGET], atol=1e-9)


def test_a_second_file_as_the_target(blob: TetFile, tmp_path: Path) -> None:
    write_tets(tmp_path / "source.vtk", TetFile(blob.points, blob.tets))
    write_tets(tmp_path / "target.mesh", blob)
    command = ["analyze", str(tmp_path / "source.vtk"), "--target", str(tmp_path / "target.mesh")]
    assert main.main([*command, "--output", str(tmp_path / "out")]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["dilatation"]["median"] == pytest.approx(2.0, rel=1e-6)


def test_two_keys(keys: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "out"
    command = ["analyze", str(keys), "--from", "small", "--to", "long", "--engine", "delaunay", "--quality", "normal"]
    assert main.main([*command, "--output", str(folder)]) == 0
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["folds"] == 0
    assert summary["volume"]["target"] == pytest.approx(1.0)
    # Without the rigid motion that is taken out first, the longest edge grows by half.
    assert summary["surface"]["stretch"]["largest"] == pytest.approx(1.5, rel=1e-6)
    with np.load(folder / "surface.npz") as stored:
        assert {"faces", "key0", "key1", "stretch", "volume", "dilatation"} == set(stored.files)
    assert image.imread(folder / "surface.png").std() > 0.05
    said = capsys.readouterr().out
    assert len(said.splitlines()) == 1
    assert said.startswith(f"{summary['tetrahedra']} tetrahedra, 0 folds; volume ratio ")
    upright = image.imread(folder / "surface.png")
    assert main.main([*command, "--up", "y", "--output", str(folder)]) == 0
    assert image.imread(folder / "surface.png").shape != upright.shape or (
        image.imread(folder / "surface.png") != upright
    ).any()


@pytest.mark.parametrize("up", ["x", "y", "z"])
def test_the_axis_that_points_up(up: str) -> None:
    points = np.random.default_rng(0).normal(size=(20, 3))
    turned = upright(points, up)
    np.testing.assert_array_equal(turned[:, 2], points[:, "xyz".index(up)])
    # A rotation: lengths and the volume of three edges stay, with its sign.
    assert np.linalg.det(turned[:3]) == pytest.approx(np.linalg.det(points[:3]))


def test_memory_is_bounded(data_folder: Path, tmp_path: Path) -> None:
    """In a process of its own: the most that another test has held counts for the whole process."""
    script = (
        "import sys; from qc3d_addon.cli import main; from qc3d_addon.solver.support.memory import peak_memory_mb;"
        "assert main.main(sys.argv[1:]) == 0; print(peak_memory_mb())"
    )
    keys = [str(data_folder / "head.npz"), "--from", "neutral", "--to", "jawOpen", "--up", "y"]
    command = [sys.executable, "-c", script, "analyze", *keys, "--output", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert float(done.stdout.splitlines()[-1]) < 300.0


@pytest.mark.parametrize("widest", [1.2, 3.0, 40.0, 1e5])
def test_labels_of_histograms_keep_apart(widest: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points = np.random.default_rng(0).uniform(size=(60, 3))
    bent = points * np.array([1.0, 1.0, widest]) + points[:, [1, 2, 0]] ** 2 * 0.1
    figures: list[Figure] = []
    monkeypatch.setattr(pyplot, "close", figures.append)
    save_histograms(Analysis(Mapping.checked(points, Delaunay(points).simplices, bent)), tmp_path / "picture.png")
    for axes in figures[0].axes:
        low, high = axes.get_xlim()
        labels = [*axes.get_xticklabels(), *axes.get_xticklabels(minor=True)]
        seen = [label for label in labels if label.get_text() and low <= label.get_position()[0] <= high]
        assert len(seen) > 1
        boxes = sorted((label.get_window_extent() for label in seen), key=lambda box: box.x0)
        assert all(first.x1 < second.x0 for first, second in pairwise(boxes))


class TestErrors:
    def said(self, capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
        assert main.main(["analyze", *map(str, arguments)]) == 2
        return capsys.readouterr().err

    def test_no_target(self, blob: TetFile, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        write_tets(tmp_path / "map.npz", TetFile(blob.points, blob.tets))
        assert "no array 'target'" in self.said(capsys, tmp_path / "map.npz", "--output", tmp_path / "out")
        assert not (tmp_path / "out").exists()

    def test_another_target(self, blob: TetFile, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        write_tets(tmp_path / "map.npz", blob)
        write_tets(tmp_path / "other.npz", TetFile(blob.points, blob.tets[::-1]))
        said = self.said(capsys, tmp_path / "map.npz", "--target", tmp_path / "other.npz", "--output", tmp_path / "out")
        assert "different tetrahedra" in said

    def test_one_key(self, keys: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        assert "give both" in self.said(capsys, keys, "--from", "small", "--output", tmp_path / "out")

    def test_keys_and_a_target(self, keys: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        arguments = ["--from", "small", "--to", "long", "--target", keys, "--output", tmp_path / "out"]
        assert "is for tetrahedral meshes only" in self.said(capsys, keys, *arguments)

    def test_a_folder_that_is_a_file(self, blob: TetFile, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        write_tets(tmp_path / "map.npz", blob)
        assert "cannot be made a folder" in self.said(capsys, tmp_path / "map.npz", "--output", tmp_path / "map.npz")


def test_cuts_have_the_area_of_the_plane() -> None:
    points = np.random.default_rng(1).uniform(size=(300, 3))
    cube = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    points = np.concatenate([cube, points])
    tets = Delaunay(points).simplices
    for axis, place in ((0, 0.5), (1, 0.123), (2, 0.9)):
        rows, polygons = cut(points, tets, axis, place)
        x, y = polygons[..., 0], polygons[..., 1]
        areas = 0.5 * np.abs((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1))
        assert abs(areas.sum() - 1.0) < 1e-10
        across = (points[tets[rows], axis] > place).any(axis=1) & (points[tets[rows], axis] <= place).any(axis=1)
        assert across.all()
