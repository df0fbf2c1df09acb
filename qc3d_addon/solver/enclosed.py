# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The volumes that the closed components of a surface enclose."""

from __future__ import annotations

import numpy as np

from .stiffness import scatter
from .surface import face_normals
from .tetmesh import Floats, Ints
from .topology import closed_faces


class ClosedComponents:
    """Components of a triangle mesh in which every edge has exactly two triangles.

    Parameters
    ----------
    faces : (m, 3) int64
    labels : (n,) int64
        Component of every vertex; volumes are listed by label, zero for components that are not closed.
    """

    def __init__(self, faces: Ints, labels: Ints) -> None:
        self._faces = faces[closed_faces(faces, labels)]
        self._labels = labels
        # Seen from a vertex of its own, a tiny component far away has its volume to rounding.
        self._views: Ints = np.unique(labels, return_index=True)[1].astype(np.int64)

    @property
    def empty(self) -> bool:
        """Whether no component is closed."""
        return not len(self._faces)

    def volumes(self, positions: Floats) -> Floats:
        """(components,) signed enclosed volumes."""
        view = positions[self._views[self._labels[self._faces[:, 0]]]]
        first, second, third = (positions[self._faces[:, corner]] - view for corner in range(3))
        shares = np.einsum("ij,ij->i", first, np.cross(second, third)) / 6.0
        return self._summed(self._faces[:, 0], shares)

    def volume_gradient(self, positions: Floats) -> Floats:
        """(n, 3) derivative of each component's volume with respect to its vertices."""
        normals = face_normals(positions, self._faces) / 6.0
        return scatter(self._faces, np.repeat(normals[:, None], 3, axis=1), len(positions))

    def stepped(self, positions: Floats, direction: Floats, slope: Floats, missing: Floats) -> Floats:
        """Move each component along ``direction`` so far that, to first order, it gains its ``missing`` volume."""
        gain = self._summed(np.arange(len(positions)), (slope * direction).sum(axis=1))
        moves = gain > 0.0
        length = np.where(moves, missing / np.where(moves, gain, 1.0), 0.0)
        return np.asarray(positions + length[self._labels][:, None] * direction)

    def _summed(self, vertices: Ints, values: Floats) -> Floats:
        components = int(self._labels.max(initial=-1)) + 1
        return np.bincount(self._labels[vertices], weights=values, minlength=components).astype(np.float64)
