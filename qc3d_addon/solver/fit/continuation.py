# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Continuation: for large motions, the fold-free map follows the surface along its path in small steps."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..maps.representation import polar_decomposition
from ..numerics.rotations import nearest_branch, rotation_vectors
from ..support.threads import batches
from ..surface.path import SurfacePath
from ..tets.mesh import TetMesh
from .fold_free import FoldFreeFitter

STEP_DEGREES = 20.0  # rotation in one step; each step then takes only a few Newton iterations
_STEP_ITERATIONS = 12  # at most; steps along the way need not converge
_PATH_SWEEPS = 4  # the shapes along the way only guide the map, so rough ones will do
_TARGET_STEP = 2.0**-16  # cube units, to which those shapes are rounded: far above rounding errors, far below the mesh
_LAST_ITERATIONS = 40  # at most, for the second key


@dataclass(frozen=True, eq=False)
class FollowedPath:
    """The maps along the way to the second key, and the rotations of the tetrahedra.

    Parameters
    ----------
    maps : (K + 1, N, 3)
        Values, in cube units, of the maps at the times 0, 1/K, ..., 1, all without folds. The first is the identity,
        the last the fitted map.
    turns : (M, 3)
        Rotation vectors of the tetrahedra, radians, unwrapped from step to step, so that angles may exceed pi.
    """

    maps: Floats
    turns: Floats


def path_to(path: SurfacePath, key1: Floats) -> list[Floats]:
    """Shapes (n, 3) along the way to the second key, in cube units, evenly spaced in time; the last is the key itself.

    Their number is chosen so that 99 % of the triangles turn by at most about 20 degrees in each step.
    """
    angles = np.degrees(path.turning.angles)
    # Rounding must not make it one more.
    steps = max(1, int(np.ceil(np.percentile(angles, 99) / STEP_DEGREES - 1e-6))) if len(angles) else 1
    moments = [(step / steps, None) for step in range(1, steps)]
    # The shapes along the way only guide the map; they need not have converged. Rounding them keeps noise from guiding
    # it elsewhere.
    shapes = [shape for few in batches(moments, path.shapes_at_once) for shape in path.shapes(few, sweeps=_PATH_SWEEPS)]
    return [*(np.round(shape / _TARGET_STEP) * _TARGET_STEP for shape in shapes), key1]


def follow_path(fitter: FoldFreeFitter, targets: Sequence[Floats]) -> Generator[float, None, FollowedPath]:
    """Fit the map to the second key along a sequence of targets.

    Parameters
    ----------
    fitter : FoldFreeFitter
    targets : sequence of (n, 3)
        Targets of the landmarks after each step, cube units; the last is the second key.

    Yields
    ------
    float
        Finished share of the work, 0..1.
    """
    mesh, steps = fitter.mesh, len(targets)
    maps = np.empty((steps + 1, *mesh.points.shape))
    maps[0] = mesh.points
    for step, target in enumerate(targets, start=1):
        maps[step] = fitter.fit(maps[step - 1], target, _LAST_ITERATIONS if step == steps else _STEP_ITERATIONS)
        yield step / steps
    return FollowedPath(maps, turns_along(mesh, maps))


def turns_along(mesh: TetMesh, maps: Floats) -> Floats:
    """(M, 3) rotation vectors of the tetrahedra of the last of the maps (K + 1, N, 3), unwrapped along them."""
    turns = np.zeros((len(mesh.tets), 3))
    for values in maps[1:]:
        turns = nearest_branch(rotation_vectors(polar_decomposition(mesh.jacobians(values)).rotation), turns)
    return turns
