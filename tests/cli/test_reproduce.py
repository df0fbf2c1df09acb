# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d reproduce``: its pictures and captions, and the figures measured on the demo files."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import numpy as np
import pytest
from matplotlib import image

from qc3d_addon.cli import main, reproduce
from qc3d_addon.solver.compression import codec
from qc3d_addon.solver.compression.modes import Transfer
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.maps.mapping import Mapping
from qc3d_addon.solver.tets.kuhn_grid import kuhn_grid, uneven_grid
from qc3d_paper.drawing.slices import cuts
from qc3d_paper.experiments import bijections, experiment, sequences, shapes, spectra
from qc3d_paper.experiments.caption import Caption


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Coarse volumes and few modes."""
    monkeypatch.setattr(shapes, "OPTIONS", shapes.FitOptions())
    monkeypatch.setattr(spectra, "FITTED_COUNTS", (4, 16))
    monkeypatch.setattr(experiment, "FITTED_COUNTS", (4, 16))
    monkeypatch.setattr(spectra, "_COUNTS", (4, 30, 240))
    monkeypatch.setattr(codec, "_FIRST_ITERATIONS", 5)
    reproduce._cube.cache_clear()
    reproduce._experiments.cache_clear()


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("number", [4, 6, 8, 9, 10])
def test_a_figure_with_its_caption(
    number: int, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    if number == 6:
        monkeypatch.setattr(shapes, "FACES", shapes.FACES[:1])
    assert main.main(["reproduce", "--figure", str(number), "--output", str(tmp_path / "out")]) == 0
    assert image.imread(tmp_path / "out" / f"figure{number}.png").std() > 0.05
    text = (tmp_path / "out" / "figures.md").read_text(encoding="utf-8")
    for part in (
        f"## Figure {number}: ",
        f"(figure{number}.png)",
        "**The paper claims:**",
        "**Measured:**",
        "**Holds?**",
    ):
        assert part in text
    assert f"Figure {number}: " in capsys.readouterr().out


@pytest.mark.parametrize("bijection", [shapes.along_axes, shapes.whirl, shapes.sliding])
def test_the_bijections_keep_the_faces(bijection: bijections.Callable[..., np.ndarray]) -> None:
    points = np.random.default_rng(0).uniform(size=(500, 3))
    points[np.arange(500), np.arange(500) % 3] = np.arange(500) % 2
    moved = bijection(points)
    held = (points == 0.0) | (points == 1.0)
    np.testing.assert_allclose(moved[held], points[held], atol=1e-15)
    assert (moved > -1e-12).all()
    assert (moved < 1.0 + 1e-12).all()
    inside = np.random.default_rng(1).uniform(0.3, 0.7, (50, 3))
    assert np.abs(bijection(inside) - inside).max() > 0.04


def test_what_the_mesh_cannot_follow_is_damped_and_said() -> None:
    mesh = kuhn_grid(4)

    def steep(points: np.ndarray) -> np.ndarray:
        return points + 0.3 * np.sin(2.0 * np.pi * points) * np.array([1.0, 0.0, 0.0])

    title, mapping = bijections.without_folds(mesh, "a wave", steep)
    assert mapping.folds == 0
    part = float(np.abs(mapping.values - mesh.points).max() / 0.3)
    assert part < 1.0
    assert title == f"a wave, {part:.0%} of the displacements".replace("%", " %")
    assert bijections.without_folds(mesh, "none", lambda points: points)[0] == "none"


def test_captions_say_no_where_it_does_not_hold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = reproduce._cube()

    def rebuilt(*_: object) -> Mapping:
        return Mapping(mesh, mesh.points + 1e-3)

    monkeypatch.setattr(bijections, "reconstruct", rebuilt)
    caption = bijections.draw("3", "a map", Mapping(mesh, mesh.points), tmp_path / "figure.png")
    assert isinstance(caption, Caption)
    assert caption.holds.startswith("No")


def test_figures_that_the_paper_has_not(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["reproduce", "--figure", "2", "--output", str(tmp_path)]) == 2
    assert "invalid choice: 2" in capsys.readouterr().err


def test_data_that_is_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["reproduce", "--figure", "6", "--data", str(tmp_path), "--output", str(tmp_path / "out")]) == 2
    assert "head.npz cannot be read" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_captions_are_written_as_each_figure_is_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def draw(number: int, _: object, file: BinaryIO) -> Caption:
        if number == 5:
            raise InputError("The third figure cannot be drawn.")
        file.write(b"a picture")
        return Caption(str(number), f"title {number}", "claim", "measured", "Yes.")

    monkeypatch.setattr(reproduce, "_draw", draw)
    command = ["reproduce", "--figure", "3", "--figure", "4", "--figure", "5", "--output", str(tmp_path / "out")]
    assert main.main(command) == 2
    text = (tmp_path / "out" / "figures.md").read_text(encoding="utf-8")
    assert text.count("## Figure") == 2
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["figure3.png", "figure4.png", "figures.md"]


@pytest.fixture(scope="module")
def smooth() -> experiment.Experiment:
    """A smooth bijection on a small mesh, all modes."""
    mesh = uneven_grid(7)
    return experiment.Experiment("waves", Mapping(mesh, shapes.sliding(mesh.points)))


def test_all_modes_give_coordinates_and_displacements_back(smooth: experiment.Experiment) -> None:
    every = smooth.modes
    assert every == len(smooth.mesh.points)
    for way in ("coordinates", "displacements", "put back"):
        values = smooth.restored(way, every)
        assert values is not None
        np.testing.assert_allclose(values, smooth.mapping.values, atol=1e-10)
    published = smooth.restored("published", every)
    assert published is not None
    # All modes are a basis: what is left is the way to the vertices and back, which is measured by itself.
    assert smooth.error(published) / smooth.reference == pytest.approx(smooth.transfer_part("published"), rel=1e-6)


def test_truncations(smooth: experiment.Experiment) -> None:
    # By least squares with the vertices' volumes, an independent way to the same truncation.
    weights = np.sqrt(Transfer(smooth.mesh).vertex_volumes)[:, None]
    basis = smooth.spectrum.modes[:, :20]
    numbers = np.linalg.lstsq(weights * basis, weights * smooth.mapping.values, rcond=None)[0]
    coordinates, put_back = smooth.restored("coordinates", 20), smooth.restored("put back", 20)
    assert coordinates is not None
    assert put_back is not None
    np.testing.assert_allclose(coordinates, basis @ numbers, atol=1e-10)
    held = smooth.mesh.on_cube_face
    np.testing.assert_array_equal(put_back[held], smooth.mesh.points[held])
    assert np.abs(coordinates - smooth.mesh.points)[held].max() > 1e-3
    everywhere, inside = smooth.error(coordinates), smooth.error(coordinates, ~smooth.on_boundary)
    boundary = smooth.error(coordinates, smooth.on_boundary)
    share = smooth.on_boundary.mean()
    assert everywhere == pytest.approx(share * boundary + (1.0 - share) * inside)


def test_where_planes_go() -> None:
    mesh = uneven_grid(5)
    shear = np.array([[1.0, 0.2, 0.0], [0.0, 1.0, 0.3], [0.1, 0.0, 1.0]])
    sheet = cuts(mesh.points, mesh.tets, 2, 0.3)
    np.testing.assert_allclose(sheet.of(mesh.points)[..., 2], 0.3, atol=1e-12)
    # An affine map takes the plane where it takes its points.
    np.testing.assert_allclose(sheet.of(mesh.points @ shear.T), sheet.of(mesh.points) @ shear.T, atol=1e-12)


@pytest.mark.parametrize(("linear", "holds"), [(0.01, "Yes"), (0.2, "No")])
def test_sequences_are_judged_by_most_edges_and_not_by_the_worst(
    linear: float, holds: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shapes, "OPTIONS", shapes.FitOptions())
    excess = iter([0.02, linear, 0.01])
    monkeypatch.setattr(sequences, "_excess", lambda *_: next(excess))
    with (tmp_path / "figure.png").open("wb") as file:
        caption = sequences.draw("6", shapes.FACES[:1], None, file)
    assert caption.holds.startswith(holds)


def test_the_percentile_of_edges(data_folder: Path) -> None:
    pair = shapes.read(shapes.DATA_BODIES[0], data_folder)
    middle = 0.5 * (pair.key0 + pair.key1)
    sides = np.unique(np.sort(pair.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    first, last, found = (
        np.linalg.norm(shape[sides[:, 0]] - shape[sides[:, 1]], axis=1) for shape in (pair.key0, pair.key1, middle)
    )
    beyond = np.maximum(found / np.maximum(first, last) - 1.0, 1.0 - found / np.minimum(first, last))
    assert sequences._excess(pair, middle[None]) == pytest.approx(np.percentile(beyond, 99), rel=1e-9)
