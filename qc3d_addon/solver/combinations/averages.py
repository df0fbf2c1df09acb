# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Averages over the region around each vertex, by diffusion along the surface."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.spatial import cKDTree

from ..arrays import Bools, Floats
from ..numerics.assembly import StiffnessPattern, stiffness_elements
from ..numerics.grouped_sums import sums_by_label
from ..numerics.nested_dissection import elimination_order, factored
from ..numerics.rotations import closest_rotations
from ..triangles.deformation import TriangleDeformation

# Radius of the region, relative to the diagonal: wider than the roll of a lip, narrower than a joint.
_REGION = 0.03


class Averages:
    """Means of triangle quantities over the region around each vertex, weighted by area and distance.

    The weights come from one implicit diffusion step, whose matrix is factored once.

    Parameters
    ----------
    deformation : TriangleDeformation
        The triangles, in units of the diagonal.
    points : (k, 3)
        The vertices, in the same units.
    """

    def __init__(self, deformation: TriangleDeformation, points: Floats) -> None:
        self._faces, self._shares = deformation.faces, deformation.weights / 3.0
        count = len(points)
        masses = sums_by_label(self._faces.ravel(), np.repeat(self._shares, 3), count)
        self._vertices = np.flatnonzero(masses > 0.0)
        self._nearest = np.searchsorted(self._vertices, np.arange(count))
        others = np.flatnonzero(masses <= 0.0)
        if not len(self._vertices):
            return
        if len(others):
            self._nearest[others] = cKDTree(points[self._vertices]).query(points[others])[1]
        elements = stiffness_elements(deformation.weights, deformation.gradients)
        stiffness = StiffnessPattern(self._faces, count).assemble(elements)
        order = elimination_order(points[self._vertices], csr_array(stiffness[self._vertices][:, self._vertices]))
        self._order = self._vertices[order]
        self._masses = masses[self._order]
        own = csr_array(stiffness[self._order][:, self._order])
        self._factored = factored(csr_array(diags_array(self._masses) + _REGION**2 * own))

    def rotations(self, turned: Floats) -> Floats:
        """(k, 3, 3) mean, around each vertex, of the rotations (m, 3, 3) of the triangles."""
        if not len(self._vertices):
            return np.tile(np.eye(3), (len(self._nearest), 1, 1))
        corners = np.repeat(self._shares[:, None] * turned.reshape(-1, 9), 3, axis=0)
        loads = sums_by_label(self._faces.ravel(), corners, len(self._nearest))
        means = closest_rotations(self._spread(loads).reshape(-1, 3, 3))
        return np.asarray(means[self._nearest])

    def faded(self, places: Bools) -> Floats:
        """(k,) weights that are 1 at the chosen vertices ``places`` (k,) and fall to 0 around them."""
        if not len(self._vertices):
            return places.astype(np.float64)
        chosen = places[self._order].astype(np.float64)
        loads = np.zeros(len(places))
        loads[self._order] = self._masses * chosen
        reached = self._spread(loads[:, None])[:, 0]
        least = float(reached[places[self._vertices]].min(initial=1.0))
        return np.maximum(np.clip(reached / max(least, 1e-300), 0.0, 1.0)[self._nearest], places)

    def _spread(self, loads: Floats) -> Floats:
        """(v, c) the diffused loads (k, c), at the vertices that have triangles."""
        result = np.empty((len(loads), loads.shape[1]))
        result[self._order] = self._factored.solve(loads[self._order])
        return np.asarray(result[self._vertices])
