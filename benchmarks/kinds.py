# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact sheets of kinds of meshes that are easily moved wrongly: loose parts, rigid pieces and sheets.

    python -m benchmarks.kinds   # the pictures in docs/images/kinds_*.png
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

import qc3d_addon as qc3d
from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_paper.drawing.sheets import Row, save_sheet, straight_blend

from .catalogue import ROOT

Keys = tuple[Floats, Floats, Ints]


def plate(cells: tuple[int, int]) -> tuple[Floats, Ints]:
    """A rectangle in the unit square of the xy plane, (n, 3), and its triangles (m, 3)."""
    across, along = np.meshgrid(*(np.linspace(0.0, 1.0, count + 1) for count in cells), indexing="ij")
    points = np.stack([across, along, np.zeros_like(across)], axis=2).reshape(-1, 3)
    corner = (np.arange(cells[0])[:, None] * (cells[1] + 1) + np.arange(cells[1])).ravel()
    quads = corner[:, None] + np.array([0, cells[1] + 1, cells[1] + 2, 1])
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def box(size: tuple[float, float, float]) -> tuple[Floats, Ints]:
    """A box around the origin: corners (8, 3) and triangles (12, 3)."""
    corners = (np.indices((2, 2, 2)).reshape(3, -1).T - 0.5) * np.asarray(size, dtype=np.float64)
    quads: Ints = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    return np.asarray(corners, dtype=np.float64), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def joined(parts: list[tuple[Floats, Ints]]) -> tuple[Floats, Ints]:
    """Several meshes as one."""
    starts = np.cumsum([0, *(len(points) for points, _ in parts[:-1])])
    faces = [faces + start for (_, faces), start in zip(parts, starts, strict=True)]
    return np.concatenate([points for points, _ in parts]), np.concatenate(faces)


def bird() -> Keys:
    """A body with two loose wings that bend while they beat by 60 to 90 degrees to each side."""

    def pose(angle: float) -> tuple[Floats, Ints]:
        flat, faces = plate((12, 4))
        span = np.linspace(0.0, 1.0, 401)
        slopes = np.radians(angle) * (1.0 + 0.5 * span)
        steps = np.stack([np.cos(slopes), np.sin(slopes)])[:, :-1] / 400.0
        arc = np.concatenate([np.zeros((2, 1)), np.cumsum(steps, axis=1)], axis=1)
        x, z = (np.interp(flat[:, 0], span, coordinate) for coordinate in arc)
        wing = np.column_stack([0.12 + x, 0.5 * flat[:, 1] - 0.25, z])
        return joined([box((0.2, 0.9, 0.2)), (wing, faces), (wing * [-1.0, 1.0, 1.0], faces[:, ::-1])])

    down, faces = pose(-60.0)
    return down, pose(60.0)[0], faces


def page() -> Keys:
    """A page that turns over from the right cover of a book to the left one."""
    flat, faces = plate((10, 4))
    turned = flat * [-1.0, 1.0, 1.0]
    covers = joined([(flat - [0.0, 0.0, 0.03], faces), (turned - [0.0, 0.0, 0.03], faces[:, ::-1])])
    first, every = joined([(flat, faces), covers])
    return first, np.concatenate([turned, covers[0]]), every


def stones() -> Keys:
    """Boxes that fall and turn, each its own way."""
    random = np.random.default_rng(7)
    count = 24
    corners, faces = box((0.5, 0.35, 0.2))
    places = random.uniform(0.0, 3.0, (count, 1, 3)) * [1.0, 1.0, 0.4]
    first = rotation_matrices(random.normal(scale=2.0, size=(count, 3)))
    second = rotation_matrices(random.normal(scale=1.3, size=(count, 3))) @ first
    above = corners @ first.transpose(0, 2, 1) + places
    below = corners @ second.transpose(0, 2, 1) + places - [0.0, 0.0, 1.5]
    number = 8 * np.arange(count)[:, None, None]
    return above.reshape(-1, 3), below.reshape(-1, 3), (faces + number).reshape(-1, 3)


KINDS: dict[str, tuple[Callable[[], Keys], str]] = {
    "bird": (bird, "three-quarter"),
    "page": (page, "three-quarter"),
    "stones": (stones, "auto"),
}


def save(folder: Path) -> list[Path]:
    """Draw all kinds, the straight blend above the in-betweens; return the files written."""
    written = []
    for name, (keys, view) in KINDS.items():
        key0, key1, faces = keys()
        bake = qc3d.bake([key0, key1], faces, 3)
        row = Row("natural", faces, bake.times, bake.frames)
        written.append(folder / f"kinds_{name}.png")
        save_sheet([straight_blend(row), row], view, 200, written[-1])
        print(f"wrote {written[-1]}; crossings {bake.report.crossings}, {bake.report.notes}")
    return written


if __name__ == "__main__":
    save(ROOT / "docs/images")
