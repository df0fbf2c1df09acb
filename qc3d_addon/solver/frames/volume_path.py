# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps of the cube between the identity and the fitted map, with interpolated rotations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import SuperLU
from scipy.spatial import cKDTree

from ..arrays import Floats, Ints
from ..fit.fitted_map import FittedMap
from ..maps.representation import polar_decomposition
from ..numerics.assembly import StiffnessPattern, stiffness_elements
from ..numerics.nested_dissection import elimination_order, factored
from ..numerics.rotation_unwrapping import Turning, swing_beside
from ..numerics.rotations import products
from ..numerics.symmetric_matrices import Stretch
from ..settings import StretchLaw
from ..support.threads import batches, in_threads
from ..surface.path import SurfacePath
from ..tets.mesh import TetMesh

_MAPS_AT_ONCE = 4  # solved together; more would wait for each other and gain little


class VolumePath:
    """Maps between the identity and a fitted map, from interpolated rotations and stretches.

    The map f minimizes ``sum v w |grad f - R(t) P(t)|^2`` over the tetrahedra, with their volumes v and weights w, for
    the sliding boundary of the cube. The matrix does not depend on the time and is factored once for each coordinate.

    Parameters
    ----------
    mesh : TetMesh
    maps : (K + 1, N, 3)
        Values of the fold-free maps that were fitted along the way, evenly spaced in time; the first is the identity.
    turning : Turning
        Unwrapped rotations R of the tetrahedra.
    insideness : (M,)
        Weights w of the tetrahedra: 1 inside the object, small outside.
    law : StretchLaw
        How the stretches P are interpolated.
    """

    def __init__(self, mesh: TetMesh, maps: Floats, turning: Turning, insideness: Floats, law: StretchLaw) -> None:
        self._mesh = mesh
        self._turning = turning
        self._stretch = Stretch.of(polar_decomposition(mesh.jacobians(maps[-1])).stretch)
        self._law = law
        self._weights = mesh.volumes * insideness
        elements = stiffness_elements(self._weights, mesh.gradients)
        matrix = StiffnessPattern(mesh.tets, len(mesh.points)).assemble(elements)
        order = elimination_order(mesh.points, matrix)

        def system(coordinate: int) -> tuple[Ints, SuperLU, Floats]:
            held = mesh.on_cube_face[:, coordinate]
            free, resting = order[~held[order]], np.flatnonzero(held)
            rows = matrix[free]
            return free, factored(csr_array(rows[:, free])), rows[:, resting] @ mesh.points[resting, coordinate]

        # For each coordinate: the vertices that may move along it, the factors, and the load of the fixed vertices.
        self._systems = list(in_threads(system, range(3)))
        # (K + 1, N, 3): the fitted maps minus this path.
        times = batches(np.linspace(0.0, 1.0, len(maps)).tolist(), _MAPS_AT_ONCE)
        self._missed = maps - np.concatenate(list(in_threads(self.maps_at, times)))

    def at(self, time: float) -> Floats:
        """(N, 3) values of the map at ``time`` in 0..1; it may have folds if the motion is extreme."""
        return np.asarray(self.maps_at([time])[0])

    def maps_at(self, times: Sequence[float]) -> Floats:
        """(k, N, 3) values of the maps at several times, solved together: the factors are read from memory once."""
        loads = np.stack([self._load(time) for time in times])
        values = np.tile(self._mesh.points, (len(times), 1, 1))
        for coordinate, (free, factors, held_load) in enumerate(self._systems):
            values[:, free, coordinate] = factors.solve((loads[:, free, coordinate] - held_load).T).T
        return values

    def _load(self, time: float) -> Floats:
        wanted = products(self._turning.at(time), self._stretch.at(time, self._law))
        return self._mesh.divergence(self._weights[:, None, None] * wanted)

    def followed(self, time: float, values: Floats) -> Floats:
        """(N, 3) ``values`` at ``time``, corrected by the interpolated difference of this path from the fitted maps."""
        steps = len(self._missed) - 1
        before = min(int(time * steps), steps - 1)
        part = time * steps - before
        return np.asarray(values + (1.0 - part) * self._missed[before] + part * self._missed[before + 1])


def turning_inside(fitted: FittedMap, surface: SurfacePath) -> Turning:
    """How tetrahedra turn: as the fit followed them, or, where the surface twists, with its nearest twist."""
    triangles, twist = surface.deformation.faces, surface.turning.twist
    if not twist.any():
        return Turning(fitted.turns, np.zeros_like(fitted.turns))
    centres = fitted.embedding.key0[surface.vertices[triangles]].mean(axis=1)
    nearest = cKDTree(centres).query(fitted.mesh.centroids)[1]
    twists = twist[nearest].any(axis=1)
    swing = np.where(twists[:, None], swing_beside(fitted.turns, twist[nearest]), fitted.turns)
    return Turning(swing, twist[nearest])
