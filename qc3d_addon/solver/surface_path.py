# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface on its way from one key to the other: lengths, volumes and still vertices kept, both keys exact."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from .branches import consistent_branches
from .embedding import Embedding, RigidMotion
from .stiffness import StiffnessPattern, scatter
from .surface import TriangleDeformation, face_normals
from .tetmesh import Floats, Ints
from .topology import closed_faces, face_adjacency, sides, unique_edges, vertex_components, welded

ANCHOR_WEIGHT = 0.05
SWEEPS = 10
_VOLUME_STEPS = 2


class SurfacePath:
    """Shapes between the two keys of an embedded pair, by the surface alone; everything constant is factored once.

    Positions minimise, over the triangles with area a, rotation R_t and stretch P_t,
    ``sum a |grad x - R_t P_t|^2 + w sum m |x - anchor_t|^2``, with the rotations refitted in sweeps. Edges that
    belong to no usable triangle keep their interpolated lengths. Still vertices are held. The enclosed volume of
    every closed component is that between its key volumes.

    Parameters
    ----------
    embedding : Embedding
    anchor_weight : float
        The weight w, for a surface of area 1 and a bounding-box diagonal of 1.
    sweeps : int
        How often the rotations are refitted to the positions.
    """

    def __init__(self, embedding: Embedding, anchor_weight: float = ANCHOR_WEIGHT, sweeps: int = SWEEPS) -> None:
        self._sweeps = sweeps
        representatives, self._group = welded(embedding.key0, embedding.key1)
        self._key0, self._key1 = embedding.key0[representatives], embedding.key1[representatives]
        self._still = embedding.still[representatives]
        count = len(representatives)
        faces = self._group[embedding.pair.faces]
        self.deformation = TriangleDeformation.between(self._key0, self._key1, faces)
        self.turns = consistent_branches(self.deformation.turns, face_adjacency(self.deformation.faces))
        self._edges = _edges_without_triangle(faces, self._group[embedding.pair.edges], self.deformation.faces)
        self._lengths = [
            np.linalg.norm(key[self._edges[:, 1]] - key[self._edges[:, 0]], axis=1) for key in (self._key0, self._key1)
        ]
        links = np.concatenate([unique_edges(sides(faces)), self._edges])
        labels = vertex_components(links, count)
        self._closed = faces[closed_faces(faces, labels)]
        self._closed_labels = labels
        self._volumes = [self._enclosed(key) for key in (self._key0, self._key1)]
        weights = np.bincount(self._group, weights=embedding.weights, minlength=count)
        self._anchor = _Anchor(self._key0, self._key1, self._still, weights, labels)
        self._factor(anchor_weight, weights)

    def _factor(self, anchor_weight: float, weights: Floats) -> None:
        deformation, count = self.deformation, len(self._key0)
        elements = deformation.areas[:, None, None] * (
            deformation.gradients @ deformation.gradients.transpose(0, 2, 1)
        )
        size = float(np.linalg.norm(np.ptp(self._key0, axis=0)))
        area = float(deformation.areas.sum()) or size**2
        self._mass = anchor_weight * area / size**2 * weights
        matrix = StiffnessPattern(deformation.faces, count).assemble(elements)
        springs = StiffnessPattern(self._edges, count).assemble(
            np.broadcast_to(np.array([[1.0, -1.0], [-1.0, 1.0]]), (len(self._edges), 2, 2))
        )
        matrix = csc_array(matrix + springs + diags_array(self._mass))
        free = ~self._still
        self._held_load = (matrix[:, self._still] @ self._key0[self._still])[free]
        # The matrix is symmetric positive definite, so the pivots may stay on the diagonal.
        self._factored = splu(
            csc_array(matrix[free][:, free]),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )

    def positions(self, time: float) -> Floats:
        """(n, 3) positions in cube units at ``time`` in 0..1; the keys themselves at 0 and 1."""
        deformation = self.deformation
        anchor = self._anchor.positions(time)
        targets = deformation.target_gradients(time)
        rotations = deformation.interpolated_rotations(self.turns, time)
        positions = self._solved(anchor, rotations, targets, anchor, time)
        for _ in range(self._sweeps):
            rotations = deformation.fitted_rotations(positions, targets)
            positions = self._solved(anchor, rotations, targets, positions, time)
        return positions[self._group]

    def _solved(self, anchor: Floats, rotations: Floats, targets: Floats, previous: Floats, time: float) -> Floats:
        free = ~self._still
        load = self.deformation.load(rotations, targets, len(anchor)) + self._mass[:, None] * anchor
        load += self._spring_load(previous, time)
        positions = self._key0.copy()
        positions[free] = self._factored.solve(load[free] - self._held_load)
        return self._with_volume(positions, time)

    def _spring_load(self, positions: Floats, time: float) -> Floats:
        """(n, 3) forces of edges without triangles: their present direction at the interpolated length."""
        spans = positions[self._edges[:, 1]] - positions[self._edges[:, 0]]
        present = np.linalg.norm(spans, axis=1)
        wanted = (1.0 - time) * self._lengths[0] + time * self._lengths[1]
        spans *= np.where(present > 1e-12, wanted / np.maximum(present, 1e-12), 0.0)[:, None]
        return scatter(self._edges, np.stack([-spans, spans], axis=1), len(positions))

    def _with_volume(self, positions: Floats, time: float) -> Floats:
        """Newton steps along K^-1 grad V until every closed component has its interpolated volume."""
        if not len(self._closed):
            return positions
        wanted = (1.0 - time) * self._volumes[0] + time * self._volumes[1]
        free = ~self._still
        for _ in range(_VOLUME_STEPS):
            normals = face_normals(positions, self._closed) / 6.0
            slope = scatter(self._closed, np.repeat(normals[:, None], 3, axis=1), len(positions))
            direction = np.zeros_like(positions)
            direction[free] = self._factored.solve(slope[free])
            gain = np.bincount(self._closed_labels, weights=(slope * direction).sum(axis=1))
            missing = wanted - self._enclosed(positions)
            step = np.where(gain > 0.0, missing / np.where(gain > 0.0, gain, 1.0), 0.0)
            positions = positions + step[self._closed_labels][:, None] * direction
        return positions

    def _enclosed(self, positions: Floats) -> Floats:
        """Enclosed volume per connected component, zero for components that are not closed."""
        first, second, third = (positions[self._closed[:, corner]] for corner in range(3))
        shares = np.einsum("ij,ij->i", first, np.cross(second, third)) / 6.0
        labels = self._closed_labels
        return np.bincount(labels[self._closed[:, 0]], weights=shares, minlength=int(labels.max()) + 1)


