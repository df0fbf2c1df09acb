# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Meets the few vertices that a fit to the whole surface has left: in the tetrahedra around them, which become smaller.

Vertices that have to pass each other closely may lock: each keeps the other from its place, at any weight, since the
tetrahedra between them have no corners that could get out of the way. Halving these tetrahedra gives them some. A map
that is linear on a tetrahedron is linear on its halves, so the fit goes on from the map that is there; what is farther
away is held.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from ..arrays import Bools, Floats, Ints
from ..numerics.rotations import determinants
from ..tets.bisection import bisected
from ..tets.mesh import TetMesh
from ..tets.point_location import locate
from .fold_free import LANDMARK_WEIGHT
from .lattice import mesh_on_lattice
from .stiff_landmarks import StiffFitter

# Weights, and the most iterations with each. What is locked opens at the small ones.
_PULLS = ((1e6, 40), (1e7, 15), (1e8, 15), (1e9, 15), (1e10, 15))
_FIRST_PULLS = ((1e9, 12), (1e10, 12))  # in the round in which tetrahedra are as they were
_ROUNDS = 6  # each but the first with smaller tetrahedra
_BISECTIONS = 6  # in each round; three of them halve all lengths
_MOST = 3.0  # tetrahedra in the end, relative to those at the beginning: beyond that, what is left stays missed
_PROGRESS = 0.9  # a round that leaves more than this of what was missed is the last
_RINGS, _MORE_RINGS = 2, 3  # of tetrahedra: those that are halved, and those around them that may move


@dataclass(frozen=True)
class Aim:
    """Where vertices are to go.

    Parameters
    ----------
    sources, targets : (n, 3)
        Places of the vertices in both keys, cube units.
    weights : (n,)
        How hard they pull, with the sum 1.
    reachable : (n,) bool
        Vertices that are to be met; the others are only tried.
    met : float
        Distance up to which a vertex counts as met, cube units.
    strongest : float
        Distance from which on the force of a vertex no longer grows, cube units.
    """

    sources: Floats
    targets: Floats
    weights: Floats
    reachable: Bools
    met: float
    strongest: float

    def pull(self, missed: Floats) -> Floats:
        """(n,) weights of vertices that are missed by distances (n,): less where these are large."""
        return np.asarray(self.weights * np.minimum(1.0, self.strongest / np.maximum(missed, 1e-300)))


def meet_rest(mesh: TetMesh, maps: Floats, aim: Aim) -> Generator[float, None, tuple[TetMesh, Floats]]:
    """Meet the vertices that a map misses, as many as possible.

    Parameters
    ----------
    mesh : TetMesh
    maps : (K, N, 3)
        Values of maps of the mesh; the last one is to meet the vertices.
    aim : Aim

    Yields
    ------
    float
        The fraction that is done, in [0, 1].

    Returns
    -------
    mesh : TetMesh
        The mesh with smaller tetrahedra.
    maps : (K, N + P, 3)
    """
    owners, weights = locate(mesh, aim.sources)
    missed = np.linalg.norm(_at(mesh, owners, weights, maps[-1]) - aim.targets, axis=1)
    most, before = _MOST * len(mesh.tets), np.inf
    for number in range(_ROUNDS):
        locked = (missed > aim.met) & aim.reachable
        tried = locked if number else missed > aim.met
        left = float(missed[locked].sum())
        if not tried.any() or len(mesh.tets) > most or left > _PROGRESS * before:
            break
        before = left if number else np.inf
        region = _around(mesh, owners[tried], _RINGS + _MORE_RINGS)
        part = _Part(region, np.unique(mesh.tets[region]), np.flatnonzero(region[owners]))
        halved = _around(mesh, owners[locked] if number else owners[:0], _RINGS)[region]
        mesh, maps = part.fitted(mesh, maps, aim, halved, _PULLS if number else _FIRST_PULLS)
        owners, weights = locate(mesh, aim.sources)
        missed = np.linalg.norm(_at(mesh, owners, weights, maps[-1]) - aim.targets, axis=1)
        yield (number + 1) / _ROUNDS
    return mesh, maps


