# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The mesh's own modes: smooth functions on its graph, the lowest frequencies first, that are 0 where a field is.

They are the eigenvectors of the graph's Laplacian without the rows of the vertices whose values are known, so that a
boundary that is known stays exact whatever is left out (Karni & Gotsman, *Spectral compression of mesh geometry*, 2000,
for coordinates and without a boundary).
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import coo_array, csc_array, csr_array, diags_array
from scipy.sparse.linalg import eigsh

from ..arrays import Bools, Floats, Ints
from ..numerics.multigrid import Multigrid
from ..support.memory import FACTORED_IN_VOLUME

MOST_MODES = 120  # with more, no map or animation that was tried became smaller
# On a surface of 110,000 vertices 30 modes take six seconds of factoring; in a volume, factoring would take minutes.
MOST_VERTICES = 120_000
_DENSE = 600
# Weights that differ from edge to edge and from vertex to vertex, by a little: no symmetry and no second part of the
# mesh leaves two eigenvalues equal, so every machine finds the same modes.
_UNEVENNESS, _GROUND = 0.2, 1e-3
_SHIFT = -1e-3
_SEED = 20000723


def laplacian(edges: Ints, count: int) -> csc_array:
    """The graph's Laplacian (count, count) of edges (e, 2), slightly uneven, and positive definite."""
    random = np.random.default_rng(_SEED)
    ground = _GROUND * random.random(count)
    weights = 1.0 + _UNEVENNESS * random.random(len(edges))
    ends = np.concatenate([edges, edges[:, ::-1]]).T
    adjacency = csc_array(coo_array((np.tile(weights, 2), (ends[0], ends[1])), shape=(count, count)))
    return csc_array(diags_array(adjacency.sum(axis=0) + ground) - adjacency)


def graph_modes(matrix: csc_array, free: Bools, count: int, *, is_surface: bool) -> Floats:
    """(n, k) the lowest modes of the free vertices (n,), orthonormal, 0 at all others; k is at most ``count``.

    Those of large volumes are only nearly the lowest.
    """
    rows = np.flatnonzero(free)
    inner = csc_array(matrix[rows][:, rows])
    count = min(count, len(rows))
    start = np.random.default_rng(_SEED).normal(size=len(rows))
    if not count:
        vectors = np.zeros((len(rows), 0))
    elif len(rows) <= max(_DENSE, 3 * count):
        vectors = eigh(inner.toarray(), subset_by_index=(0, count - 1))[1]
    elif is_surface or len(free) <= FACTORED_IN_VOLUME:
        vectors = _lowest(inner, count, start)
    else:
        vectors = _interpolated(inner, count)
    modes = np.zeros((len(free), vectors.shape[1]))
    modes[rows] = vectors * np.where(start @ vectors < 0.0, -1.0, 1.0)
    return modes


def _interpolated(matrix: csc_array, count: int) -> Floats:
    """(n, k) the lowest modes among the functions that multigrid interpolates from a thirtieth of the vertices.

    They are fewer than ``count`` where vertices with very many neighbors leave multigrid with hardly any.
    """
    random = np.random.default_rng(_SEED)
    interpolation = Multigrid(csr_array(matrix), np.ones(matrix.shape[0]), random).interpolation
    few = 0 if interpolation is None else interpolation.shape[1]
    count = min(count, few // 2)
    if interpolation is None or not count:
        return np.zeros((matrix.shape[0], 0))
    coarse, mass = csc_array(interpolation.T @ (matrix @ interpolation)), csc_array(interpolation.T @ interpolation)
    if few <= _DENSE:
        return np.asarray(interpolation @ eigh(coarse.toarray(), mass.toarray(), subset_by_index=(0, count - 1))[1])
    return np.asarray(interpolation @ _lowest(coarse, count, random.normal(size=few), mass))


def _lowest(matrix: csc_array, count: int, start: Floats, mass: csc_array | None = None) -> Floats:
    """By Lanczos' method on the inverse of the shifted matrix."""
    values, vectors = eigsh(matrix, k=count, M=mass, sigma=_SHIFT, v0=start)
    return np.asarray(vectors[:, np.argsort(values, kind="stable")])
