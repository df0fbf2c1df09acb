# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The 3D quasiconformal representation of a map: the symmetric stretch of its Jacobian on each tetrahedron.

J = R P with P symmetric positive definite (Chen & Lui, "A Novel 3D Mapping Representation and its Applications",
section 5.1). P has six numbers for each tetrahedron: its upper triangle, or its three eigenvalues and the Euler angles
of its eigenvectors.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Floats
from ..errors import ReconstructionError
from ..numerics.rotations import closest_rotations, cofactors, determinants

# Order of the six numbers of a symmetric matrix: xx, xy, xz, yy, yz, zz.
_ROWS, _COLUMNS = np.triu_indices(3)


class Polar(NamedTuple):
    """The factors of J = rotation @ stretch: two (M, 3, 3) arrays."""

    rotation: Floats
    stretch: Floats


def polar_decomposition(jacobians: Floats) -> Polar:
    """Polar decomposition of Jacobians (M, 3, 3) into a rotation and a symmetric stretch.

    If det J > 0, the stretch is positive definite; on a folded element, its smallest eigenvalue is negative.

    Examples
    --------
    >>> import numpy as np
    >>> turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    >>> rotation, stretch = polar_decomposition((turn @ np.diag([2.0, 1.0, 0.5]))[None])
    >>> bool(np.allclose(rotation[0], turn)), stretch[0].diagonal().round(12)
    (True, array([2. , 1. , 0.5]))
    """
    rotation = closest_rotations(jacobians)
    stretch = rotation.transpose(0, 2, 1) @ jacobians
    return Polar(rotation, 0.5 * (stretch + stretch.transpose(0, 2, 1)))


def upper_triangle(stretch: Floats) -> Floats:
    """(M, 6) upper triangles xx, xy, xz, yy, yz, zz of symmetric matrices (M, 3, 3): the first six-number form.

    Examples
    --------
    >>> import numpy as np
    >>> upper_triangle(np.array([[[2.0, 0.1, 0.2], [0.1, 1.0, 0.3], [0.2, 0.3, 0.5]]]))
    array([[2. , 0.1, 0.2, 1. , 0.3, 0.5]])
    """
    return stretch[:, _ROWS, _COLUMNS]


def from_upper_triangle(numbers: Floats) -> Floats:
    """(M, 3, 3) symmetric matrices from the first six-number form (M, 6).

    Examples
    --------
    >>> import numpy as np
    >>> from_upper_triangle(np.array([[2.0, 0.1, 0.2, 1.0, 0.3, 0.5]]))
    array([[[2. , 0.1, 0.2],
            [0.1, 1. , 0.3],
            [0.2, 0.3, 0.5]]])
    """
    stretch = np.empty((len(numbers), 3, 3))
    stretch[:, _ROWS, _COLUMNS] = numbers
    stretch[:, _COLUMNS, _ROWS] = numbers
    return stretch


def eigen_form(stretch: Floats) -> Floats:
    """(M, 6) eigenvalues a >= b >= c and Euler angles of the eigenvectors: the second six-number form.

    P = W diag(a, b, c) Wᵀ with the rotation W = Rz(alpha) Ry(beta) Rx(gamma). Angles are in radians, alpha and gamma in
    [-pi, pi], beta in [-pi/2, pi/2]. If det W = -1, its last column is negated, which does not change P.

    Examples
    --------
    >>> import numpy as np
    >>> eigen_form(np.diag([1.0, 2.0, 0.5])[None])[0, :3]
    array([2. , 1. , 0.5])
    """
    values, vectors = np.linalg.eigh(stretch)
    values, vectors = values[:, ::-1], vectors[:, :, ::-1].copy()
    vectors[:, :, 2] *= np.sign(np.linalg.det(vectors))[:, None]
    alpha = np.arctan2(vectors[:, 1, 0], vectors[:, 0, 0])
    beta = np.arctan2(-vectors[:, 2, 0], np.hypot(vectors[:, 0, 0], vectors[:, 1, 0]))
    # Gamma comes from Rz(-alpha) W: near beta = +-pi/2 (gimbal lock) alpha is arbitrary, and gamma compensates for it.
    sine, cosine = np.sin(alpha), np.cos(alpha)
    gamma = np.arctan2(
        sine * vectors[:, 0, 2] - cosine * vectors[:, 1, 2], cosine * vectors[:, 1, 1] - sine * vectors[:, 0, 1]
    )
    return np.column_stack([values, alpha, beta, gamma])


def from_eigen_form(numbers: Floats) -> Floats:
    """(M, 3, 3) symmetric matrices from the second six-number form (M, 6).

    Examples
    --------
    >>> import numpy as np
    >>> from_eigen_form(np.array([[2.0, 1.0, 0.5, 0.0, 0.0, 0.0]]))[0].diagonal()
    array([2. , 1. , 0.5])
    """
    cosine, sine = np.cos(numbers[:, 3:]).T, np.sin(numbers[:, 3:]).T
    (ca, cb, cg), (sa, sb, sg) = cosine, sine
    vectors = np.empty((len(numbers), 3, 3))
    vectors[:, 0] = np.column_stack([ca * cb, ca * sb * sg - sa * cg, ca * sb * cg + sa * sg])
    vectors[:, 1] = np.column_stack([sa * cb, sa * sb * sg + ca * cg, sa * sb * cg - ca * sg])
    vectors[:, 2] = np.column_stack([-sb, cb * sg, cb * cg])
    product = (vectors * numbers[:, None, :3]) @ vectors.transpose(0, 2, 1)
    return np.asarray(0.5 * (product + product.transpose(0, 2, 1)))  # symmetric to the last bit


def conductivity(stretch: Floats) -> Floats:
    """(M, 3, 3) matrices A = det(P) P⁻² of the generalized Laplace equation (Chen & Lui, section 5.2).

    Since P⁻¹ = cof(P) / det(P) for a symmetric P, A = cof(P)² / det(P).

    Raises
    ------
    ReconstructionError
        If a stretch (M, 3, 3) is not positive definite, which means that the element is folded or collapsed.

    Examples
    --------
    >>> import numpy as np
    >>> conductivity(np.diag([2.0, 1.0, 1.0])[None])[0].diagonal()
    array([0.5, 2. , 2. ])
    """
    determinant = determinants(stretch)
    trace = np.einsum("kii->k", stretch)
    cofactor = cofactors(stretch)
    minors = np.einsum("kii->k", cofactor)
    # A symmetric matrix is positive definite exactly if its three invariants are positive.
    bad = np.flatnonzero(~((determinant > 0.0) & (trace > 0.0) & (minors > 0.0)))
    if bad.size:
        raise ReconstructionError(
            f"The stretch of {bad.size} tetrahedra, first number {bad[0]}, is not positive definite; "
            "a map can be rebuilt only from a representation without folds."
        )
    return np.asarray(cofactor @ cofactor / determinant[:, None, None])
