# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sparse symmetric positive definite systems: fill-reducing elimination orders, and factorization."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee
from scipy.sparse.linalg import SuperLU, splu

from ..arrays import Bools, Floats, Ints
from ..errors import InputError

_LEAF = 32  # parts with at most this many unknowns are not dissected further: fill-in inside them is negligible
# Unknowns with more than this many times sqrt(n) neighbors are eliminated last, as in AMD (Amestoy, Davis & Duff 1996):
# otherwise all their neighbors would end up in separators.
_DENSE = 10.0
# Work is estimated as the sum of the cubes of the separators' sizes. Below _LITTLE_WORK a second order is not worth
# trying. _MOST_WORK takes about half a minute on one core. Very large surfaces need about 14 n^(3/2), so for them the
# limit is a few times that.
_LITTLE_WORK, _MOST_WORK, _MOST_PER_UNKNOWN = 1e9, 5e10, 50.0
_MUCH_LESS = 0.1  # a banded factorization has longer rows to process, so it must promise a clear gain


def elimination_order(points: Floats, matrix: csr_array) -> Ints:
    """Fill-reducing order in which to eliminate the unknowns of a sparse system.

    Nested dissection by coordinates. On meshes with long thin triangles its separators can become very large; then the
    reverse Cuthill-McKee order, which depends on connectivity alone, is used if it is much cheaper.

    Parameters
    ----------
    points : (n, 3)
        Positions of the unknowns.
    matrix : (n, n) sparse
        Symmetric; only its sparsity pattern matters.

    Returns
    -------
    (n,) int64
        The unknowns in the order of elimination.

    Raises
    ------
    InputError
        If so many unknowns far from each other are coupled that factoring the matrix would take too long.
    """
    few = np.diff(matrix.indptr) <= _DENSE * np.sqrt(len(points))
    chosen, many = np.flatnonzero(few), np.flatnonzero(~few)
    among = csr_array(matrix) if few.all() else csr_array(matrix[chosen][:, chosen])
    order, separators = _dissected(points[chosen], among)
    if sum(float((np.bincount(part) ** 3.0).sum()) for part, _ in separators) > _LITTLE_WORK:
        order = _easier(order, separators, among)
    return np.concatenate([chosen[order], many])


def _easier(order: Ints, separators: list[tuple[Ints, Ints]], matrix: csr_array) -> Ints:
    """The order found by dissection, which has these separators, or the banded one where that is much less work."""
    # Only the connected parts of a separator become dense blocks.
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

    Each part is bisected across its longest extent. The unknowns on one side that are coupled to the other side form
    the separator, which is eliminated after both halves. All parts of one level are bisected at once.

    Returns
    -------
    order : (n,) int64
        The unknowns in the order of elimination.
    separators : list
        For each level, the part that each separator unknown belongs to, and the index of that unknown.
    """
    count = len(points)
    entries = matrix.tocoo()
    rows, columns = entries.row, entries.col
    part = np.zeros(count, dtype=np.int64)
    inner: Bools = np.ones(count, dtype=bool)
    depth = max(0, int(np.ceil(np.log2(max(count, 1) / _LEAF))))
    # For each level and unknown: 0 or 1 for the half that it is in, 2 if it became part of a separator.
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
    """(n,) 0 or 1: which half of its part each point is in; halves have equal size, split across the longest extent."""
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
    """LU factors of a symmetric positive definite matrix whose rows are already in the order of elimination."""
    # No pivoting is needed for a positive definite matrix: the pivots stay on the diagonal.
    return splu(csc_array(matrix), permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