@dataclass(frozen=True, eq=False)
class _Part:
    """A part of the mesh: its tetrahedra ``region`` (M,), its vertices (k,) and the landmarks in it (l,)."""

    region: Bools
    vertices: Ints
    landmarks: Ints

    def fitted(
        self, mesh: TetMesh, maps: Floats, aim: Aim, halved: Bools, pulls: Sequence[tuple[float, int]]
    ) -> tuple[TetMesh, Floats]:
        """The mesh and its maps after some tetrahedra of the part have become smaller and the last map is fitted."""
        own, ways = TetMesh(mesh.points[self.vertices], self._own(mesh)), maps[:, self.vertices]
        for _ in range(_BISECTIONS if halved.any() else 0):
            own, ways, parents = bisected(own, halved, ways)
            halved = halved[parents]
        own = _new_on_lattice(own, len(self.vertices), ways)
        held = np.zeros(len(own.points), dtype=bool)
        held[np.searchsorted(self.vertices, np.intersect1d(self.vertices, mesh.tets[~self.region]))] = True
        share = len(mesh.tets) / len(own.tets)  # of all weights of tetrahedra; those of vertices have to keep up
        ways[-1] = self._met(own, ways[-1], aim, held, [(weight * share, most) for weight, most in pulls])
        # The points of the part keep their numbers, and new ones come last.
        new = np.arange(len(own.points) - len(self.vertices)) + len(mesh.points)
        numbers = np.concatenate([self.vertices, new])
        points = np.concatenate([mesh.points, own.points[len(self.vertices) :]])
        values = np.concatenate([maps, ways[:, len(self.vertices) :]], axis=1)
        values[:, self.vertices] = ways[:, : len(self.vertices)]
        return TetMesh(points, np.concatenate([mesh.tets[~self.region], numbers[own.tets]])), values

    def _own(self, mesh: TetMesh) -> Ints:
        return np.searchsorted(self.vertices, mesh.tets[self.region])

    def _met(self, own: TetMesh, start: Floats, aim: Aim, held: Bools, pulls: Sequence[tuple[float, int]]) -> Floats:
        """(k, 3) values of the part's map that meets its landmarks."""
        owners, weights = locate(own, aim.sources[self.landmarks])
        starts = np.arange(0, 4 * len(owners) + 1, 4)
        shape = len(owners), len(own.points)
        landmarks = csr_array((weights.ravel(), own.tets[owners].ravel(), starts), shape=shape)
        targets = aim.targets[self.landmarks]
        values, fitter = start, StiffFitter(own, landmarks, aim.weights[self.landmarks], held=held)
        for weight, most in pulls:
            missed = np.linalg.norm(fitter.residuals(values, targets), axis=1)
            if missed.max(initial=0.0) <= 0.5 * aim.met:
                break
            pull = np.zeros(len(aim.weights))
            pull[self.landmarks] = missed
            fitter = fitter.with_weights(weight / LANDMARK_WEIGHT * aim.pull(pull)[self.landmarks])
            values = fitter.fit(values, targets, most)
        return values


def _new_on_lattice(mesh: TetMesh, count: int, maps: Floats) -> TetMesh:
    """The mesh with all but its first points on the lattice that suits it, if neither it nor its maps fold by that."""
    rounded = TetMesh(np.concatenate([mesh.points[:count], mesh_on_lattice(mesh).points[count:]]), mesh.tets)
    if rounded.volumes.min() <= 0.0 or min(determinants(rounded.jacobians(values)).min() for values in maps) <= 0.0:
        return mesh
    return rounded


def _around(mesh: TetMesh, tets: Ints, rings: int) -> Bools:
    """(M,) the tetrahedra around those with some numbers, ring by ring."""
    found = np.zeros(len(mesh.tets), dtype=bool)
    found[tets] = True
    touched = np.zeros(len(mesh.points), dtype=bool)
    for _ in range(rings):
        touched[mesh.tets[found]] = True
        found = np.asarray(touched[mesh.tets].any(axis=1))
    return found


def _at(mesh: TetMesh, owners: Ints, weights: Floats, values: Floats) -> Floats:
    """(n, 3) a map's values at points with barycentric weights (n, 4) in tetrahedra (n,)."""
    return np.asarray(np.einsum("nk,nka->na", weights, values[mesh.tets[owners]]))
