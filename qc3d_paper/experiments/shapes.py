# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes and maps of the experiments: from formulas, from the demo files, or from a folder of .npz files."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.fit.fitted_map import FittedMap
from qc3d_addon.solver.keys.files import read_pair
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.meshing.cube import fill_cube
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.solver.tets.mesh import TetMesh

OPTIONS = FitOptions(quality="fine")
PUBLISHED = FitOptions(sampling="published")
ASSETS = Path(__file__).resolve().parents[2] / "assets"


class Pose(NamedTuple):
    """Two shapes of one mesh: a file, an object in it (for a .blend), the names of the shapes, and the up axis."""

    file: str
    object: str
    first: str
    second: str
    up: str  # the axis that points up

    @property
    def label(self) -> str:
        """Name of the pose in captions."""
        return f"{self.object or Path(self.file).stem} {self.first} → {self.second}"


FACES = tuple(Pose("suzanne.blend", "Suzanne", "Basis", key, "z") for key in ("Jaw drop", "Ears back", "Surprise"))
BODIES = tuple(Pose("limb.blend", "Arm", "Basis", key, "z") for key in ("Bend 90", "Twist 120", "Bend and twist"))
DATA_FACES = tuple(Pose("head.npz", "", "neutral", key, "y") for key in ("smile", "jawOpen", "laugh"))
DATA_BODIES = tuple(Pose("body.npz", "", "rest", key, "z") for key in ("t_pose", "sit", "arms_overhead"))


def read(pose: Pose, data: Path | None) -> KeyPair:
    """Read the two shapes of a pose, from the demo files or from the folder ``data``.

    Raises
    ------
    InputError
        If the file is missing or lacks a shape, or if a demo file is needed and Blender's module does not load.
    """
    if pose.file.endswith(".npz"):
        if data is None:
            raise InputError(f"{pose.file} is no demo file; name its folder.")
        return read_pair(data / pose.file, pose.first, pose.second)
    path = ASSETS / pose.file
    if not path.is_file():
        raise InputError(f"The demo file {path} is missing; the experiments run from a checkout of the project.")
    try:
        import bpy

        from qc3d_addon.blender.store.mesh_data import read_pairs as read_keys
    except ImportError as error:
        raise InputError(f"Blender's Python module does not load: {error}.") from error
    bpy.ops.wm.open_mainfile(filepath=str(path))
    pair: KeyPair = read_keys(bpy.data.objects[pose.object], (pose.first, pose.second))[pose.first, pose.second]
    return pair


def fitted(pair: KeyPair, options: FitOptions | None = None) -> FittedMap:
    """The fold-free map of the cube that carries the first shape onto the second."""
    return finish(fit_pair(pair, options or OPTIONS))


def cube(options: FitOptions | None = None) -> TetMesh:
    """A mesh of the unit cube, finest around a sphere in its middle."""
    points, faces = _ball()
    return fill_cube(points, faces, options or OPTIONS).mesh


def _ball(rings: int = 16, radius: float = 0.3) -> tuple[Floats, Ints]:
    """A sphere of rings and segments in the middle of the cube, normals pointing out."""
    heights = np.pi * np.arange(1, rings) / rings
    around = np.pi * np.arange(2 * rings) / rings
    ring = np.stack(
        [
            np.outer(np.sin(heights), np.cos(around)),
            np.outer(np.sin(heights), np.sin(around)),
            np.outer(np.cos(heights), np.ones_like(around)),
        ],
        axis=-1,
    )
    points = np.concatenate([ring.reshape(-1, 3), [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])
    numbers = np.arange((rings - 1) * 2 * rings).reshape(rings - 1, -1)
    after = np.roll(numbers, -1, axis=1)
    top, bottom = len(points) - 2, len(points) - 1
    faces = [
        np.stack([numbers[:-1], numbers[1:], after[1:]], axis=-1).reshape(-1, 3),
        np.stack([numbers[:-1], after[1:], after[:-1]], axis=-1).reshape(-1, 3),
        np.column_stack([np.full(2 * rings, top), numbers[0], after[0]]),
        np.column_stack([np.full(2 * rings, bottom), after[-1], numbers[-1]]),
    ]
    return 0.5 + radius * points, np.concatenate(faces).astype(np.int64)


def along_axes(points: Floats) -> Floats:
    """Points (n, 3) of the cube with each coordinate moved by a bijection of 0..1 of its own."""
    x, y, z = points.T
    return np.column_stack([x**2 * (1.5 - 0.5 * x), (np.exp(y) - 1.0) / (np.e - 1.0), np.sin(0.5 * np.pi * z)])


def whirl(points: Floats, degrees: float = 90.0) -> Floats:
    """Points (n, 3) of the cube turned around its center by up to ``degrees``, less and less toward the faces."""
    offsets = points - 0.5
    fading = np.maximum(1.0 - 4.0 * np.einsum("ij,ij->i", offsets, offsets), 0.0) ** 2
    turns = np.radians(degrees) * fading[:, None] * np.array([2.0, -1.0, 2.0]) / 3.0
    return np.asarray(0.5 + np.einsum("nij,nj->ni", rotation_matrices(turns), offsets))


def sliding(points: Floats) -> Floats:
    """Points (n, 3) of the cube moved by waves that let every face slide within itself."""
    x, y, z = (np.pi * coordinate for coordinate in points.T)
    moved = points + np.column_stack(
        [
            0.09 * np.sin(x) * np.cos(2.0 * y) * np.cos(z),
            -0.09 * np.sin(y) * np.cos(x) * np.cos(2.0 * z),
            0.08 * np.sin(z) * np.cos(2.0 * x) * np.cos(y),
        ]
    )
    # sin(pi) is not exactly zero in floating point; the faces must be kept exactly.
    held = (points == 0.0) | (points == 1.0)
    return np.where(held, points, moved)
