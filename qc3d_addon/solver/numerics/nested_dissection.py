# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sparse symmetric positive definite systems, factored in an order that keeps their factors small."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import SuperLU, splu

from ..arrays import Bools, Floats, Ints

_LEAF = 32  # parts of so few unknowns are not cut any more


def dissection_order(points: Floats, matrix: csr_array) -> Ints:
    """Nested dissection by coordinates (George 1973, "Nested dissection of a regular finite element mesh").

    Every part is cut in halves of equal size across its longest side; the unknowns on one side of the cut that are
    tied to the other side are the separator and come after both halves. All parts of one depth are cut at once.

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
    """
    count = len(points)
    entries = matrix.tocoo()
    rows, columns = entries.row, entries.col
    part = np.zeros(count, dtype=np.int64)
    inner: Bools = np.ones(count, dtype=bool)
    depth = max(0, int(np.ceil(np.log2(max(count, 1) / _LEAF))))
    # Of each unknown at each depth: the half it is in, 0 or 1, or 2 where it became part of a separator.
    places = np.zeros((depth, count), dtype=np.int8)
    for level in range(depth):
        members = np.flatnonzero(inner)
        half = np.zeros(count, dtype=np.int8)
        half[members] = _halves(points[members], part[members])
        cut = inner[rows] & inner[columns] & (part[rows] == part[columns]) & (half[rows] < half[columns])
        separator = np.zeros(count, dtype=bool)
        separator[rows[cut]] = True
        places[level] = np.where(separator, 2, half)
        inner &= ~separator
        part = 2 * part + half
        kept = inner[rows] & inner[columns]
        rows, columns = rows[kept], columns[kept]
    return np.asarray(np.lexsort(places[::-1]) if depth else np.arange(count), dtype=np.int64)


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
