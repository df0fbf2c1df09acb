# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d export``: from in-betweens in a .blend file to other programs' files, and one sentence where it cannot be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.blender.exports import usd_files
from qc3d_addon.cli import main


@pytest.fixture(scope="module")
def baked(bar_scene: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bar with three in-betweens on its key Bent."""
    path = tmp_path_factory.mktemp("baked") / "baked.blend"
    command = ["bake", str(bar_scene), "--object", "Bar", "--on-key", "Bent", "--frames", "3", "--mode", "linear"]
    assert main.main([*command, "--output", str(path)]) == 0
    return path


def export(file: Path, output: Path, *more: str, name: str = "Bar") -> int:
    return main.main(["export", str(file), "--object", name, "--output", str(output), *more])


@pytest.mark.parametrize("ending", [".usda", ".usdc", ".fbx", ".glb"])
def test_every_format(ending: str, baked: Path, bar: dict[str, np.ndarray], tmp_path: Path) -> None:
    output = tmp_path / f"bar{ending}"
    before = baked.read_bytes()
    assert export(baked, output, "--shapes", "4") == 0
    assert baked.read_bytes() == before
    if ending.startswith(".usd"):
        [shape] = usd_files.read_in_betweens(output, len(bar["V0"]))
        assert shape.name == "Bent"
        assert [round(place, 6) for place in shape.places.tolist()] == [0.2, 0.4, 0.6, 0.8]
    else:
        assert output.read_bytes()[:4] in (b"Kayd", b"glTF")


@pytest.mark.parametrize(
    ("output", "more", "name", "said"),
    [
        ("bar.obj", (), "Bar", "has none of the extensions"),
        ("bar.usda", ("--shapes", "0"), "Bar", "0 in-betweens"),
        ("bar.usda", (), "Bus", "no object 'Bus'"),
        ("bar.usda", (), "Plain", "shape key"),
        ("nowhere/bar.usda", (), "Bar", "nowhere"),
    ],
)
def test_one_sentence_where_it_cannot_be(
    output: str,
    more: tuple[str, ...],
    name: str,
    said: str,
    baked: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert export(baked, tmp_path / output, *more, name=name) == 2
    text = capsys.readouterr().err
    assert said in text
    assert text.startswith("qc3d: ")
    assert text.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_without_in_betweens(bar_scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert export(bar_scene, tmp_path / "bar.usda") == 2
    assert "no in-betweens" in capsys.readouterr().err
