# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Large motions in small steps: the fold-free map follows the surface along its path to the second key."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from .foldfree import FoldFreeFitter
from .surface_path import SurfacePath
from .tetmesh import Floats

STEP_DEGREES = 20.0
_STEP_ITERATIONS = 12
_LAST_ITERATIONS = 40


def follow_path(fitter: FoldFreeFitter, path: SurfacePath, key1: Floats) -> Generator[float, None, Floats]:
    """Fit the map to the second key by way of the shapes between.

    The number of steps follows the 99th percentile of the triangles' rotations, about 20 degrees a step.

    Parameters
    ----------
    fitter : FoldFreeFitter
    path : SurfacePath
        Shapes between the keys, cube units.
    key1 : (n, 3)
        The second key in cube units, the last target.

    Yields
    ------
    float
        The part that is done, 0..1.

    Returns
    -------
    (N, 3) values of a map without folds.
    """
    angles = np.degrees(np.linalg.norm(path.turns, axis=1))
    steps = max(1, int(np.ceil(np.percentile(angles, 99) / STEP_DEGREES))) if len(angles) else 1
    values = fitter.mesh.points
    for step in range(1, steps):
        values = fitter.fit(values, path.positions(step / steps), _STEP_ITERATIONS)
        yield step / steps
    return fitter.fit(values, key1, _LAST_ITERATIONS)
