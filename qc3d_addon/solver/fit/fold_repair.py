# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Folds of one map covered by another that has none: the other map where the folds are, a gradual change around."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..numerics.rotations import determinants
from ..tets.mesh import TetMesh

_ROUNDS = 6


def covered(mesh: TetMesh, values: Floats, other: Floats) -> Floats | None:
    """Values (N, 3) without folds, or None where folds are left after some rounds.

    Vertices of folded tetrahedra go to the other map, their neighbours halfway; where that folds others, they follow.

    Parameters
    ----------
    values : (N, 3)
        A map with few folds.
    other : (N, 3)
        A map near it without folds.
    """
    around = mesh.incidence
    share = np.zeros(len(mesh.points))
    found = values
    for _ in range(_ROUNDS):
        folded = determinants(mesh.jacobians(found)) <= 0.0
        if not folded.any():
            return found
        corners = around @ folded > 0.0
        neighbours = around @ (around.T @ corners) > 0.0
        share = np.maximum(share, 0.5 * corners + 0.5 * neighbours)
        found = np.asarray(values + share[:, None] * (other - values))
    return None if (determinants(mesh.jacobians(found)) <= 0.0).any() else found
