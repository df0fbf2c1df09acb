# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Boundary conditions and landmarks for the reconstruction of a map, separately for each coordinate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Bools, Floats
from ..errors import InputError, ReconstructionError
from ..tets.mesh import TetMesh

_COORDINATES = "xyz"
_SAME = 1e-9  # of the map's size: what tables of ten digits leave


@dataclass(frozen=True, eq=False)
class Conditions:
    """Dirichlet conditions of a map: which coordinates are prescribed at which vertices, and their values.

    Parameters
    ----------
    held : (N, 3) bool
        Whether each coordinate of each vertex's image is prescribed.
    values : (N, 3)
        The prescribed values; other entries are ignored.
    """

    held: Bools
    values: Floats

    @classmethod
    def none(cls, mesh: TetMesh) -> Conditions:
        """No conditions yet."""
        return cls(np.zeros(mesh.points.shape, dtype=bool), np.array(mesh.points))

    @classmethod
    def sliding_cube(cls, mesh: TetMesh) -> Conditions:
        """Every face of the unit cube slides within itself: u is fixed on x = 0 and 1, v on y, w on z.

        Chen & Lui, section 5.2.

        Raises
        ------
        ReconstructionError
            If the mesh does not fill the unit cube.
        """
        on_faces = mesh.on_cube_face
        if not on_faces[mesh.boundary_faces].all(axis=1).any(axis=1).all():
            raise ReconstructionError(
                "The mesh does not fill the unit cube, so its boundary cannot slide; hold the boundary instead."
            )
        return cls(np.array(on_faces), np.array(mesh.points))

    @classmethod
    def fixed_boundary(cls, mesh: TetMesh, values: Floats) -> Conditions:
        """All coordinates of all boundary vertices are fixed at ``values`` (N, 3)."""
        held = np.zeros(mesh.points.shape, dtype=bool)
        held[np.unique(mesh.boundary_faces)] = True
        return cls(held, np.array(values))

    def with_landmarks(self, vertices: ArrayLike, values: ArrayLike) -> Conditions:
        """These conditions together with landmarks.

        Parameters
        ----------
        vertices : (k,) int
            Vertex indices of the landmarks, from 0.
        values : (k, 3)
            Their images; NaN leaves a coordinate without a landmark.

        Raises
        ------
        InputError
            If an index is out of range or repeated, a landmark contradicts a coordinate that is prescribed already, or
            the shapes disagree.
        """
        rows, wanted = np.asarray(vertices), np.asarray(values, dtype=np.float64)
        if rows.ndim != 1 or rows.dtype.kind not in "iu" or wanted.shape != (len(rows), 3):
            raise InputError("Landmarks are a list of vertex numbers (k,) and their images (k, 3).")
        if np.isinf(wanted).any():
            raise InputError("The image of a landmark is infinite; give a number, or leave the coordinate out.")
        if len(rows) and (rows.min() < 0 or rows.max() >= len(self.held)):
            raise InputError(f"A landmark is no vertex of the mesh; they are numbered 0 to {len(self.held) - 1}.")
        if len(np.unique(rows)) != len(rows):
            raise InputError("A vertex is a landmark twice; name each once.")
        held, merged = np.array(self.held), np.array(self.values)
        given = np.isfinite(wanted)
        there = given & self.held[rows]
        size = float(np.ptp(self.values, axis=0).max()) if there.any() else 0.0
        apart = np.where(there, np.abs(wanted - self.values[rows]), 0.0)
        wrong, axes = np.nonzero(apart > _SAME * size)
        if len(wrong):
            vertex, axis = rows[wrong[0]], axes[0]
            raise InputError(
                f"The landmark at vertex {vertex} wants {_COORDINATES[axis]} at {wanted[wrong[0], axis]:.6g}, where "
                f"the boundary holds it at {self.values[vertex, axis]:.6g}; leave that coordinate out, or free the "
                "boundary."
            )
        given &= ~there
        held[rows] |= given
        merged[rows] = np.where(given, wanted, merged[rows])
        return Conditions(held, merged)

    def require_enough(self, mesh: TetMesh) -> None:
        """Check that the conditions determine a map that is not flat on every connected part of the mesh.

        Raises
        ------
        ReconstructionError
            If a coordinate is prescribed nowhere on a part, so that it has no unique solution, or has only a single
            prescribed value there, so that it would be constant.
        """
        part, count = mesh.parts
        for coordinate, name in enumerate(_COORDINATES):
            held = self.held[:, coordinate] & (part >= 0)
            given, owners = self.values[held, coordinate], part[held]
            lowest, highest = np.full(count, np.inf), np.full(count, -np.inf)
            np.minimum.at(lowest, owners, given)
            np.maximum.at(highest, owners, given)
            missing = np.flatnonzero(np.bincount(owners, minlength=count) == 0)
            if missing.size:
                where = "nowhere" if count == 1 else f"nowhere on {missing.size} of the mesh's {count} parts"
                raise ReconstructionError(
                    f"The coordinate {name} of the map is held {where}; give boundary values or landmarks for it."
                )
            if not (highest > lowest).all():
                raise ReconstructionError(
                    f"The coordinate {name} of the map has one value wherever it is held, which makes the map flat; "
                    "hold it at two values or more."
                )
