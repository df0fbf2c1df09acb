# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The volumes that the closed components of a surface enclose."""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..numerics.grouped_sums import sums_by_label
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
        closed = closed_faces(faces, labels)
        self.faces = faces[closed]
        self.labels = labels
        self._is_closed = np.zeros(int(labels.max(initial=-1)) + 1, dtype=bool)
        self._is_closed[labels[self.faces[:, 0]]] = True
        # Seen from a vertex of its own, a tiny component far away has its volume to rounding.
        self._views: Ints = np.unique(labels, return_index=True)[1].astype(np.int64)

    def among(self, triangles: Ints) -> Bools:
        """(k,) which of other triangles (k, 3) of the same vertices belong to closed components."""
        return np.asarray(self._is_closed[self.labels[triangles[:, 0]]])

    def volumes(self, positions: Floats) -> Floats:
        """(components,) signed enclosed volumes of positions (n, 3)."""
        return volumes_seen_from(positions[self._views], positions, self.faces, self.labels)


def volumes_seen_from(views: Floats, positions: Floats, faces: Ints, labels: Ints) -> Floats:
    """(components,) signed volumes of the cones over triangles (m, 3), each seen from its component's view (k, 3)."""
    label = labels[faces[:, 0]]
    first, second, third = (positions[faces[:, corner]] - views[label] for corner in range(3))
    shares = np.einsum("ij,ij->i", first, np.cross(second, third)) / 6.0
    return sums_by_label(label, shares, len(views))
