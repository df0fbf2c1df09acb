# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Elementary geometry of triangles: normals, areas, tangent bases, gradients of hat functions."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..numerics.blocks import in_blocks
from ..numerics.grouped_sums import sums_by_label


def cross_product(first: Floats, second: Floats) -> Floats:
    """(3, ...) cross products of component-major vectors (3, ...)."""
    (x, y, z), (u, v, w) = first, second
    product = np.empty((3, *x.shape))
    np.subtract(y * w, z * v, out=product[0])
    np.subtract(z * u, x * w, out=product[1])
    np.subtract(x * v, y * u, out=product[2])
    return product


def face_normals(positions: Floats, faces: Ints) -> Floats:
    """(m, 3) normals of triangles (m, 3); the length of each is twice the triangle's area.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    >>> face_normals(corners, np.array([[0, 1, 2]]))
    array([[0., 0., 1.]])
    """
    first, second, third = (positions[faces[:, corner]] for corner in range(3))
    return np.asarray(np.cross(second - first, third - first))


def tangent_bases(positions: Floats, faces: Ints) -> Floats:
    """(m, 3, 3) orthonormal bases in columns: along the first edge, perpendicular to it in the plane, unit normal."""
    normal = face_normals(positions, faces)
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    along = positions[faces[:, 1]] - positions[faces[:, 0]]
    along /= np.maximum(np.linalg.norm(along, axis=1), 1e-300)[:, None]
    return np.stack([along, np.cross(normal, along), normal], axis=2)


def hat_gradients(positions: Floats, faces: Ints, bases: Floats) -> Floats:
    """(m, 3, 2) gradients of the three hat functions of each triangle, in its tangent basis (m, 3, 3)."""
    first, second = (positions[faces[:, corner]] - positions[faces[:, 0]] for corner in (1, 2))
    # The inverse of the matrix with the columns (a, c) and (b, d), the two edges in the tangent basis.
    (a, c), (b, d) = (np.einsum("mij,mi->jm", bases[:, :, :2], edge) for edge in (first, second))
    inner = np.stack([d, -b, -c, a], axis=1) / (a * d - b * c)[:, None]
    inner = inner.reshape(-1, 2, 2)
    return np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)


def planar_jacobians(positions: Floats, faces: Ints, bases: Floats, gradients: Floats) -> Floats:
    """(m, 2, 2) in-plane Jacobians of the map to ``positions``.

    Parameters
    ----------
    positions : (n, 3)
        Vertices after the map.
    faces : (m, 3) int64
    bases : (m, 3, 3)
        Tangent bases after the map.
    gradients : (m, 3, 2)
        Gradients of the hat functions in the tangent bases before the map.
    """
    corners = np.einsum("mki,mij->mkj", positions[faces], bases[:, :, :2])
    return np.asarray(np.einsum("mki,mkj->mij", corners, gradients))


def areas(positions: Floats, faces: Ints) -> Floats:
    """(m,) areas of triangles (m, 3) with vertices at positions (n, 3), in squared units.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    >>> areas(corners, np.array([[0, 1, 2]]))
    array([0.5])
    """

    def doubled(rows: slice) -> tuple[Floats]:
        first, second, third = (positions.take(faces[rows, corner], axis=0).T for corner in range(3))
        normals = cross_product(second - first, third - first)
        return (np.sqrt(np.einsum("im,im->m", normals, normals)),)

    return 0.5 * in_blocks(doubled, len(faces))[0]


def edge_lengths(positions: Floats, edges: Ints) -> Floats:
    """(e,) lengths of edges (e, 2) with ends at positions (n, 3).

    Examples
    --------
    >>> import numpy as np
    >>> edge_lengths(np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0]]), np.array([[0, 1]]))
    array([5.])
    """

    def lengths(rows: slice) -> tuple[Floats]:
        spans = positions.take(edges[rows, 1], axis=0)
        spans -= positions.take(edges[rows, 0], axis=0)
        return (np.sqrt(np.einsum("ij,ij->i", spans, spans)),)

    return in_blocks(lengths, len(edges))[0]


def vertex_areas(points: Floats, faces: Ints, shares: Floats | float = 1.0) -> Floats:
    """(n,) barycentric vertex areas: a third of the area of the triangles around each vertex.

    What the triangles count is multiplied by ``shares`` (m,).
    At least a thousandth of the mean, so that every vertex has a positive weight; all 1 for a mesh without area.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    >>> vertex_areas(corners, np.array([[0, 1, 2]]))
    array([1., 1., 1.])
    """
    shares = sums_by_label(faces.ravel(), np.repeat(areas(points, faces) * shares / 3.0, 3), len(points))
    mean = float(shares.mean())
    return np.maximum(shares, 1e-3 * mean) if mean > 0.0 else np.ones(len(points))
