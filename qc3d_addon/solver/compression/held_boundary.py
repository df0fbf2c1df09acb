# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known of the boundary of maps of a mesh: that it slides, or its images, exactly or in steps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..errors import InputError
from ..maps.boundary_conditions import Conditions
from ..maps.mapping import Mapping
from ..tets.mesh import TetMesh
from .compressed import Boundary


@dataclass(frozen=True, eq=False)
class HeldBoundary:
    """The boundary of maps of a mesh.

    Parameters
    ----------
    mesh : TetMesh
    kind : Boundary
    step : float
        In what steps the images of a fixed boundary are told; 0 for exactly.
    """

    mesh: TetMesh
    kind: Boundary
    step: float

    @cached_property
    def rows(self) -> NDArray[np.int64]:
        """(b,) the vertices whose images are told: none where the boundary slides."""
        return np.unique(self.mesh.boundary_faces) if self.kind == "fixed" else np.empty(0, dtype=np.int64)

    def images(self, targets: Floats) -> Floats:
        """(F, b, 3) the images of these vertices under maps (F, N, 3), as they are told.

        Raises
        ------
        InputError
            If a map is folded, or moves a sliding boundary out of its faces.
        """
        for values in targets:
            folds = Mapping(self.mesh, values).folds
            if folds:
                raise InputError(f"The map has {folds} folded tetrahedra; only those without can be compressed.")
            on_faces = self.mesh.on_cube_face
            if self.kind == "sliding" and not np.array_equal(values[on_faces], self.mesh.points[on_faces]):
                raise InputError(
                    "The map moves the cube's faces out of themselves; compress it with a fixed boundary."
                )
        images = np.asarray(targets[:, self.rows])
        if not self.step:
            return images
        before = self.mesh.points[self.rows]
        return np.asarray(before + self.step * np.round((images - before) / self.step))

    def conditions(self, held: Floats) -> Conditions:
        """What the rebuilding of a map with these images (b, 3) is given; InputError where they are not as many."""
        if self.kind == "sliding":
            return Conditions.sliding_cube(self.mesh)
        if held.shape != (len(self.rows), 3):
            raise InputError(f"The stored boundary has {len(held)} vertices, that of the mesh {len(self.rows)}.")
        values = np.array(self.mesh.points)
        values[self.rows] = held
        return Conditions.fixed_boundary(self.mesh, values)
