# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d reproduce``: its pictures and captions, and the figures measured on the demo files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib import image

from qc3d_addon.cli import main, reproduce
from qc3d_addon.solver.compression import codec
from qc3d_addon.solver.maps.mapping import Mapping
from qc3d_addon.solver.tets.kuhn_grid import kuhn_grid
from qc3d_paper.experiments import bijections, shapes, spectra
from qc3d_paper.experiments.caption import Caption


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Coarse volumes and few modes."""
    monkeypatch.setattr(shapes, "OPTIONS", shapes.FitOptions())
    monkeypatch.setattr(spectra, "_MODES", 60)
    monkeypatch.setattr(spectra, "_FITTED_COUNTS", (4, 16))
    monkeypatch.setattr(codec, "_FIRST_ITERATIONS", 5)
    reproduce._cube.cache_clear()
    reproduce._experiment.cache_clear()


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
