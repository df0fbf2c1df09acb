# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps of the cube between the identity and the fitted map, with interpolated rotations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from ..arrays import Floats
from ..fit.fitted_map import FittedMap
from ..maps.representation import polar_decomposition
from ..maps.volume_system import VolumeSystem
from ..numerics.rotation_unwrapping import Turning, swing_beside
from ..numerics.rotations import products
from ..numerics.symmetric_matrices import Stretch
from ..settings import StretchLaw
from ..support.threads import batches, in_threads
from ..surface.path import SurfacePath

_MAPS_AT_ONCE = 4  # solved together; more would wait for each other and gain little


class VolumePath:
    """Maps between the identity and a fitted map, from interpolated rotations and stretches.

    The Jacobians of the map at a time come as near to R(t) P(t) as ``VolumeSystem`` can bring them.

    Parameters
    ----------
    system : VolumeSystem
        The linear system of the mesh.
    maps : (K + 1, N, 3)
        Values of the fold-free maps that were fitted along the way, evenly spaced in time; the first is the identity.
    turning : Turning
        Unwrapped rotations R of the tetrahedra.
    law : StretchLaw
        How the stretches P are interpolated.
    """

    def __init__(self, system: VolumeSystem, maps: Floats, turning: Turning, law: StretchLaw) -> None:
        self._system = system
        self._turning = turning
        self._stretch = Stretch.of(polar_decomposition(system.mesh.jacobians(maps[-1])).stretch)
        self._law = law
        # (K + 1, N, 3): the fitted maps minus this path.
        times = batches(np.linspace(0.0, 1.0, len(maps)).tolist(), _MAPS_AT_ONCE)
        self._missed = maps - np.concatenate(list(in_threads(self.maps_at, times)))

    def at(self, time: float) -> Floats:
        """(N, 3) values of the map at ``time`` in 0..1; it may have folds if the motion is extreme."""
        return np.asarray(self.maps_at([time])[0])

    def maps_at(self, times: Sequence[float]) -> Floats:
        """(k, N, 3) values of the maps at several times, solved together."""
        return self._system.solve(np.stack([self._load(time) for time in times]))

    def _load(self, time: float) -> Floats:
        return self._system.load(products(self._turning.at(time), self._stretch.at(time, self._law)))

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
    centers = fitted.embedding.key0[surface.vertices[triangles]].mean(axis=1)
    nearest = cKDTree(centers).query(fitted.mesh.centroids)[1]
    twists = twist[nearest].any(axis=1)
    swing = np.where(twists[:, None], swing_beside(fitted.turns, twist[nearest]), fitted.turns)
    return Turning(swing, twist[nearest])
