# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Unwrapped rotations where no choice of full turns lets all neighbors agree.

Where skinning folds the inner side of a joint over, the rotations around each end of the fold add up to a full turn,
and somewhere between the two ends neighbors must differ by a full turn. The minimum spanning tree leaves that to the
largest of many similar angles. Here each rotation takes the branch nearest to the smoothed rotations of its
surroundings, in which the fold is gone: so keys that differ by rounding, or are symmetric, have the same branches.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.linalg import splu

from ..arrays import Bools, Floats, Ints
from .rising import risen
from .rotation_forest import RotationForest, relative_angles
from .rotations import closest_rotations, nearest_branch, rotation_matrices, rotation_vectors

# Strengths of smoothing, in squared steps from neighbor to neighbor: the weakest that closes the tear is used.
_STRENGTHS = (10.0, 40.0, 160.0, 640.0)
# Rotations are smoothed so many times the root of the strength around a tear. Farther away, it counts for e^-8.
_AROUND = 8.0
# What turns differently from its surroundings by about half a turn might as well turn the other way: from the first
# angle on, it counts less and less, and from the second one on, nothing.
_APART = np.radians(150.0), np.radians(175.0)


def closed_tears(forest: RotationForest, vectors: Floats, turns: Floats, adjacency: Ints) -> tuple[Floats, Floats]:
    """Unwrapped rotations, each as near as possible to the smoothed ones of its surroundings, and how certain each is.

    Parts in which all neighbors agree are left as they are, and so are those in which even the strongest smoothing
    leaves neighbors that disagree.

    Parameters
    ----------
    forest : RotationForest
        Rooted trees of ``turns``.
    vectors : (m, 3)
        Rotation vectors, radians, unwrapped along the forest.
    turns : (m, 3)
        The same rotations, with angles in [0, pi].
    adjacency : (k, 2) int64
        Pairs of neighboring elements.

    Returns
    -------
    vectors : (m, 3)
        Rotation vectors, radians.
    certainty : (m,)
        0 where a rotation is about half a turn from its surroundings, up to 1 where it is not.

    Examples
    --------
    Two rows of four elements, side by side: the first turns evenly to 130 degrees, the second one the other way round.

    >>> angles = np.array([0.0, 45.0, 85.0, 130.0, 0.0, -85.0, -140.0, 130.0])
    >>> turns = np.radians(angles)[:, None] * [0.0, 0.0, 1.0]
    >>> adjacency = np.array([[0, 1], [1, 2], [2, 3], [4, 5], [5, 6], [6, 7], [0, 4], [1, 5], [2, 6], [3, 7]])
    >>> forest = RotationForest(turns, adjacency).rooted(np.linalg.norm(turns, axis=1))
    >>> torn = forest.carried(turns, nearest_branch)
    >>> np.degrees(closed_tears(forest, torn, turns, adjacency)[0][:, 2]).round(6) + 0.0
    array([  0.,  45.,  85., 130.,   0., -85., 220., 130.])
    """
    torn = _disagreeing(vectors, adjacency)
    left = _parts_with(torn, forest)
    result, apart = vectors, np.zeros(len(turns))
    for strength in _STRENGTHS:
        if not left.any():
            break
        ends = torn[left[forest.labels[torn[:, 0]]]].ravel()
        guide = _smoothed(turns, adjacency, ends, strength)
        guide[forest.roots] = nearest_branch(guide[forest.roots], vectors[forest.roots])
        away = np.ones(len(turns))
        away[forest.roots] = 0.0
        guide = RotationForest(guide, adjacency).rooted(away).carried(guide, nearest_branch)
        closed = left & ~_parts_with(_disagreeing(guide, adjacency), forest)
        inside = closed[forest.labels]
        result = np.where(inside[:, None], nearest_branch(turns, guide), result)
        apart = np.where(inside, relative_angles(turns, guide), apart)
        left &= ~closed
    return result, 1.0 - risen(apart, *_APART)


def _disagreeing(vectors: Floats, adjacency: Ints) -> Ints:
    """(c, 2) those neighbors that are on different branches."""
    first, second = vectors[adjacency[:, 0]], vectors[adjacency[:, 1]]
    far = np.flatnonzero(((first - second) ** 2).sum(axis=1) > np.pi**2)  # nearer ones are on the same branch
    first, second = first[far], second[far]
    other = np.abs(nearest_branch(first, second) - first).max(axis=1, initial=0.0) > np.pi
    return np.asarray(adjacency[far[other]])


def _parts_with(neighbors: Ints, forest: RotationForest) -> Bools:
    """(parts,) whether any of these neighbors (c, 2) are in each part."""
    found = np.zeros(len(forest.roots), dtype=bool)
    found[forest.labels[neighbors[:, 0]]] = True
    return found


def _smoothed(turns: Floats, adjacency: Ints, tears: Ints, strength: float) -> Floats:
    """Rotation vectors (m, 3), angles in [0, pi], of rotations that are smoothed around the elements ``tears``.

    The matrices are diffused for a time, ``strength``, and the nearest rotations taken. Others stay as they are.
    """
    rows, columns = np.concatenate([adjacency, adjacency[:, ::-1]]).T.astype(np.int32)
    beside = coo_array((np.ones(len(rows)), (rows, columns)), shape=(len(turns), len(turns))).tocsr()
    near = np.zeros(len(turns))
    near[tears] = 1.0
    for _ in range(int(np.ceil(_AROUND * np.sqrt(strength)))):
        near = np.asarray((near + beside @ near) > 0.0, dtype=np.float64)
    inside, outside = near > 0.0, near == 0.0
    matrices = rotation_matrices(turns).reshape(-1, 9)
    within = beside[inside]
    degrees = diags_array(np.asarray(within.sum(axis=1)).ravel())
    system = diags_array(np.ones(int(inside.sum()))) + strength * (degrees - within[:, inside])
    known = matrices[inside] + strength * (within[:, outside] @ matrices[outside])
    factors = splu(
        csc_array(system), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    smooth = turns.copy()
    smooth[inside] = rotation_vectors(closest_rotations(factors.solve(known).reshape(-1, 3, 3)))
    return smooth
