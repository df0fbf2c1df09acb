# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The linear system of a surface's moving vertices.

On most shape keys only a small part of the mesh moves, so still vertices, and triangles with still vertices only, are
left out of the system.
"""

from __future__ import annotations

import copy
from threading import Lock

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import SuperLU

from ..arrays import Bools, Floats, Ints
from ..numerics.assembly import PerCoordinate, StiffnessPattern, stiffness_elements
from ..numerics.nested_dissection import elimination_order, factored
from ..numerics.rotations import by_component
from ..triangles.closed_volume import ClosedComponents
from ..triangles.deformation import TriangleDeformation
from ..triangles.topology import distinct
from .pieces import pieces_of
from .volumes import MovingVolumes

_MANY = 100_000  # moving vertices: factoring again takes no longer than a sweep


class MovingSurface:
    """The linear system of a surface's moving vertices, factored once for all times.

    The matrix is the weighted Laplacian of the triangles, plus the springs, plus the diagonal anchor weights.

    Parameters
    ----------
    deformation : TriangleDeformation
        All usable triangles of the surface.
    springs : (s, 2) int64
        Edges that keep their interpolated length.
    closed : ClosedComponents
        Components whose volume is kept.
    covering : tuple of (t, 3) int64 and (t,)
        Triangles that cover the surface evenly, and what each counts.
    free : (n,) bool
        Whether each vertex moves; the others are still.
    points : (n, 3)
        Positions of the vertices, for the order of elimination.
    anchor_weights : (n,)
        How strongly each vertex is drawn to its anchor.

    Attributes
    ----------
    rows : (m,) int64
        Indices, in the deformation, of the moving triangles: those with a moving corner, in the order in which their
        first corners are eliminated, so that neighbors in memory are neighbors on the surface.
    springs : (s,) int64
        Indices of the moving springs: those with a moving end.
    moving : (k,) int64
        The moving vertices, in the order of elimination.
    used : (l,) int64
        The moving vertices, followed by the still vertices next to them.
    weights : (m,)
        Of the moving triangles.
    pieces : list of Piece
        The moving triangles, in their order.
    """

    def __init__(
        self,
        deformation: TriangleDeformation,
        springs: Ints,
        closed: ClosedComponents,
        covering: tuple[Ints, Floats],
        free: Bools,
        points: Floats,
        anchor_weights: Floats,
    ) -> None:
        count = len(free)
        self.rows: Ints = np.flatnonzero(free[deformation.faces].any(axis=1))
        self.springs: Ints = np.flatnonzero(free[springs].any(axis=1))
        faces, edges = deformation.faces[self.rows], springs[self.springs]
        spring = np.broadcast_to(np.array([[1.0, -1.0], [-1.0, 1.0]]), (len(edges), 2, 2))
        stiffness = csr_array(
            StiffnessPattern(faces, count).assemble(
                stiffness_elements(deformation.weights[self.rows], by_component(deformation.gradients[self.rows]))
            )
            + StiffnessPattern(edges, count).assemble(spring)
        )
        moving = np.flatnonzero(free)
        moving = moving[elimination_order(points[moving], csr_array(stiffness[moving][:, moving]))]
        touched = [part[free[part].any(axis=1)].ravel() for part in (closed.faces, covering[0])]
        beside = distinct(np.concatenate([faces.ravel(), edges.ravel(), *touched]))
        beside = beside[~free[beside]]
        self.moving, self.used = moving, np.concatenate([moving, beside])
        number = np.zeros(count, dtype=np.int64)
        number[self.used] = np.arange(len(self.used))
        corners = number[faces]
        in_order = np.argsort(corners.min(axis=1, initial=count), kind="stable")
        self.rows, corners = self.rows[in_order], corners[in_order]
        self.weights = deformation.weights[self.rows]
        self._stiffness = csr_array(stiffness[moving][:, moving])
        self.stiffness_beside = PerCoordinate(csr_array(stiffness[moving][:, beside]))
        self.volumes = MovingVolumes(closed, covering, moving, self.used)
        self.pieces = pieces_of(corners, by_component(deformation.gradients[self.rows]), len(self.used))
        ends = np.tile([-1.0, 1.0], len(edges)), number[edges].ravel(), np.arange(0, 2 * len(edges) + 1, 2)
        self.spans = PerCoordinate(csr_array(ends, shape=(len(edges), len(self.used))))
        self._use(anchor_weights)

    def with_anchor_weights(self, anchor_weights: Floats) -> MovingSurface:
        """The same system with other anchor weights (n,)."""
        other = copy.copy(self)
        other._use(anchor_weights)
        return other

    def _use(self, anchor_weights: Floats) -> None:
        self.anchor_weights = anchor_weights[self.moving]
        self._making = Lock()
        self._factors: SuperLU | None = self._made()

    def _made(self) -> SuperLU:
        return factored(csr_array(self._stiffness + diags_array(self.anchor_weights)))

    def release(self) -> None:
        """Give up the factors of a large surface, a third of all memory, until they are needed again."""
        if len(self.moving) > _MANY:
            self._factors = None

    def solve(self, loads: Floats) -> Floats:
        """(..., k) solutions for loads (..., k) on the moving vertices.

        Solving for many loads in one call is faster: the factors are read from memory once.
        """
        with self._making:
            factors = self._factors = self._factors or self._made()
        flat = loads.reshape(-1, loads.shape[-1])
        return np.asarray(factors.solve(flat.T).T.reshape(loads.shape))
