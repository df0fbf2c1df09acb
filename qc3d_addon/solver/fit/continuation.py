# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Large motions in small steps: the fold-free map follows the surface along its path to the second key."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..maps.representation import polar_decomposition
from ..numerics.rotations import nearest_branch, rotation_vectors
from ..support.threads import batches
from ..surface.path import SurfacePath
from .fold_free import FoldFreeFitter

STEP_DEGREES = 20.0
_STEP_ITERATIONS = 12
_PATH_SWEEPS = 4
_LAST_ITERATIONS = 40


@dataclass(frozen=True, eq=False)
class FollowedPath:
    """The maps on the way to the second key, and how the tetrahedra turned.

    Parameters
    ----------
    maps : (K + 1, N, 3)
        Values of the maps at the times 0, 1/K, ..., 1: the identity first, the fitted map last, none with folds.
    turns : (M, 3)
        Rotation vectors of the tetrahedra in radians, followed from step to step: angles may exceed pi.
    """

    maps: Floats
    turns: Floats


def path_to(path: SurfacePath, key1: Floats) -> list[Floats]:
    """Shapes (n, 3) on the way to the second key, in cube units, evenly spaced in time; the key itself comes last.

    Their number follows the 99th percentile of the triangles' rotations, about 20 degrees a step.
    """
    angles = np.degrees(path.turning.angles)
    # Rounding must not make it one more.
    steps = max(1, int(np.ceil(np.percentile(angles, 99) / STEP_DEGREES - 1e-6))) if len(angles) else 1
    moments = [(step / steps, None) for step in range(1, steps)]
    # The shapes on the way only lead the map; they need not have settled.
    shapes = [shape for few in batches(moments, path.shapes_at_once) for shape in path.shapes(few, sweeps=_PATH_SWEEPS)]
    return [*shapes, key1]


def follow_path(fitter: FoldFreeFitter, targets: Sequence[Floats]) -> Generator[float, None, FollowedPath]:
    """Fit the map to the second key by way of the shapes between.

    Parameters
    ----------
    fitter : FoldFreeFitter
    targets : sequence of (n, 3)
        Where the landmarks should be after each step, cube units; the second key last.

    Yields
    ------
    float
        The part that is done, 0..1.
    """
    mesh, steps = fitter.mesh, len(targets)
    maps = np.empty((steps + 1, *mesh.points.shape))
    maps[0] = mesh.points
    turns = np.zeros((len(mesh.tets), 3))
    for step, target in enumerate(targets, start=1):
        maps[step] = fitter.fit(maps[step - 1], target, _LAST_ITERATIONS if step == steps else _STEP_ITERATIONS)
        turns = nearest_branch(rotation_vectors(polar_decomposition(mesh.jacobians(maps[step])).rotation), turns)
        yield step / steps
    return FollowedPath(maps, turns)
