# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Repairs the folds of a map by blending in a fold-free one around them."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..numerics.rotations import determinants
from ..tets.mesh import TetMesh

_ROUNDS = 6  # each lets the blended region grow; folds that need more are repaired by a fit instead


def covered(mesh: TetMesh, values: Floats, other: Floats) -> Floats | None:
    """Replace a map by a fold-free one where it has folds.

    Vertices of folded tetrahedra take the values of the other map, and their neighbors the mean of both. If that folds
    further tetrahedra, these are treated in the next round.

    Parameters
    ----------
    mesh : TetMesh
    values : (N, 3)
        Values of a map with few folds.
    other : (N, 3)
        Values of a fold-free map close to it.

    Returns
    -------
    (N, 3) or None
        Values without folds; None if folds are left after all rounds.
    """
    around = mesh.incidence
    share = np.zeros(len(mesh.points))
    found = values
    for _ in range(_ROUNDS):
        folded = determinants(mesh.jacobians(found)) <= 0.0
        if not folded.any():
            return found
        corners = around @ folded > 0.0
        neighbors = around @ (around.T @ corners) > 0.0
        share = np.maximum(share, 0.5 * corners + 0.5 * neighbors)
        found = np.asarray(values + share[:, None] * (other - values))
    return None if (determinants(mesh.jacobians(found)) <= 0.0).any() else found
