# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d compress`` and ``qc3d decompress``, end to end."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.cli import compress, main
from qc3d_addon.solver.compression import codec
from qc3d_addon.solver.compression import search as rate
from qc3d_addon.solver.maps.files import TARGET, TetFile, read_tets, write_tets
from qc3d_addon.solver.meshing.cube import fill_cube
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.tets.mesh import TetMesh
from qc3d_paper.experiments import shapes

from ..solver.meshes import jittered_grid, sine_map


@pytest.fixture(autouse=True)
def _few_modes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Searches among few modes are quick."""
    monkeypatch.setattr(compress, "_MODES", 30)
    monkeypatch.setattr(codec, "_FIRST_ITERATIONS", 8)
    monkeypatch.setattr(codec, "_NEXT_ITERATIONS", 3)
    monkeypatch.setattr(rate, "_MODES", {"fitted": (0, 8), "published": (8, 30)})


@pytest.fixture(scope="module")
def mesh() -> TetMesh:
    return fill_cube(*shapes._ball(6), FitOptions()).mesh


@pytest.fixture
def source(mesh: TetMesh, tmp_path: Path) -> Path:
    values = mesh.points + 0.5 * (shapes.sliding(mesh.points) - mesh.points)
    write_tets(tmp_path / "map.npz", TetFile(mesh.points, mesh.tets, {TARGET: values}))
    return tmp_path / "map.npz"


@pytest.mark.parametrize(
    ("amount", "scheme"),
    [
        (["--modes", "20"], "published"),
        (["--modes", "20"], "logarithm"),
        (["--modes", "20"], "fitted"),
        (["--error", "0.03"], "published"),
        pytest.param(["--error", "0.001"], "fitted", marks=pytest.mark.slow),
        pytest.param(["--size", "1500"], "fitted", marks=pytest.mark.slow),
    ],
)
def test_there_and_back(source: Path, tmp_path: Path, amount: list[str], scheme: str) -> None:
    file, report, output = tmp_path / "map.qc3d", tmp_path / "report.json", tmp_path / "restored.npz"
    files = ["--output", str(file), "--report", str(report)]
    command = ["compress", str(source), *amount, "--scheme", scheme, *files]
    assert main.main(command) == 0
    assert main.main(["decompress", str(file), str(source), "--output", str(output)]) == 0
    told = json.loads(report.read_text())
    before, after = read_tets(source).mapping(), read_tets(output).mapping()
    error = np.sqrt(((after.values - before.values) ** 2).sum(axis=1).mean()) / np.sqrt(3.0)
    assert told["error"] == [pytest.approx(error, rel=1e-6)]
    assert told["bytes"] == file.stat().st_size
    assert told["boundary_error"] == [0.0]
    assert told["folds"] == [after.folds] == [0]
    assert told["raw_bytes"] == 12 * len(before.mesh.points)
    assert told["ratio_to_raw"] == told["raw_bytes"] / told["bytes"]
    assert told["ratio_to_quantized"] == told["quantized_bytes"] / told["bytes"]
    assert told["mean_square_error"] == [pytest.approx(3.0 * error**2, rel=1e-6)]
    assert 0.0 < told["transfer_error"][0] < 0.05


@pytest.mark.parametrize(
    "amount", [["--error", "0.01"], ["--error", "1e-4"], pytest.param(["--size", "900"], marks=pytest.mark.slow)]
)
def test_the_smallest(source: Path, tmp_path: Path, amount: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    file, report, output = tmp_path / "map.qc3d", tmp_path / "report.json", tmp_path / "restored.npz"
    command = ["compress", str(source), *amount, "--output", str(file), "--report", str(report)]
    assert main.main(command) == 0
    said = capsys.readouterr().out.splitlines()
    assert main.main(["decompress", str(file), str(source), "--output", str(output)]) == 0
    told = json.loads(report.read_text())
    before, after = read_tets(source).mapping(), read_tets(output).mapping()
    error = np.sqrt(((after.values - before.values) ** 2).sum(axis=1).mean()) / np.sqrt(3.0)
    assert told["error"] == [pytest.approx(error, rel=1e-6)]
    assert told["bytes"] == file.stat().st_size < told["quantized_bytes"]
    assert told["folds"] == [after.folds]
    assert said[0].startswith("needs about ")
    assert said[1].startswith(f"{told['bytes']} bytes ({told['way']}), 1 : ")
    if amount[0] == "--error":
        assert error <= float(amount[1])
    else:
        assert told["bytes"] <= int(amount[1])
    on_faces = before.mesh.on_cube_face
    np.testing.assert_array_equal(after.values[on_faces], before.mesh.points[on_faces])


@pytest.mark.parametrize("boundary", ["auto", "fixed", "exact"])
@pytest.mark.parametrize("scheme", ["smallest", "published", "logarithm"])
def test_a_mesh_that_is_no_cube(tmp_path: Path, boundary: str, scheme: str) -> None:
    mesh = jittered_grid(4, seed=0)
    points = 30.0 * mesh.points + 5.0
    values = points + 2.0 * np.sin(points[:, [1, 2, 0]] / 10.0)
    write_tets(tmp_path / "map.npz", TetFile(points, mesh.tets, {TARGET: values}))
    amount = ["--error", "3e-3"] if scheme == "smallest" else ["--modes", "30"]
    files = ["--output", str(tmp_path / "map.qc3d"), "--report", str(tmp_path / "r.json")]
    options = ["--scheme", scheme, "--boundary", boundary]
    assert main.main(["compress", str(tmp_path / "map.npz"), *amount, *options, *files]) == 0
    arguments = [str(tmp_path / "map.qc3d"), str(tmp_path / "map.npz"), "--output", str(tmp_path / "o.npz")]
    assert main.main(["decompress", *arguments]) == 0
    told, found = json.loads((tmp_path / "r.json").read_text()), read_tets(tmp_path / "o.npz").mapping().values
    rows = np.unique(mesh.boundary_faces)
    if boundary == "exact":
        np.testing.assert_array_equal(found[rows], values[rows])
    else:
        assert 0.0 < told["boundary_error"][0] < 0.05 * np.ptp(points)
        assert told["bytes"] < told["raw_bytes"] / 3


@pytest.mark.parametrize("scheme", ["smallest", "published", "logarithm", "fitted"])
@pytest.mark.parametrize("boundary", ["auto", "fixed", "exact"])
def test_two_parts_and_a_point_of_no_tetrahedron(tmp_path: Path, scheme: str, boundary: str) -> None:
    mesh = jittered_grid(3, seed=0)
    points = np.concatenate([mesh.points, mesh.points + 2.0, [[5.0, 5.0, 5.0]]])
    tets = np.concatenate([mesh.tets, mesh.tets + len(mesh.points)])
    write_tets(tmp_path / "map.npz", TetFile(points, tets, {TARGET: 1.01 * points}))
    amount = ["--error", "3e-3"] if scheme == "smallest" else ["--modes", "4"]
    options = ["--scheme", scheme, "--boundary", boundary, "--output", str(tmp_path / "map.qc3d")]
    assert main.main(["compress", str(tmp_path / "map.npz"), *amount, *options]) == 0
    arguments = [str(tmp_path / "map.qc3d"), str(tmp_path / "map.npz"), "--output", str(tmp_path / "o.npz")]
    assert main.main(["decompress", *arguments]) == 0
    missed = read_tets(tmp_path / "o.npz").at_vertices[TARGET] - 1.01 * points
    assert np.abs(missed).max() < 0.2


@pytest.mark.slow
def test_folds_are_avoided_or_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mesh = jittered_grid(8, seed=0)
    waves = np.array([[[1, 2, 1], [1, 1, 2], [2, 1, 1]], [[2, 0, 1], [1, 2, 0], [0, 1, 2]]])
    amplitudes = 1.6 * np.array([[0.06, -0.05, 0.05], [-0.03, 0.04, 0.03]])
    values = sine_map(mesh.points, amplitudes, waves)
    write_tets(tmp_path / "map.npz", TetFile(mesh.points, mesh.tets, {TARGET: values}))
    report = ["--report", str(tmp_path / "r.json")]
    command = ["compress", str(tmp_path / "map.npz"), "--error", "0.02", "--output", str(tmp_path / "a.qc3d"), *report]
    assert main.main(command) == 0
    assert capsys.readouterr().out.rstrip().endswith("folds 0")
    assert json.loads((tmp_path / "r.json").read_text())["unfolded"] is True
    output = tmp_path / "o.npz"
    assert main.main(["decompress", str(tmp_path / "a.qc3d"), str(tmp_path / "map.npz"), "--output", str(output)]) == 0
    assert read_tets(output).mapping().folds == 0
    folded = TetFile(mesh.points, mesh.tets, {TARGET: mesh.points * [-1.0, 1.0, 1.0]})
    write_tets(tmp_path / "map.npz", folded)
    assert main.main(command) == 0
    number = len(mesh.tets)
    said = capsys.readouterr().err
    assert f"{number} tetrahedra of the maps are folded themselves, {number} come back folded" in said
    assert json.loads((tmp_path / "r.json").read_text())["own_folds"] == [number]


def test_many_maps(mesh: TetMesh, tmp_path: Path) -> None:
    moved = shapes.sliding(mesh.points) - mesh.points
    frames = np.stack([mesh.points + part * moved for part in (0.1, 0.3, 0.5)], axis=1)
    write_tets(tmp_path / "frames.npz", TetFile(mesh.points, mesh.tets, {TARGET: frames}))
    arguments = ["--error", "1e-4", "--output", str(tmp_path / "frames.qc3d")]
    assert main.main(["compress", str(tmp_path / "frames.npz"), *arguments]) == 0
    output = tmp_path / "restored.npz"
    assert (
        main.main(["decompress", str(tmp_path / "frames.qc3d"), str(tmp_path / "frames.npz"), "--output", str(output)])
        == 0
    )
    restored = read_tets(output).at_vertices[TARGET]
    assert restored.shape == frames.shape
    assert np.sqrt(((restored - frames) ** 2).sum(axis=2).mean(axis=0)).max() <= 1e-4 * np.sqrt(3.0)


def test_frames_of_a_chain(tmp_path: Path) -> None:
    points, faces = shapes._ball(6)
    shape_names = np.array(["ball", "egg", "bean"])
    egg = points * [1.0, 1.0, 1.4]
    bean = egg + 0.3 * egg[:, 2:] ** 2 * [1.0, 0.0, 0.0]
    np.savez(tmp_path / "shapes.npz", faces=faces, shape_names=shape_names, V0=points, V1=egg, V2=bean)
    frames, file, report, output = (tmp_path / name for name in ("frames.npz", "chain.qc3d", "r.json", "restored.npz"))
    keys = ["--from", "ball", "--via", "egg", "--to", "bean", "--frames", "2"]
    settings = ["--quality", "normal", "--engine", "delaunay"]
    assert main.main(["interpolate", str(tmp_path / "shapes.npz"), *keys, *settings, "--output", str(frames)]) == 0
    arguments = ["--error", "1e-3", "--output", str(file), "--report", str(report)]
    assert main.main(["compress", str(frames), *arguments]) == 0
    assert main.main(["decompress", str(file), str(frames), "--output", str(output)]) == 0
    with np.load(frames) as before, np.load(output) as after:
        wanted, found = before["frames"], after["frames"]
    assert found.shape == wanted.shape == (7, len(points), 3)
    missed = np.sqrt(((found - wanted) ** 2).sum(axis=2).mean(axis=1)) / np.linalg.norm(np.ptp(points, axis=0))
    told = json.loads(report.read_text())
    assert missed[1:] == pytest.approx(told["error"], rel=1e-6)
    assert missed.max() <= 1e-3
    assert told["raw_bytes"] == 4 * wanted[1:].size
    assert told["way"].startswith("remade")
    stored = ["--error", "1e-3", "--scheme", "stored", "--output", str(tmp_path / "s.qc3d")]
    assert main.main(["compress", str(frames), *stored]) == 0
    assert file.stat().st_size < (tmp_path / "s.qc3d").stat().st_size


class TestErrors:
    def said(self, capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
        assert main.main([str(argument) for argument in arguments]) == 2
        return capsys.readouterr().err

    def test_no_amount(self, source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        said = self.said(capsys, "compress", source, "--output", tmp_path / "a.qc3d")
        assert "--modes --error --size is required" in said

    @pytest.mark.parametrize("error", ["0", "-1", "nan", "inf"])
    def test_errors_that_are_none(
        self, source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], error: str
    ) -> None:
        said = self.said(capsys, "compress", source, "--error", error, "--output", tmp_path / "a.qc3d")
        assert "is not possible" in said
        assert not (tmp_path / "a.qc3d").exists()

    def test_the_report_is_another_file(self, source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        outputs = ("--output", tmp_path / "a", "--report", tmp_path / "a")
        assert "named twice" in self.said(capsys, "compress", source, "--modes", 2, *outputs)
        outputs = ("--output", tmp_path / "a", "--report", tmp_path / "none" / "r.json")
        assert "none" in self.said(capsys, "compress", source, "--modes", 2, *outputs)
        assert not (tmp_path / "a").exists()

    def test_frames_take_no_other_scheme(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        points, faces = shapes._ball(4)
        np.savez(tmp_path / "frames.npz", frames=np.stack([points, 2.0 * points]), faces=faces, key0=points)
        arguments = ("--modes", 3, "--scheme", "published", "--output", tmp_path / "a")
        said = self.said(capsys, "compress", tmp_path / "frames.npz", *arguments)
        assert "leave that option out" in said

    @pytest.mark.parametrize(
        ("options", "reason"),
        [
            (["--modes", "3", "--scheme", "stored"], "chooses its modes itself"),
            (["--modes", "3", "--no-folds"], "--no-folds belongs to --error"),
            (["--size", "900", "--no-folds"], "--no-folds belongs to --error"),
        ],
    )
    def test_options_that_do_not_go_together(
        self, source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], reason: str
    ) -> None:
        assert reason in self.said(capsys, "compress", source, *options, "--output", tmp_path / "a")

    @pytest.mark.parametrize("settings", [np.array("{}"), np.array("no"), np.array([1.0]), np.array('{"at":[0,5]}')])
    def test_settings_that_are_none(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str], settings: np.ndarray
    ) -> None:
        points, faces = shapes._ball(4)
        np.savez(tmp_path / "f.npz", frames=np.stack([points, points]), faces=faces, settings=settings)
        said = self.said(capsys, "compress", tmp_path / "f.npz", "--error", 1e-2, "--output", tmp_path / "a")
        assert "settings" in said

    def test_another_mesh(self, source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        assert main.main(["compress", str(source), "--modes", "5", "--output", str(tmp_path / "a.qc3d")]) == 0
        content = read_tets(source)
        write_tets(tmp_path / "other.npz", TetFile(content.points + 1.0, content.tets))
        said = self.said(
            capsys, "decompress", tmp_path / "a.qc3d", tmp_path / "other.npz", "--output", tmp_path / "o.npz"
        )
        assert "another mesh" in said
