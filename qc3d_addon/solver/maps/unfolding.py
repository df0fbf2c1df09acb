# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps with a few folds, unfolded where they are: what rounding has folded lies near a map without folds.

The energy of Garanzha et al. 2021 (*Foldover-free maps in 50 lines of code*) is finite on folded tetrahedra too: the
determinant D is replaced by (D + sqrt(D^2 + e^2)) / 2, with e lowered as the folds become shallower. It is minimized
by L-BFGS for the vertices around the folds alone, which springs hold near their places.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from ..arrays import Bools, Floats, Ints
from ..numerics.rotations import cofactors, determinants
from ..tets.mesh import TetMesh

_RINGS = (2, 3)  # of tetrahedra around the folded ones: the wider where the narrower leave folds
_SPRINGS = (100.0, 10.0, 1.0)  # strengths, the strongest first: those that unfold leave the map nearest
_ROUNDS, _ITERATIONS = 8, 60
_LEAST, _SLACK = 1e-3, 0.2  # e where there are no folds, and what it is over the deepest fold
_DONE = 1e-3  # determinant
_MOST_TETS = 100_000  # around the folds of one map: some seconds


def unfolded(mesh: TetMesh, values: Floats, free: Bools) -> Floats:
    """(N, 3) a map without folds near ``values`` (N, 3), or these themselves where none is found.

    Parameters
    ----------
    mesh : TetMesh
    values : (N, 3)
    free : (N, 3)
        Coordinates that may change.
    """
    determinant = determinants(mesh.jacobians(values))
    size = float(np.cbrt(max(float(np.median(determinant)), 0.0)))
    if not (determinant <= 0.0).any() or not size > 0.0:
        return values
    for rings in _RINGS:
        place = _Place.around(mesh, values / size, determinant <= 0.0, free, rings)
        for spring in _SPRINGS if len(place.mesh.tets) <= _MOST_TETS else ():
            found = size * (values / size)
            found[place.vertices] = size * place.unfolded(spring)
            # Rounding may count where the place is scaled back.
            if (determinants(mesh.jacobians(found)) > 0.0).all():
                return np.where(found == size * (values / size), values, found)
    return values


@dataclass(frozen=True, eq=False)
class _Place:
    """The tetrahedra around the folds of a map whose volumes are about those of the mesh.

    Parameters
    ----------
    vertices : (n,)
        Those of these tetrahedra, among all.
    mesh : TetMesh
        These tetrahedra alone.
    values : (n, 3)
    volumes : (m,)
        Over their mean.
    moving : (k,)
        Numbers of the coordinates, among the 3 n, that may change.
    edge : float
        A typical one.
    """

    vertices: Ints
    mesh: TetMesh
    values: Floats
    volumes: Floats
    moving: Ints
    edge: float

    @classmethod
    def around(cls, mesh: TetMesh, values: Floats, folded: Bools, free: Bools, rings: int) -> _Place:
        near = folded
        for _ in range(rings):
            near = _touching(mesh, near)[mesh.tets].any(axis=1)
        inside = ~_touching(mesh, ~near)
        vertices, corners = np.unique(mesh.tets[near], return_inverse=True)
        part = TetMesh(mesh.points[vertices], corners.reshape(-1, 4))
        moving = np.flatnonzero((inside[:, None] & free)[vertices])
        mean = float(part.volumes.mean())
        return cls(vertices, part, values[vertices], part.volumes / mean, moving, float(np.cbrt(mean)))

    def unfolded(self, spring: float) -> Floats:
        """(n, 3) where the energy and springs of a strength lead to."""
        start = self.values.ravel()[self.moving]
        places = start
        minimized: Any = minimize  # whose types leave this way of calling it out
        for _ in range(_ROUNDS):
            deepest = float(determinants(self._jacobians(places)).min())
            if deepest > 0.0:
                break
            softness = float(np.hypot(_LEAST, _SLACK * deepest))
            places = minimized(
                self._energy,
                places,
                (start, softness, spring),
                jac=True,
                method="L-BFGS-B",
                callback=self._stop,
                options={"maxiter": _ITERATIONS},
            ).x
        return self._whole(places)

    def _stop(self, places: Floats) -> None:
        """Ends the minimization where nothing is folded any more: further steps would only lead away."""
        if determinants(self._jacobians(places)).min() > _DONE:
            raise StopIteration

    def _energy(self, places: Floats, start: Floats, softness: float, spring: float) -> tuple[float, Floats]:
        jacobians = self._jacobians(places)
        determinant, squares = determinants(jacobians), np.einsum("mij,mij->m", jacobians, jacobians)
        root = np.hypot(determinant, softness)
        # Computed so that deep folds lose no digits.
        soft = np.where(
            determinant > 0.0, 0.5 * (determinant + root), 0.5 * softness**2 / (root + np.abs(determinant))
        )
        shape, volume = squares * soft ** (-2.0 / 3.0) / 3.0, 0.5 * (determinant**2 + 1.0) / soft
        by_squares = soft ** (-2.0 / 3.0) / 3.0
        by_determinant = determinant / soft - (2.0 / 3.0 * shape + volume) / root
        stress = 2.0 * by_squares[:, None, None] * jacobians + by_determinant[:, None, None] * cofactors(jacobians)
        total = self.mesh.divergence(self.volumes[:, None, None] * stress)
        moved = (places - start) / self.edge
        energy = float(self.volumes @ (shape + volume)) + 0.5 * spring * float(moved @ moved)
        return energy, total.ravel()[self.moving] + spring * moved / self.edge

    def _jacobians(self, places: Floats) -> Floats:
        return self.mesh.jacobians(self._whole(places))

    def _whole(self, places: Floats) -> Floats:
        whole = self.values.copy()
        whole.ravel()[self.moving] = places
        return whole


def _touching(mesh: TetMesh, chosen: Bools) -> Bools:
    """(N,) whether a vertex belongs to one of the chosen tetrahedra (M,)."""
    touched = np.zeros(len(mesh.points), dtype=bool)
    touched[mesh.tets[chosen].ravel()] = True
    return touched
