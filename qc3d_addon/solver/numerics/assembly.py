# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sparsity pattern of a simplicial mesh, built once, matrices scattered into it, and its gradient operator."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.sparse import bsr_array, csr_array

from ..arrays import Floats, Ints


class StiffnessPattern:
    """Where the entries of element matrices land in a sparse N x N matrix.

    Parameters
    ----------
    elements : (M, k) int64
        Vertex indices of the elements (k = 3 triangles, 4 tetrahedra).
    count : int
        Number of vertices N.
    """

    def __init__(self, elements: Ints, count: int) -> None:
        corners = elements.shape[1]
        rows = np.repeat(elements, corners, axis=1).ravel()
        columns = np.tile(elements, (1, corners)).ravel()
        codes, self._slots = np.unique(rows * count + columns, return_inverse=True)
        self._columns = (codes % count).astype(np.int32)
        self._starts = np.searchsorted(codes // count, np.arange(count + 1)).astype(np.int32)
        self.count = count

    def assemble(self, element_matrices: Floats) -> csr_array:
        """Sum (M, k, k) element matrices into an (N, N) matrix."""
        data = np.bincount(self._slots, weights=element_matrices.ravel(), minlength=len(self._columns))
        return csr_array((data, self._columns, self._starts), shape=(self.count, self.count))

    def assemble_blocks(self, element_blocks: Floats) -> bsr_array:
        """Sum (M, k, k, 3, 3) element matrices with 3 x 3 blocks into a (3N, 3N) matrix."""
        data = self._sums @ element_blocks.reshape(-1, 9)
        return bsr_array(
            (data.reshape(-1, 3, 3), self._columns, self._starts), shape=(3 * self.count, 3 * self.count)
        )

    @cached_property
    def _sums(self) -> csr_array:
        """(entries, M k k): the entries of element matrices that meet in each entry of the sparse matrix."""
        order = np.argsort(self._slots, kind="stable")
        starts = np.concatenate([[0], np.cumsum(np.bincount(self._slots, minlength=len(self._columns)))])
        return csr_array((np.ones(len(order)), order, starts), shape=(len(self._columns), len(order)))


def gradient_operator(elements: Ints, gradients: Floats, count: int) -> csr_array:
    """(d m, count): takes values (count,) to their derivatives in the first direction on all elements, then the next.

    Parameters
    ----------
    elements : (m, k) int64
    gradients : (m, k, d)
        Of the hat functions.
    count : int
        How many vertices there are.
    """
    directions = gradients.shape[2]
    columns = np.tile(elements, (directions, 1)).ravel()
    starts = np.arange(0, len(columns) + 1, elements.shape[1])
    return csr_array(
        (gradients.transpose(2, 0, 1).ravel(), columns, starts), shape=(directions * len(elements), count)
    )


def stiffness_elements(volumes: Floats, gradients: Floats, conductivity: Floats | None = None) -> Floats:
    """(M, k, k) element matrices v G A G^T of the operator -div(A grad); A = identity where it is not given."""
    flux = gradients if conductivity is None else gradients @ conductivity
    return np.asarray(volumes[:, None, None] * (flux @ gradients.transpose(0, 2, 1)))
