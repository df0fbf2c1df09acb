# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Finite-element assembly: a sparsity pattern built once and filled many times, and the gradient operator."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.sparse import bsr_array, csc_array, csr_array

from ..arrays import Floats, Ints

_FEW_ENTRIES = 50_000  # of a sparse matrix: beyond, three products take no longer than one


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


def repeated(matrix: csr_array, times: int, values: Floats | None = None) -> csr_array:
    """(times r, times c) block diagonal matrix of a sparse matrix (r, c), with other values if they are given.

    Parameters
    ----------
    matrix : (r, c) sparse
    times : int
    values : (times e,), optional
        The values of the e entries of each block, in their order.
    """
    again = np.arange(times, dtype=matrix.indices.dtype)[:, None]
    starts = np.append((matrix.indptr[:-1] + again * matrix.indptr[-1]).ravel(), times * matrix.indptr[-1])
    columns = (matrix.indices + again * matrix.shape[1]).ravel()
    held = np.tile(matrix.data, times) if values is None else values
    return csr_array((held, columns, starts), shape=(times * matrix.shape[0], times * matrix.shape[1]))


class PerCoordinate:
    """A sparse matrix (r, c) that is applied to each of three coordinates.

    Where it is small, a single product for all three saves calls, which take longer than the numbers.
    """

    def __init__(self, matrix: csr_array) -> None:
        self.shape = matrix.shape
        self._together = 3 if matrix.nnz <= _FEW_ENTRIES else 1
        self._matrix = repeated(matrix, self._together) if self._together > 1 else matrix

    def __call__(self, coordinates: Floats) -> Floats:
        """(3, ..., r) the products with an array (3, ..., c)."""
        return self._applied(self._matrix, coordinates, self.shape[0])

    def transposed(self, coordinates: Floats) -> Floats:
        """(3, ..., c) the products of the transpose with an array (3, ..., r)."""
        return self._applied(self._matrix.T, coordinates, self.shape[1])

    def _applied(self, matrix: csr_array | csc_array, coordinates: Floats, rows: int) -> Floats:
        if self._together > 1 and coordinates.ndim > 2:  # each product is for the coordinates of one shape
            return np.stack([self._applied(matrix, shape, rows) for shape in np.moveaxis(coordinates, 1, 0)], axis=1)
        parts = coordinates.reshape(-1 if matrix.shape[1] else 3 // self._together, matrix.shape[1])
        return np.asarray(np.stack([matrix @ part for part in parts]).reshape(*coordinates.shape[:-1], rows))


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
