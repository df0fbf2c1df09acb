# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes enclosed by the closed components of a surface."""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..numerics.blocks import in_blocks
from ..numerics.grouped_sums import sums_by_label
from ..numerics.rising import risen
from .geometry import areas, cross_product
from .topology import closed_faces

# A part that is turned inside out still encloses, relative to its area, at least this fraction of its former volume. A
# part that crosses itself all over or is flattened encloses almost none, and the sign of its volume means nothing.
AS_FULL = 0.3


class ClosedComponents:
    """The closed components of a triangle mesh: every edge has exactly two triangles, consistently oriented.

    Parameters
    ----------
    faces : (m, 3) int64
        All triangles of the mesh.
    labels : (n,) int64
        Component of each vertex: 0, 1, 2, ...

    Examples
    --------
    >>> tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 6.0]])
    >>> ClosedComponents(tetrahedron, np.zeros(4, dtype=np.int64)).volumes(corners)
    array([1.])
    """

    def __init__(self, faces: Ints, labels: Ints) -> None:
        closed = closed_faces(faces, labels)
        self.faces = faces if closed.all() else faces[closed]
        self.labels = labels
        self._is_closed = np.zeros(int(labels.max(initial=-1)) + 1, dtype=bool)
        self._is_closed[labels[self.faces[:, 0]]] = True
        # Measured from one of its own vertices, a tiny component far from the origin has an accurate volume.
        self._views: Ints = np.unique(labels, return_index=True)[1].astype(np.int64)

    def among(self, triangles: Ints) -> Bools:
        """(k,) which of other triangles (k, 3) of the same vertices belong to closed components."""
        return np.asarray(self._is_closed[self.labels[triangles[:, 0]]])

    def volumes(self, positions: Floats) -> Floats:
        """(components,) signed enclosed volumes for positions (n, 3), in cubed units; 0 for open components."""
        return volumes_seen_from(positions[self._views], positions, self.faces, self.labels)


    def fullness(self, positions: Floats) -> Floats:
        """(components,) signed volumes for positions (n, 3) over the areas to the power of 3/2; 0 for open components.

        They do not depend on the size; a sphere has 0.094.
        """
        volumes = self.volumes(positions)
        surface = sums_by_label(self.labels[self.faces[:, 0]], areas(positions, self.faces), len(volumes))
        return np.asarray(volumes / np.maximum(surface, 1e-100) ** 1.5)

    def reversal(self, key0: Floats, key1: Floats) -> Floats:
        """(components,) how surely each is mirrored or turned inside out between keys (n, 3), from 0 (no) to 1 (yes).

        It is 1 where the volume changes its sign and neither key is much flatter than the other.
        """
        full = np.stack([self.fullness(key) for key in (key0, key1)])
        least, most = np.abs(full).min(axis=0), np.abs(full).max(axis=0)
        share = np.where(full[0] * full[1] < 0.0, least / np.maximum(most, 1e-300), 0.0)
        return risen(share, 0.0, AS_FULL)


def volumes_seen_from(views: Floats, positions: Floats, faces: Ints, labels: Ints) -> Floats:
    """(k,) signed volumes of the cones over triangles (m, 3), by component; the apexes are ``views`` (k, 3)."""
    label = labels[faces[:, 0]]

    def cones(rows: slice) -> tuple[Floats]:
        view = views.take(label[rows], axis=0)
        first, second, third = ((positions.take(faces[rows, corner], axis=0) - view).T for corner in range(3))
        return (np.einsum("im,im->m", first, cross_product(second, third)) / 6.0,)

    return sums_by_label(label, in_blocks(cones, len(faces))[0], len(views))
