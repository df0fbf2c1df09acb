# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches of 3D rotations: closest rotations, rotation vectors, and small dense matrices.

Many arrays here are component-major: an array of shape (k, ...) whose components are each contiguous in memory, so that
inner loops over all k are contiguous too.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats

_NEWTON_STEPS = 20  # a cap; scaled Newton converges in about ten
_SMALL_ANGLE = 1e-4  # radians; below this the first omitted term of the series, angle^4 / 120, is below rounding
_NO_ANGLE = 1e-12  # radians; below this the axis is lost to rounding
# Cosines of half the angle below this belong to half turns: what a page turns by is never so exact that a change of its
# keys by a millionth of the size may choose its way.
_HALF_TURN = 1e-4
_HALF_TURN_SIDE = np.array([0.83, 0.46, 0.31])  # perpendicular to none of the axes that symmetric shapes turn about


def by_component(matrices: Floats) -> Floats:
    """The same array (k, ...) in component-major storage: all k values of a component are contiguous in memory."""
    return np.asarray(np.moveaxis(np.ascontiguousarray(np.moveaxis(matrices, 0, -1)), -1, 0))


def products(first: Floats, second: Floats) -> Floats:
    """(k, i, l) products of matrices (k, i, j) and (k, j, l); faster than ``@`` for component-major arrays."""
    return np.asarray(np.einsum("kij,kjl->kil", first, second))


def cofactors(matrices: Floats) -> Floats:
    """(..., 3, 3) cofactor matrices of 3x3 matrices: det(A) A⁻ᵀ where A is regular; the gradient of det(A)."""
    result = np.empty_like(matrices)
    for row in range(3):
        one, other = (row + 1) % 3, (row + 2) % 3
        for column in range(3):
            left, right = (column + 1) % 3, (column + 2) % 3
            result[..., row, column] = (
                matrices[..., one, left] * matrices[..., other, right]
                - matrices[..., one, right] * matrices[..., other, left]
            )
    return result


def determinants(matrices: Floats) -> Floats:
    """(...,) determinants of 3x3 matrices, expanded: many times faster than numpy's batched LU."""
    (a, b, c), (d, e, f), (g, h, i) = ([matrices[..., row, column] for column in range(3)] for row in range(3))
    return np.asarray(a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g))


def closest_rotations(matrices: Floats) -> Floats:
    """(k, 3, 3) rotations closest to matrices (k, 3, 3) in the Frobenius norm.

    Matrices that preserve orientation and are far from singular take the scaled Newton iteration for the polar
    decomposition (Higham, "Computing the polar decomposition with applications", 1986). The rest take the singular
    value decomposition, with the smallest singular value negated where the determinant is negative.
    """
    norms = np.sqrt(np.einsum("kij,kij->k", matrices, matrices))
    scaled = matrices / np.where(norms > 0.0, norms, 1.0)[:, None, None]
    regular = determinants(scaled) > 1e-4
    result = np.empty_like(matrices)
    result[~regular] = _closest_rotations_svd(scaled[~regular])
    current = scaled[regular]
    for _ in range(_NEWTON_STEPS):
        inverse = cofactors(current) / determinants(current)[:, None, None]
        scale = np.sqrt(
            np.sqrt(np.einsum("kij,kij->k", inverse, inverse) / np.einsum("kij,kij->k", current, current))
        )[:, None, None]
        following = 0.5 * (scale * current + inverse / scale)
        change = float(np.abs(following - current).max(initial=0.0))
        current = following
        if change < 1e-14:
            break
    result[regular] = current
    return result


def _closest_rotations_svd(matrices: Floats) -> Floats:
    left, _, right = np.linalg.svd(matrices)
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    closest: Floats = left @ right
    return closest


def rotation_vectors(rotations: Floats) -> Floats:
    """(k, 3) rotation vectors, axis times angle in radians, of rotation matrices (k, 3, 3); angles are in [0, pi].

    Of the two vectors of a half turn always the same one is returned, whatever the rounding; its angle may exceed pi by
    2e-4.
    """
    quaternions = _quaternions(rotations)
    vector, scalar = quaternions[:, 1:], quaternions[:, 0]
    sine = np.linalg.norm(vector, axis=1)
    angle = 2.0 * np.arctan2(sine, scalar)
    return np.asarray(vector * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-300), 2.0)[:, None])


