# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a pair of keys needs only once: the mesh of the cube and the fold-free map fitted to the keys."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from ..arrays import Floats
from ..keys.embedding import Embedding
from ..keys.keypair import KeyPair
from ..numerics.rotations import determinants
from ..settings import FitOptions
from ..surface.path import SurfacePath
from ..tets.mesh import TetMesh
from ..tets.point_location import interpolation_matrix
from ..triangles.winding_number import insideness, winding_numbers
from .fold_free import FoldFreeFitter
from .fold_repair import covered

_REPAIR_ITERATIONS = 15


@dataclass(frozen=True)
class Residual:
    """How far a fitted map leaves the vertices from the second key, over the bounding-box diagonal.

    Parameters
    ----------
    rms
        Root of the mean square, weighted by the areas around the vertices.
    max
        The worst vertex.
    """

    rms: float
    max: float


@dataclass(frozen=True, eq=False)
class FittedMap:
    """A fitted map of the cube, kept so that later bakes of the same keys skip meshing and fitting.

    Parameters
    ----------
    pair : KeyPair
    mesh : TetMesh
        The filled unit cube.
    maps : (K + 1, N, 3)
        Values at the mesh's vertices, cube units, of maps without folds along the way, evenly spaced in time: the
        identity first, the map fitted to the second key last.
    turns : (M, 3)
        Rotation vectors of the tetrahedra of the last map, radians, in the branch that the motion takes.
    options : FitOptions
        What it was fitted with.
    engine : str
        The engine that made the mesh, which option ``auto`` leaves open.
    embedding : Embedding
        The pair in cube units.
    landmarks : (n, N)
        Barycentric coordinates of the first key's vertices in the mesh.
    notes : tuple of str
        Sentences for the user, such as why another engine ran.
    seconds : dict
        Time spent per stage.
    path : SurfacePath, optional
        The surface's path between the keys, where it is known already.
    """

    pair: KeyPair
    mesh: TetMesh
    maps: Floats
    turns: Floats
    options: FitOptions
    engine: str
    embedding: Embedding
    landmarks: csr_array
    notes: tuple[str, ...] = ()
    seconds: dict[str, float] = field(default_factory=dict)
    path: SurfacePath | None = field(default=None, repr=False)

    @classmethod
    def restored(
        cls,
        pair: KeyPair,
        mesh: TetMesh,
        maps: Floats,
        turns: Floats,
        options: FitOptions,
        engine: str,
        notes: tuple[str, ...] = (),
    ) -> FittedMap:
        """A fitted map from what is stored of it; the rest is computed again."""
        embedding = Embedding.of(pair)
        landmarks = interpolation_matrix(mesh, embedding.key0)
        return cls(pair, mesh, maps, turns, options, engine, embedding, landmarks, notes)

    @property
    def mapped(self) -> Floats:
        """(N, 3): values of the fitted map."""
        return np.asarray(self.maps[-1])

    @cached_property
    def surface_path(self) -> SurfacePath:
        """The surface's path between the keys; kept, because setting it up costs as much as several frames."""
        return self.path or SurfacePath(self.embedding, self.options.stretch, self.options.extra_turns != 0)

    @cached_property
    def insideness(self) -> Floats:
        """(M,) how far inside the object the tetrahedra are."""
        return insideness(winding_numbers(self.embedding.key0, self.pair.faces, self.mesh.centroids))

    @cached_property
    def fitter(self) -> FoldFreeFitter:
        """Fits further maps of the same mesh."""
        return FoldFreeFitter(self.mesh, self.landmarks, self.embedding.weights)

    def folds(self, values: Floats) -> int:
        """Tetrahedra that the map with these values (N, 3) does not keep positively oriented."""
        return int((determinants(self.mesh.jacobians(values)) <= 0.0).sum())

    def unfolded(self, values: Floats, time: float) -> Floats:
        """A map without folds near the map ``values`` (N, 3), by means of the nearest on the way.

        That covers the folds; where it cannot, it is drawn to the landmarks of ``values``.
        """
        nearest = self.maps[round(time * (len(self.maps) - 1))]
        found = covered(self.mesh, values, nearest)
        if found is None:
            found = self.fitter.fit(nearest, self.landmarks @ values, _REPAIR_ITERATIONS)
        return found

    def folds_left(self, values: Floats, time: float) -> int:
        """Folds of a map (N, 3) at ``time`` that cannot be taken away by means of the fitted maps."""
        return self.folds(self.unfolded(values, time)) if self.folds(values) else 0

    def landmark_residual(self) -> Residual:
        """Distance of the mapped landmarks from the second key."""
        embedding = self.embedding
        missed = np.linalg.norm(self.landmarks @ self.mapped - embedding.key1, axis=1)
        missed /= self.pair.diagonal * embedding.scale
        return Residual(float(np.sqrt(embedding.weights @ missed**2)), float(missed.max()))
