# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Finite-element assembly: a sparsity pattern built once and filled many times, and the gradient operator."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.sparse import bsr_array, csr_array

from ..arrays import Floats, Ints


class StiffnessPattern:
    """The sparsity pattern of a mesh's stiffness matrix: where each entry of an element matrix is added.

    Build it once for a mesh, then assemble as many matrices as needed.

    Parameters
    ----------
    elements : (M, k) int64
        Vertex indices of the elements: k = 2 for edges, 3 for triangles, 4 for tetrahedra.
    count : int
        Number of vertices N.

    Examples
    --------
    >>> pattern = StiffnessPattern(np.array([[0, 1], [1, 2]]), 3)
    >>> spring = np.array([[1.0, -1.0], [-1.0, 1.0]])
    >>> pattern.assemble(np.stack([spring, spring])).toarray()
    array([[ 1., -1.,  0.],
           [-1.,  2., -1.],
           [ 0., -1.,  1.]])
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
        """(entries, M k k) matrix of ones that adds up the element entries belonging to each entry of the result."""
        order = np.argsort(self._slots, kind="stable")
        starts = np.concatenate([[0], np.cumsum(np.bincount(self._slots, minlength=len(self._columns)))])
        return csr_array((np.ones(len(order)), order, starts), shape=(len(self._columns), len(order)))


def gradient_operator(elements: Ints, gradients: Floats, count: int) -> csr_array:
    """Sparse matrix that takes vertex values to their gradients, which are constant on each element.

    Parameters
    ----------
    elements : (m, k) int64
        Vertex indices of the elements.
    gradients : (m, k, d)
        Gradients of the k hat functions of each element.
    count : int
        Number of vertices.

    Returns
    -------
    (d m, count) sparse
        The rows are ordered by direction: the derivatives along the first axis on all elements, then along the second.
    """
    directions = gradients.shape[2]
    columns = np.tile(elements, (directions, 1)).ravel()
    starts = np.arange(0, len(columns) + 1, elements.shape[1])
    return csr_array(
        (gradients.transpose(2, 0, 1).ravel(), columns, starts), shape=(directions * len(elements), count)
    )


def stiffness_elements(volumes: Floats, gradients: Floats, conductivity: Floats | None = None) -> Floats:
    """Element matrices v G A Gᵀ of the operator -div(A grad).

    Parameters
    ----------
    volumes : (M,)
        Volume, area or length v of each element.
    gradients : (M, k, d)
        Gradients G of the hat functions.
    conductivity : (M, d, d), optional
        Symmetric matrices A; the identity by default.

    Returns
    -------
    (M, k, k)
    """
    flux = gradients if conductivity is None else gradients @ conductivity
    return np.asarray(volumes[:, None, None] * (flux @ gradients.transpose(0, 2, 1)))