def _quaternions(rotations: Floats) -> Floats:
    """(k, 4) unit quaternions with scalar part first and >= 0; stable for every angle (Shepperd 1978).

    Where the scalar part is zero up to rounding, the vector part points toward ``_HALF_TURN_SIDE``.
    """
    diagonal = np.einsum("kii->ki", rotations)
    trace = diagonal.sum(axis=1)
    skew = np.stack(
        [
            rotations[:, 2, 1] - rotations[:, 1, 2],
            rotations[:, 0, 2] - rotations[:, 2, 0],
            rotations[:, 1, 0] - rotations[:, 0, 1],
        ],
        axis=1,
    )
    symmetric = rotations + rotations.transpose(0, 2, 1)
    count = len(rotations)
    # Row b of the table is 4 q_b q: each row is the quaternion up to scale, and the longest is the best conditioned.
    table = np.empty((count, 4, 4))
    table[:, 0, 0] = 1.0 + trace
    table[:, 0, 1:] = table[:, 1:, 0] = skew
    table[:, 1:, 1:] = symmetric
    axes = np.arange(3)
    table[:, 1 + axes, 1 + axes] = 1.0 + 2.0 * diagonal - trace[:, None]
    best = np.argmax(np.einsum("kii->ki", table), axis=1)
    quaternions = table[np.arange(count), best]
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    side = np.where(np.abs(quaternions[:, 0]) < _HALF_TURN, quaternions[:, 1:] @ _HALF_TURN_SIDE, quaternions[:, 0])
    return np.asarray(quaternions * np.where(side < 0.0, -1.0, 1.0)[:, None])


def rotation_matrices(vectors: Floats) -> Floats:
    """(k, 3, 3) rotation matrices exp([q]x) of rotation vectors (k, 3) of any length, in radians.

    Rodrigues' formula. The result is component-major.

    Examples
    --------
    >>> rotation_matrices(np.array([[0.0, 0.0, np.pi / 2]]))[0].round(12) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    x, y, z = np.ascontiguousarray(vectors.T)
    square = x * x + y * y + z * z
    angle = np.sqrt(square)
    small = angle < _SMALL_ANGLE
    safe = np.where(small, 1.0, angle)
    sine = np.where(small, 1.0 - square / 6.0, np.sin(safe) / safe)
    # By the half-angle formula: 1 - cos cancels for small angles.
    cosine = np.where(small, 0.5 - square / 24.0, 2.0 * (np.sin(0.5 * safe) / safe) ** 2)
    matrices = np.empty((3, 3, len(vectors)))
    for axis, along in enumerate((x, y, z)):
        matrices[axis, axis] = 1.0 - cosine * (square - along * along)
    for row, column, product, third in ((0, 1, x * y, -z), (0, 2, x * z, y), (1, 2, y * z, -x)):
        matrices[row, column] = cosine * product + sine * third
        matrices[column, row] = cosine * product - sine * third
    return np.asarray(np.moveaxis(matrices, -1, 0))


def nearest_branch(vectors: Floats, references: Floats) -> Floats:
    """(k, 3) rotation vectors of the same rotations as ``vectors`` (k, 3), each on the branch nearest to its reference.

    A rotation by the angle a about an axis is also the rotation by a + 2 pi m, for every integer m. Where a rotation is
    the identity, its axis is undetermined and that of the reference (k, 3) is used.

    Examples
    --------
    >>> nearest_branch(np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, 7.0]])).round(4)
    array([[0.    , 0.    , 7.2832]])
    """
    angle = np.linalg.norm(vectors, axis=1)
    reference_angle = np.linalg.norm(references, axis=1)
    axis = np.where(
        (angle > _NO_ANGLE)[:, None],
        vectors / np.maximum(angle, 1e-300)[:, None],
        references / np.maximum(reference_angle, 1e-300)[:, None],
    )
    along = np.einsum("ki,ki->k", axis, references)
    turns = np.round((along - angle) / (2.0 * np.pi))
    return np.asarray(vectors + axis * (2.0 * np.pi * turns)[:, None])
