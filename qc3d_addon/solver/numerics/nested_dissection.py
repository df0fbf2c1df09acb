# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sparse symmetric positive definite systems, factored in an order that keeps their factors small."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee
from scipy.sparse.linalg import SuperLU, splu

from ..arrays import Bools, Floats, Ints
from ..errors import InputError

_LEAF = 32  # parts of so few unknowns are not cut any more
# An unknown with more ties than so many times the square root of their number comes last of all, as in AMD (Amestoy,
# Davis & Duff 1996): all those tied to one such would be separators.
_DENSE = 10.0
# Work is the sum of the cubes of separators. Little of it is not worth a second order. The most is about half a minute
# of one core or, for very large surfaces, which need about 14 for each unknown to the power 3/2, some times that.
_LITTLE_WORK, _MOST_WORK, _MOST_PER_UNKNOWN = 1e9, 5e10, 50.0
_MUCH_LESS = 0.1


def elimination_order(points: Floats, matrix: csr_array) -> Ints:
    """The order in which unknowns are eliminated with little work.

    By nested dissection. Where its cuts run along thin triangles, so that thousands of unknowns have to be eliminated
    at once, Cuthill & McKee's order, which looks at ties alone, is taken if that is much better.

    Parameters
    ----------
    points : (n, 3)
        Where the unknowns are.
    matrix : (n, n) sparse
        Only its pattern counts; symmetric.

    Returns
    -------
    (n,) int64
        The unknowns in the order of elimination.

    Raises
    ------
    InputError
        If unknowns are tied to others from all over the place, so that factoring the matrix would take very long.
    """
    few = np.diff(matrix.indptr) <= _DENSE * np.sqrt(len(points))
    chosen, many = np.flatnonzero(few), np.flatnonzero(~few)
    among = csr_array(matrix) if few.all() else csr_array(matrix[chosen][:, chosen])
    order, separators = _dissected(points[chosen], among)
    if sum(float((np.bincount(part) ** 3.0).sum()) for part, _ in separators) > _LITTLE_WORK:
        order = _easier(order, separators, among)
    return np.concatenate([chosen[order], many])


def _easier(order: Ints, separators: list[tuple[Ints, Ints]], matrix: csr_array) -> Ints:
    """The order that was found by dissection, with these separators, or another one that is much less work."""
    # A separator becomes dense only as far as it hangs together.
    component = connected_components(matrix, directed=False)[1]
    work = 0.0
    for part, unknowns in separators:
        _, sizes = np.unique(np.stack([part, component[unknowns]]), axis=1, return_counts=True)
        work += float((sizes**3.0).sum())
    banded = reverse_cuthill_mckee(matrix, symmetric_mode=True).astype(np.int64)
    rank = np.empty_like(banded)
    rank[banded] = np.arange(len(banded))
    entries = matrix.tocoo()
    reach = np.zeros(len(banded))
    np.maximum.at(reach, rank[entries.row], (rank[entries.row] - rank[entries.col]).astype(np.float64))
    work_banded = float((reach**2).sum())
    if work_banded < _MUCH_LESS * work:
        order, work = banded, work_banded
    if work > max(_MOST_WORK, _MOST_PER_UNKNOWN * len(order) ** 1.5):
        raise InputError(
            "Triangles and edges join vertices from all over the mesh rather than neighbors, so that solving for the "
            "surface would take too long; remove those that run through the mesh, or choose the mode straight."
        )
    return order


def _dissected(points: Floats, matrix: csr_array) -> tuple[Ints, list[tuple[Ints, Ints]]]:
    """Nested dissection by coordinates (George 1973, "Nested dissection of a regular finite element mesh").

    Every part is cut in halves of equal size across its longest side; the unknowns on one side of the cut that are
    tied to the other side are the separator and come after both halves. All parts of one depth are cut at once.

    Returns
    -------
    order : (n,) int64
        The unknowns in the order of elimination.
    separators : list
        For each depth the part that each separating unknown is in, and which unknown it is.
    """
    count = len(points)
    entries = matrix.tocoo()
    rows, columns = entries.row, entries.col
    part = np.zeros(count, dtype=np.int64)
    inner: Bools = np.ones(count, dtype=bool)
    depth = max(0, int(np.ceil(np.log2(max(count, 1) / _LEAF))))
    # Of each unknown at each depth: the half it is in, 0 or 1, or 2 where it became part of a separator.
    places = np.zeros((depth, count), dtype=np.int8)
    separators = []
    for level in range(depth):
        members = np.flatnonzero(inner)
        half = np.zeros(count, dtype=np.int8)
        half[members] = _halves(points[members], part[members])
        cut = inner[rows] & inner[columns] & (part[rows] == part[columns]) & (half[rows] < half[columns])
        separator = np.zeros(count, dtype=bool)
        separator[rows[cut]] = True
        places[level] = np.where(separator, 2, half)
        separators.append((part[separator], np.flatnonzero(separator)))
        inner &= ~separator
        part = 2 * part + half
        kept = inner[rows] & inner[columns]
        rows, columns = rows[kept], columns[kept]
    return np.asarray(np.lexsort(places[::-1]) if depth else np.arange(count), dtype=np.int64), separators


def _halves(points: Floats, part: Ints) -> Ints:
    """(n,) 0 or 1: the halves of each part, of equal size, along its longest side."""
    _, part = np.unique(part, return_inverse=True)
    by_part = np.argsort(part, kind="stable")
    sizes = np.bincount(part)
    starts = np.cumsum(sizes) - sizes
    extents = [reduce.reduceat(points[by_part], starts) for reduce in (np.maximum, np.minimum)]
    longest = np.argmax(extents[0] - extents[1], axis=1)
    along = points[np.arange(len(points)), longest[part]]
    order = np.lexsort((along, part))
    ranks = np.empty(len(points), dtype=np.int64)
    ranks[order] = np.arange(len(points)) - np.repeat(starts, sizes)
    return np.asarray(ranks >= (sizes // 2)[part])


def factored(matrix: csr_array) -> SuperLU:
    """LU factors of a symmetric positive definite matrix whose rows are in the order of elimination already."""
    # Positive definite: the pivots may stay on the diagonal.
    return splu(csc_array(matrix), permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
