# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d reconstruct`` with every kind of input file, and its error messages."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.cli import main
from qc3d_addon.solver.maps.files import EIGEN_FORM, STRETCH, TARGET, TetFile, read_tets, write_tets
from qc3d_addon.solver.maps.mapping import Mapping
from qc3d_addon.solver.maps.representation import eigen_form, upper_triangle
from qc3d_addon.solver.tets.mesh import TetMesh

EXACT = 1e-10


def kuhn_cube(cells: int) -> TetMesh:
    """The unit cube in small cubes of six tetrahedra each."""
    ticks = np.linspace(0.0, 1.0, cells + 1)
    points = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    numbers = np.arange(len(points)).reshape((cells + 1,) * 3)
    corner = [
        numbers[x : x + cells, y : y + cells, z : z + cells].ravel() for x in (0, 1) for y in (0, 1) for z in (0, 1)
    ]
    six = [[0, 4, 6, 7], [0, 6, 2, 7], [0, 2, 3, 7], [0, 3, 1, 7], [0, 1, 5, 7], [0, 5, 4, 7]]
    return TetMesh(points, np.concatenate([np.column_stack([corner[c] for c in tet]) for tet in six]))


@pytest.fixture
def mapping() -> Mapping:
    """A map that slides on the cube's faces."""
    mesh = kuhn_cube(3)
    x, y, z = mesh.points.T
    bump = 0.05 * np.sin(np.pi * x) * np.cos(np.pi * y) * np.cos(2.0 * np.pi * z)
    # sin(pi) is not zero in floating point.
    bump[(x == 0.0) | (x == 1.0)] = 0.0
    found = Mapping(mesh, mesh.points + bump[:, None] * [1.0, 0.0, 0.0])
    assert found.folds == 0
    return found


def content(mapping: Mapping) -> TetFile:
    """The mesh with both forms of the representation, but not the map itself."""
    at_tets = {STRETCH: upper_triangle(mapping.stretch), EIGEN_FORM: eigen_form(mapping.stretch)}
    return TetFile(mapping.mesh.points, mapping.mesh.tets, {}, at_tets)


@pytest.mark.parametrize("ending", ["npz", "vtu", "vtk", "msh"])
@pytest.mark.parametrize("form", ["upper-triangle", "eigen"])
def test_a_map_comes_back_through_files(mapping: Mapping, tmp_path: Path, ending: str, form: str) -> None:
    source, output = tmp_path / f"map.{ending}", tmp_path / f"rebuilt.{ending}"
    write_tets(source, content(mapping))
    assert main.main(["reconstruct", str(source), "--form", form, "--output", str(output)]) == 0
    found = read_tets(output)
    np.testing.assert_array_equal(found.tets, mapping.mesh.tets)
    assert np.abs(found.mapping().values - mapping.values).max() < EXACT
    assert {STRETCH, EIGEN_FORM} <= found.at_tets.keys()


def test_a_format_without_values_gets_the_moved_mesh(mapping: Mapping, tmp_path: Path) -> None:
    source, output = tmp_path / "map.vtu", tmp_path / "moved.mesh"
    write_tets(source, content(mapping))
    assert main.main(["reconstruct", str(source), "--output", str(output)]) == 0
    moved = read_tets(output)
    assert np.abs(read_tets(source).mapping(moved).values - mapping.values).max() < EXACT


def test_a_fixed_boundary_and_landmarks(mapping: Mapping, tmp_path: Path) -> None:
    source, output, landmarks = tmp_path / "map.npz", tmp_path / "rebuilt.npz", tmp_path / "landmarks.csv"
    inside = np.flatnonzero(~mapping.mesh.on_cube_face.any(axis=1))[0]
    landmarks.write_text(f"vertex,x,y,z\n{inside},,0.4,\n")
    file = content(mapping)
    write_tets(source, TetFile(file.points, file.tets, {TARGET: mapping.values}, file.at_tets))
    command = ["reconstruct", str(source), "--boundary", "fixed", "--landmarks", str(landmarks)]
    assert main.main([*command, "--output", str(output)]) == 0
    values = read_tets(output).mapping().values
    assert values[inside, 1] == 0.4
    np.testing.assert_array_equal(values[mapping.mesh.on_cube_face.any(axis=1)],
                                  mapping.values[mapping.mesh.on_cube_face.any(axis=1)])
    assert np.abs(values[:, [0, 2]] - mapping.values[:, [0, 2]]).max() < EXACT


