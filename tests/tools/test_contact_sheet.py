# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact sheets and moving pictures: covered pixels, hidden surfaces, rows of equal size, there and back."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib import image
from PIL import Image

import contact_sheet
from qc3d_addon.cli import main
from qc3d_paper.drawing.shading import Camera, best_view, draw

RED, WHITE = (1.0, 0.0, 0.0), (1.0, 1.0, 1.0)

# Two squares seen from the front (-y): a small one nearer to the camera, a large one behind it.
SQUARE = np.array([[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def test_a_square_covers_its_pixels_without_gaps() -> None:
    picture = draw(0.5 * SQUARE, HALVES, Camera.around(SQUARE, "front", margin=0.0), 40, RED, WHITE, samples=1)
    is_red = picture[:, :, 1] == 0.0
    assert picture.shape == (40, 40, 3)
    assert is_red[10:30, 10:30].all()
    assert is_red.sum() == 400


def test_triangles_of_their_own_colors() -> None:
    camera = Camera.around(SQUARE, "front", margin=0.0)
    colors = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    picture = draw(SQUARE, HALVES, camera, 40, colors, WHITE, samples=1)
    # The diagonal runs from the lower left to the upper right; the first half is below it.
    assert picture[30, 20, 2] == 0.0 < picture[30, 20, 0]
    assert picture[10, 20, 0] == 0.0 < picture[10, 20, 2]


def test_the_nearer_shape_hides_the_other_whatever_their_order() -> None:
    slanted = SQUARE @ np.array([[1.0, 0.4, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])  # another brightness
    near = 0.5 * SQUARE + (0.0, -2.0, 0.0)
    camera = Camera.around(SQUARE, "front", margin=0.0)
    alone = draw(near, HALVES, camera, 40, RED, WHITE, samples=1)
    behind = draw(slanted, HALVES, camera, 40, RED, WHITE, samples=1)
    for points in (np.concatenate([near, slanted]), np.concatenate([slanted, near])):
        both = draw(points, np.concatenate([HALVES, HALVES + 4]), camera, 40, RED, WHITE, samples=1)
        np.testing.assert_allclose(both[10:30, 10:30], alone[10:30, 10:30])
        np.testing.assert_allclose(both[:10], behind[:10])


def test_up_is_up() -> None:
    above = 0.25 * SQUARE + (0.0, 0.0, 0.5)
    picture = draw(above, HALVES, Camera.around(SQUARE, "front", margin=0.0), 40, RED, WHITE)
    assert (picture[:20, :, 1] == 0.0).any()
    assert (picture[20:, :, 1] == 1.0).all()


@pytest.mark.parametrize(("motion", "view"), [((1.0, 0.0, 0.0), "front"), ((0.0, 1.0, 0.0), "side")])
def test_the_view_shows_the_motion(motion: tuple[float, float, float], view: str) -> None:
    assert best_view(SQUARE, SQUARE + motion) == view


def test_a_sheet_of_frames_beside_the_straight_blend(bar: dict[str, np.ndarray], tmp_path: Path) -> None:
    times = np.linspace(0.0, 1.0, 4)
    frames = np.stack([(1.0 - t) * bar["V0"] + t * bar["V1"] for t in times])
    np.savez(tmp_path / "frames.npz", faces=bar["faces"], times=times, frames=frames)
    sheet = tmp_path / "sheet.png"
    row = str(tmp_path / "frames.npz")
    contact_sheet.main([f"mine={row}", "--straight", "--height", "60", "--view", "front", "--output", str(sheet)])
    picture = image.imread(sheet)[:, :, :3]
    straight, mine = picture[-120:-60, 44:], picture[-60:, 44:]
    np.testing.assert_array_equal(straight, mine)  # these frames are the straight blend
    columns = np.array_split(mine, 4, axis=1)
    assert all(np.ptp(column) > 0.3 for column in columns)
    assert np.abs(columns[0] - columns[3][:, : columns[0].shape[1]]).max() > 0.3


def test_a_moving_picture_goes_to_the_last_key_and_back(bar: dict[str, np.ndarray], tmp_path: Path) -> None:
    times = np.linspace(0.0, 1.0, 4)
    frames = np.stack([(1.0 - t) * bar["V0"] + t * bar["V1"] for t in times])
    np.savez(tmp_path / "frames.npz", faces=bar["faces"], times=times, frames=frames)
    row, moving = str(tmp_path / "frames.npz"), tmp_path / "moving.gif"
    contact_sheet.main([f"mine={row}", "--straight", "--height", "60", "--view", "front", "--output", str(moving)])
    with Image.open(moving) as picture:
        shown = []
        for number in range(picture.n_frames):
            picture.seek(number)
            shown.append(np.asarray(picture.convert("RGB"), dtype=np.float64))
    assert len(shown) == 6
    np.testing.assert_array_equal(shown[1], shown[5])
    steps = [np.abs(after - before).max() for before, after in pairwise(shown[:4])]
    assert min(steps) > 50.0
    width = shown[0].shape[1] // 2
    # Below the labels; these frames are the straight blend.
    np.testing.assert_array_equal(shown[1][30:, :width], shown[1][30:, width:])


def test_a_moving_picture_needs_rows_of_equal_length(bar: dict[str, np.ndarray], tmp_path: Path) -> None:
    for name, count in (("few", 2), ("many", 3)):
        frames = np.stack([bar["V0"], *[bar["V1"]] * (count - 1)])
        np.savez(tmp_path / f"{name}.npz", faces=bar["faces"], times=np.linspace(0.0, 1.0, count), frames=frames)
    rows = [str(tmp_path / f"{name}.npz") for name in ("few", "many")]
    with pytest.raises(SystemExit, match="different numbers of frames"):
        contact_sheet.main([*rows, "--output", str(tmp_path / "moving.gif")])
    assert not (tmp_path / "moving.gif").exists()


@pytest.mark.parametrize("through", [["Basis", "Bent"], ["Basis", "Bent", "Basis"]])
def test_a_sheet_of_a_baked_scene(through: list[str], bar_scene: Path, tmp_path: Path) -> None:
    baked, sheet = tmp_path / "baked.blend", tmp_path / "sheet.png"
    keys = ["--object", "Bar", "--from", through[0], "--to", through[-1]]
    keys += [option for name in through[1:-1] for option in ("--via", name)]
    quick = ["--frames", "1", "--mode", "linear", "--quality", "normal", "--engine", "delaunay"]
    assert main.main(["bake", str(bar_scene), *keys, *quick, "--output", str(baked)]) == 0
    contact_sheet.main([str(baked), *keys, "--height", "60", "--view", "front", "--output", str(sheet)])

    picture = image.imread(sheet)[-60:, 44:, :3]
    shapes = 2 * len(through) - 1
    columns = picture.reshape(60, shapes, -1, 3).transpose(1, 0, 2, 3)
    steps = np.abs(np.diff(columns, axis=0)).max(axis=(1, 2, 3))
    assert (steps > 0.3).all()
    if through[0] == through[-1]:
        np.testing.assert_array_equal(columns[0], columns[-1])
