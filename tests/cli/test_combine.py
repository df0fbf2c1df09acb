# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d combine``: the shape with both keys on, what adding would do, and one sentence where that cannot be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.cli import main

from ..solver.combinations.arm import arm, posed

SIDE = (0.0, 1.0, 0.0)


@pytest.fixture
def shapes_file(tmp_path: Path) -> Path:
    """An arm: straight, raised, and its elbow bent to the side."""
    rest, faces = arm()
    path = tmp_path / "shapes.npz"
    shapes = {"V0": rest, "V1": posed(rest, 80.0, 0.0), "V2": posed(rest, 0.0, 90.0, SIDE)}
    np.savez(path, faces=faces, shape_names=np.array(["straight", "raised", "bent"]), **shapes)
    return path


def combine(shapes: Path, output: Path, *more: str, outer: str = "raised", inner: str = "bent") -> int:
    command = ["combine", str(shapes), "--rest", "straight", "--outer", outer, "--inner", inner]
    return main.main([*command, "--output", str(output), *more])


def test_both_keys_are_on(shapes_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "both.npz"
    assert combine(shapes_file, output) == 0
    with np.load(output, allow_pickle=False) as stored, np.load(shapes_file, allow_pickle=False) as given:
        assert sorted(stored) == ["faces", "shape"]
        np.testing.assert_array_equal(stored["faces"], given["faces"])
        shape, rest = stored["shape"], given["V0"]
    np.testing.assert_allclose(shape, posed(rest, 80.0, 90.0, SIDE), atol=1e-6)
    assert "raised, bent: needs a combination" in capsys.readouterr().out


def test_the_order_is_found_and_said(shapes_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given, found = tmp_path / "given.npz", tmp_path / "found.npz"
    assert combine(shapes_file, given) == 0
    assert combine(shapes_file, found, "--find-order", outer="bent", inner="raised") == 0
    with np.load(given) as first, np.load(found) as second:
        np.testing.assert_allclose(first["shape"], second["shape"], atol=1e-12)
    assert "The outermost first: raised, bent" in capsys.readouterr().out


def test_weights(shapes_file: Path, tmp_path: Path) -> None:
    output = tmp_path / "half.npz"
    assert combine(shapes_file, output, "--weights", "0.5", "0", "--between", "natural") == 0
    with np.load(output) as stored, np.load(shapes_file) as given:
        off = np.abs(stored["shape"] - posed(given["V0"], 40.0, 0.0)).max()
        assert 0.0 < off < 0.2 * np.abs(0.5 * (given["V0"] + given["V1"]) - posed(given["V0"], 40.0, 0.0)).max()


def test_joints_turn_by_their_weights(shapes_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "halves.npz"
    assert combine(shapes_file, output, "--weights", "0.5", "0.5") == 0
    with np.load(output) as stored, np.load(shapes_file) as given:
        np.testing.assert_allclose(stored["shape"], posed(given["V0"], 40.0, 45.0, SIDE), atol=1e-6)
    assert "pose of one joint" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "outer", "said"),
    [
        ((), "curled", "no shape 'curled'"),
        ((), "straight", "must all be different"),
        (("--weights", "1"), "raised", "2 keys and 1 weights"),
        (("--weights", "1", "2"), "raised", "weight 2.0"),
    ],
)
def test_one_sentence_where_it_cannot_be(
    more: tuple[str, ...], outer: str, said: str, shapes_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "none.npz"
    assert combine(shapes_file, output, *more, outer=outer) == 2
    text = capsys.readouterr().err
    assert said in text
    assert text.count("\n") == 1
    assert not output.exists()


def test_of_a_half_the_seam_stays_on_its_plane(tmp_path: Path) -> None:
    rest, faces = arm()
    used, own = np.unique(faces[(rest[faces][:, :, 2] > -1e-9).all(axis=1)], return_inverse=True)
    swell = rest + np.exp(-((rest[:, :1] - 1.1) ** 2) / 0.1) * rest * [0.0, 0.8, 0.8]
    shapes = [shape[used] for shape in (rest, posed(rest, 60.0, 0.0), swell)]
    path, names = tmp_path / "half.npz", np.array(["straight", "raised", "bent"])
    np.savez(path, faces=own.reshape(-1, 3), shape_names=names, V0=shapes[0], V1=shapes[1], V2=shapes[2])
    heights = []
    for mirror in ("auto", "none"):
        assert combine(path, tmp_path / "both.npz", "--mirror", mirror) == 0
        with np.load(tmp_path / "both.npz") as stored:
            heights.append(np.abs(stored["shape"][np.abs(shapes[0][:, 2]) < 1e-9, 2]).max())
    assert heights[0] < 1e-12 < heights[1]