def test_folds_are_told(mapping: Mapping, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, landmarks = tmp_path / "map.npz", tmp_path / "landmarks.csv"
    inside = np.flatnonzero(~mapping.mesh.on_cube_face.any(axis=1))[0]
    landmarks.write_text(f"vertex,x,y,z\n{inside},3,,\n")
    write_tets(source, content(mapping))
    output = tmp_path / "rebuilt.npz"
    assert main.main(["reconstruct", str(source), "--landmarks", str(landmarks), "--output", str(output)]) == 0
    assert f"{read_tets(output).mapping().folds} of 162 tetrahedra are folded" in capsys.readouterr().err


class TestErrors:
    def run(self, capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
        assert main.main(["reconstruct", *map(str, arguments)]) == 2
        return capsys.readouterr().err

    def test_no_representation(self, mapping: Mapping, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        source = tmp_path / "map.npz"
        write_tets(source, TetFile(mapping.mesh.points, mapping.mesh.tets))
        said = self.run(capsys, source, "--output", tmp_path / "out.npz")
        assert "has no array 'stretch' of the tetrahedra; it has none" in said
        assert not (tmp_path / "out.npz").exists()

    @pytest.mark.parametrize(
        ("numbers", "sentence"),
        [
            (np.zeros((162, 5)), "needs six numbers"),
            (np.zeros((162, 6)), "not positive definite"),
            (np.full((162, 6), np.nan), "not finite"),
        ],
    )
    def test_a_representation_that_is_none(
        self,
        mapping: Mapping,
        tmp_path: Path,
        capsys: pytest.CaptureFixture[str],
        numbers: np.ndarray,
        sentence: str,
    ) -> None:
        source = tmp_path / "map.npz"
        write_tets(source, TetFile(mapping.mesh.points, mapping.mesh.tets, {}, {STRETCH: numbers}))
        assert sentence in self.run(capsys, source, "--output", tmp_path / "out.npz")

    def test_a_free_boundary_without_landmarks(
        self, mapping: Mapping, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        source = tmp_path / "map.npz"
        write_tets(source, content(mapping))
        said = self.run(capsys, source, "--boundary", "free", "--output", tmp_path / "out.npz")
        assert "held nowhere; give boundary values or landmarks" in said

    @pytest.mark.parametrize(
        ("text", "sentence"),
        [
            ("", "must begin with the row"),
            ("vertex,x,y,z\n", "names no landmarks"),
            ("vertex,x,y,z\n1,2,3\n", "row 2: four cells are needed"),
            ("vertex,x,y,z\n1,2,3,b\n", "row 2: could not convert"),
            ("vertex,x,y,z\n999,0,0,0\n", "no vertex of the mesh"),
        ],
    )
    def test_landmarks_that_are_none(
        self, mapping: Mapping, tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, sentence: str
    ) -> None:
        source, landmarks = tmp_path / "map.npz", tmp_path / "landmarks.csv"
        landmarks.write_text(text)
        write_tets(source, content(mapping))
        assert sentence in self.run(capsys, source, "--landmarks", landmarks, "--output", tmp_path / "out.npz")

    @pytest.mark.parametrize("name", ["map.npz", "map.vtu", "map.vtk", "map.msh", "map.mesh", "map.unknown"])
    def test_a_damaged_file(self, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
        (tmp_path / name).write_bytes(b"\x00\xffnot a mesh <VTKFile>")
        assert f"{name} " in self.run(capsys, tmp_path / name, "--output", tmp_path / "out.npz")
        said = self.run(capsys, tmp_path / "none.vtu", "--output", tmp_path / "out.npz")
        assert "none.vtu cannot be read" in said

    def test_a_surface(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        (tmp_path / "map.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
        said = self.run(capsys, tmp_path / "map.off", "--output", tmp_path / "out.npz")
        assert "holds no tetrahedra; it has triangle" in said
