# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d reconstruct`` with every kind of input file, and its error messages."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from qc3d_addon.cli import main
from qc3d_addon.cli.landmarks import read_landmarks
from qc3d_addon.solver.errors import InputError
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
    said = capsys.readouterr()
    assert f"{read_tets(output).mapping().folds} of 162 tetrahedra are folded" in said.err
    folds = read_tets(output).mapping().folds
    assert said.out.startswith(f"162 tetrahedra reconstructed, {folds} folds; volume ratio ")
    assert len(said.out.splitlines()) == 1


@pytest.mark.parametrize(
    "table",
    [
        b"vertex,x,y,z\n{},,0.4,\n",
        b"\xef\xbb\xbfVertex;X;Y;Z\r\n{};;0,4;\r\n;;;\r\n",
        b"sep=;\r\nVERTEX;X;Y;Z;\r\n{};;0,4;;\r\n",
        b"\xff\xfe" + "y\tvertex\tz\tx\r\n0,4\t{}\t\t\r\n".encode("utf-16-le"),
    ],
    ids=["plain", "mark and semicolons", "separator named", "utf-16 and tabs"],
)
def test_landmarks_of_spreadsheets(mapping: Mapping, tmp_path: Path, table: bytes) -> None:
    inside = int(np.flatnonzero(~mapping.mesh.on_cube_face.any(axis=1))[0])
    wide = table.startswith(b"\xff\xfe")
    number = str(inside).encode("utf-16-le" if wide else "ascii")
    (tmp_path / "table.csv").write_bytes(table.replace("{}".encode("utf-16-le" if wide else "ascii"), number))
    vertices, values = read_landmarks(tmp_path / "table.csv")
    assert vertices.tolist() == [inside]
    np.testing.assert_array_equal(values, [[np.nan, 0.4, np.nan]])


@pytest.mark.parametrize("ending", ["stl", "off", "ply", "obj", "inp", "su2", "svg", "unknown"])
def test_formats_without_room_are_refused_before_the_work(
    mapping: Mapping, tmp_path: Path, capsys: pytest.CaptureFixture[str], ending: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, output = tmp_path / "map.npz", tmp_path / f"rebuilt.{ending}"
    write_tets(source, content(mapping))
    monkeypatch.setattr("qc3d_addon.cli.reconstruct.reconstruct", None)
    assert main.main(["reconstruct", str(source), "--output", str(output)]) == 2
    assert f"rebuilt.{ending} cannot be written: " in capsys.readouterr().err
    assert not output.exists()
    with pytest.raises(InputError, match="cannot be written"):
        write_tets(output, content(mapping))


def test_what_is_beside_the_tetrahedra(mapping: Mapping, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mesh = mapping.mesh
    cells = [("tetra", mesh.tets), ("triangle", mesh.boundary_faces[:5]), ("line", mesh.boundary_faces[:2, :2])]
    per_cell = {STRETCH: [upper_triangle(mapping.stretch), np.zeros((5, 6)), np.zeros((2, 6))]}
    meshio.Mesh(mesh.points, cells, cell_data=per_cell).write(tmp_path / "surface.vtu")
    output = tmp_path / "rebuilt.npz"
    assert main.main(["reconstruct", str(tmp_path / "surface.vtu"), "--output", str(output)]) == 0
    assert np.abs(read_tets(output).mapping().values - mapping.values).max() < EXACT
    assert "Left out, since they have no volume: cells of the types 5 triangle, 2 line." in capsys.readouterr().err


@pytest.mark.parametrize(("kind", "corners"), [("hexahedron", 8), ("wedge", 6), ("pyramid", 5), ("tetra10", 10)])
def test_other_cells_of_the_volume_are_refused(
    mapping: Mapping, tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str, corners: int
) -> None:
    mesh = mapping.mesh
    cells = [("tetra", mesh.tets), (kind, np.arange(2 * corners).reshape(2, corners))]
    meshio.Mesh(mesh.points, cells).write(tmp_path / "mixed.vtu")
    assert main.main(["reconstruct", str(tmp_path / "mixed.vtu"), "--output", str(tmp_path / "out.npz")]) == 2
    assert f"has cells beside its tetrahedra (2 {kind})" in capsys.readouterr().err


class TestErrors:
    def run(self, capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
        assert main.main(["reconstruct", *map(str, arguments)]) == 2
        return capsys.readouterr().err

    def test_no_representation(self, mapping: Mapping, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        source = tmp_path / "map.npz"
        write_tets(source, TetFile(mapping.mesh.points, mapping.mesh.tets))
        said = self.run(capsys, source, "--output", tmp_path / "out.npz")
        assert "has no array 'stretch' of its 162 tetrahedra; it has none" in said
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

    @pytest.mark.parametrize("rows", [64, 161])
    def test_arrays_of_a_wrong_length(
        self, mapping: Mapping, tmp_path: Path, capsys: pytest.CaptureFixture[str], rows: int
    ) -> None:
        source = tmp_path / "map.npz"
        arrays = {"points": mapping.mesh.points, "tets": mapping.mesh.tets}
        np.savez(source, **arrays, stretch=np.ones((rows, 6)))
        said = self.run(capsys, source, "--output", tmp_path / "out.npz")
        assert f"'stretch' has the shape ({rows}, 6); the mesh needs a row for each of its 162 tetrahedra" in said
        np.savez(source, **arrays, stretch=content(mapping).at_tets[STRETCH], target=np.ones((63, 3)))
        said = self.run(capsys, source, "--boundary", "fixed", "--output", tmp_path / "out.npz")
        assert "'target' has the shape (63, 3); the mesh needs a row for each of its 64 vertices" in said

    def test_a_landmark_against_the_boundary(
        self, mapping: Mapping, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        source, landmarks = tmp_path / "map.npz", tmp_path / "landmarks.csv"
        write_tets(source, content(mapping))
        corner = int(np.flatnonzero((mapping.mesh.points == [1.0, 0.0, 1.0]).all(axis=1))[0])
        landmarks.write_text(f"vertex,x,y,z\n{corner},1,0.25,1\n")
        said = self.run(capsys, source, "--landmarks", landmarks, "--output", tmp_path / "out.npz")
        assert f"The landmark at vertex {corner} wants y at 0.25, where the boundary holds it at 0;" in said
        landmarks.write_text(f"vertex,x,y,z\n{corner},1,0.0000000000,1\n")
        command = ["reconstruct", str(source), "--landmarks", str(landmarks), "--output", str(tmp_path / "out.npz")]
        assert main.main(command) == 0

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
            ("", "is empty; it must begin with the row"),
            ("vertex,x,y\n1,2,3\n", "begins with vertex,x,y; it must begin"),
            ("vertex,x,y,z\n1.5,0,0,0\n", "1.5 is not a vertex number"),
            ("vertex;x;y;z\n1;0;0;0;7\n", "row 2: four cells are needed"),
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