class _Anchor:
    """Where vertices are drawn to: each component along the screw motion between its keys, the rest straight.

    A component with still vertices has no screw motion of its own.
    """

    def __init__(self, key0: Floats, key1: Floats, still: np.ndarray, weights: Floats, labels: Ints) -> None:
        self._key0 = key0
        self._parts: list[tuple[Ints, RigidMotion]] = []
        order = np.argsort(labels, kind="stable")
        starts = np.flatnonzero(np.diff(labels[order], prepend=-1))
        for members in np.split(order, starts[1:]):
            if len(members) >= 3 and not still[members].any():
                self._parts.append((members, RigidMotion.between(key0[members], key1[members], weights[members])))
        self._missing = key1 - self._moved(1.0)

    def _moved(self, time: float) -> Floats:
        moved = self._key0.copy()
        for members, motion in self._parts:
            moved[members] = motion.apply(self._key0[members], time)
        return moved

    def positions(self, time: float) -> Floats:
        """(n, 3) anchors at ``time``; exactly the keys at 0 and 1 up to rounding."""
        return self._moved(time) + time * self._missing


def _edges_without_triangle(faces: Ints, wires: Ints, usable: Ints) -> Ints:
    """(k, 2) edges that no usable triangle holds together: wires and edges of triangles without an area."""
    every = unique_edges(np.concatenate([sides(faces), wires]))
    held = unique_edges(sides(usable))
    span = int(every.max(initial=0)) + 1
    covered = np.isin(every[:, 0] * span + every[:, 1], held[:, 0] * span + held[:, 1])
    return every[~covered]
