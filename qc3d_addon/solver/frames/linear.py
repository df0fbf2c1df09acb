# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mode ``linear``: the paper's linear interpolation of the representation."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from ..arrays import Floats
from ..collision.colliders import CollisionResolver
from ..collision.self_crossings import CrossingLimit
from ..fit.fitted_map import FittedMap
from ..maps.reconstruction import Reconstructor
from ..maps.representation import polar_decomposition
from ..tets.mesh import TetMesh
from .frame import Frame


class LinearMaps:
    """Maps between the identity and a given map, P(t) = (1 - t) I + t P (Chen & Lui, section 6.1).

    Parameters
    ----------
    mesh : TetMesh
    mapped : (N, 3)
        Values of the fold-free map at the mesh's vertices, cube units.
    """

    def __init__(self, mesh: TetMesh, mapped: Floats) -> None:
        self._mesh = mesh
        self._mapped = mapped
        self._stretch = polar_decomposition(mesh.jacobians(mapped)).stretch
        self._reconstructor = Reconstructor(mesh)

    def at(self, time: float) -> Floats:
        """(N, 3) values of the map at ``time`` in 0..1, reconstructed from the interpolated representation."""
        stretch = (1.0 - time) * np.eye(3) + time * self._stretch
        guess = (1.0 - time) * self._mesh.points + time * self._mapped
        return self._reconstructor.rebuild(stretch, self._mesh.points, start=guess)


class LinearFrames:
    """Frames of mode ``linear``: the reconstructed maps at the landmarks, with the fit's residual blended in.

    This is the published scheme, including its folds: it does not guarantee that a reconstructed map is a bijection,
    and the report counts where it is not.
    """

    notes: tuple[str, ...] = ()

    def __init__(self, fitted: FittedMap) -> None:
        self._fitted = fitted
        self._maps = LinearMaps(fitted.mesh, fitted.mapped)
        self._limit = CrossingLimit(
            fitted.pair.welded_faces, fitted.embedding.key0, fitted.embedding.key1, fitted.embedding.still
        )
        self._missed = fitted.embedding.key1 - fitted.landmarks @ fitted.mapped

    def frames(self, times: Floats, resolver: CollisionResolver | None = None) -> Generator[float, None, list[Frame]]:
        """One frame for each of ``times`` (k,) in 0..1, out of colliders; yields the finished share, 0..1."""
        made = []
        pair, still = self._fitted.pair, self._fitted.embedding.still
        for index, time in enumerate(times.tolist()):
            yield index / len(times)
            values = self._maps.at(time)
            shape = self._fitted.landmarks @ values + time * self._missed
            positions = self._fitted.embedding.from_cube(shape, time)
            # Still vertices must not move with the map around them.
            positions[still] = pair.key0[still] + time * (pair.key1 - pair.key0)[still]
            if resolver is not None:
                positions = resolver.cleared(index, positions, time, still)
            made.append(Frame.of(self._fitted, positions, values, time, False, self._limit.excess(shape)))
        return made
