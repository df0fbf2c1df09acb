# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted maps: the mesh of the cube and the fold-free map of a pair of keys, computed once and used for all frames."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from ..arrays import Floats
from ..collision.self_crossings import CrossingLimit
from ..keys.embedding import Cube, Embedding
from ..keys.keypair import KeyPair
from ..numerics.rotations import determinants
from ..settings import FitOptions
from ..surface.path import SurfacePath
from ..tets.mesh import TetMesh
from .directions import path_between
from .fold_free import FoldFreeFitter
from .fold_repair import covered
from .volume import Volume

_REPAIR_ITERATIONS = 15  # of a fit that starts close to its target


@dataclass(frozen=True)
class Residual:
    """Residual of a fitted map: distances of the mapped vertices from the second key, over the bounding-box diagonal.

    Parameters
    ----------
    rms : float
        Root mean square, weighted by vertex areas.
    max : float
        The largest distance.
    """

    rms: float
    max: float


def crossing_limit(embedding: Embedding, path: SurfacePath, volume: Volume) -> CrossingLimit:
    """How much shapes between the keys of an embedded pair may cross themselves; shapes are in cube units."""
    return CrossingLimit(embedding.pair.welded_faces, embedding.key0, embedding.key1, path.still, volume.search)


@dataclass(frozen=True, eq=False)
class FittedMap:
    """The fitted map of a pair of keys. It is kept, so that later bakes of the same keys skip meshing and fitting.

    Parameters
    ----------
    pair : KeyPair
    volume : Volume
        The filled unit cube.
    maps : (K + 1, N, 3)
        Values, in cube units, of fold-free maps along the way, evenly spaced in time. The first is the identity, the
        last is fitted to the second key.
    turns : (M, 3)
        Unwrapped rotation vectors of the tetrahedra of the last map, radians.
    options : FitOptions
        The options that it was fitted with.
    embedding : Embedding
        The pair in cube units.
    notes : tuple of str
        Sentences for the user, such as why another engine was used.
    seconds : dict
        Wall-clock time of each stage, in seconds.
    path : SurfacePath, optional
        The surface path between the keys, if it is known already.
    limit : CrossingLimit, optional
        How much shapes between the keys may cross themselves, if that is known already.
    """

    pair: KeyPair
    volume: Volume
    maps: Floats
    turns: Floats
    options: FitOptions
    embedding: Embedding
    notes: tuple[str, ...] = ()
    seconds: dict[str, float] = field(default_factory=dict)
    path: SurfacePath | None = field(default=None, repr=False)
    limit: CrossingLimit | None = field(default=None, repr=False)

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
        cube: Cube | None = None,
    ) -> FittedMap:
        """Restore a fitted map from its stored parts; everything else is computed again."""
        embedding = Embedding.of(pair, cube)
        volume = Volume(mesh, engine, embedding.key0, pair.faces, embedding.weights, cube=cube)
        return cls(pair, volume, maps, turns, options, embedding, notes)

    @property
    def mesh(self) -> TetMesh:
        """The tetrahedra of the filled cube."""
        return self.volume.mesh

    @property
    def engine(self) -> str:
        """The engine that made them."""
        return self.volume.engine

    @property
    def landmarks(self) -> csr_array:
        """(n, N) barycentric coordinates of the first key's vertices in the mesh."""
        return self.volume.landmarks

    @property
    def mapped(self) -> Floats:
        """(N, 3) values of the fitted map, cube units."""
        return np.asarray(self.maps[-1])

    @cached_property
    def surface_path(self) -> SurfacePath:
        """The surface path between the keys; cached, because setting it up takes as long as several frames."""
        return self.path or path_between(self.embedding, self.options)

    @cached_property
    def crossings(self) -> CrossingLimit:
        """How much shapes between the keys may cross themselves; shapes are in cube units."""
        return self.limit or crossing_limit(self.embedding, self.surface_path, self.volume)

    @cached_property
    def fitter(self) -> FoldFreeFitter:
        """The fitter that repairs maps of the same mesh."""
        return FoldFreeFitter(self.mesh, self.landmarks, self.embedding.weights)

    def folds(self, values: Floats) -> int:
        """Number of folds of a map with ``values`` (N, 3): tetrahedra that it inverts or flattens."""
        return int((determinants(self.mesh.jacobians(values)) <= 0.0).sum())

    def unfolded(self, values: Floats, time: float) -> Floats:
        """(N, 3) a map without folds close to the map ``values`` (N, 3) at ``time`` in 0..1.

        The nearest map along the way is blended in around the folds. If folds are left, that map is instead fitted to
        the landmarks of ``values``.
        """
        nearest = self.maps[round(time * (len(self.maps) - 1))]
        found = covered(self.mesh, values, nearest)
        if found is None:
            found = self.fitter.fit(nearest, self.landmarks @ values, _REPAIR_ITERATIONS)
        return found

    def folds_left(self, values: Floats, time: float) -> int:
        """Number of folds of a map (N, 3) at ``time`` that ``unfolded`` cannot remove."""
        return self.folds(self.unfolded(values, time)) if self.folds(values) else 0

    def missed(self) -> Floats:
        """(n,) how far the map leaves each vertex from the second key, over the bounding-box diagonal."""
        embedding = self.embedding
        distances = np.linalg.norm(self.landmarks @ self.mapped - embedding.key1, axis=1)
        return np.asarray(distances / (self.pair.diagonal * embedding.scale))

    def landmark_residual(self) -> Residual:
        """Distance of the mapped landmarks from the second key."""
        missed = self.missed()
        return Residual(float(np.sqrt(self.embedding.weights @ missed**2)), float(missed.max()))
