# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Gradient-domain interpolation, shared by both classical methods.

Each element's gradient is split and interpolated; the shape whose gradients are closest to the result in the
least-squares sense solves a Poisson equation, whose matrix is the same for all frames.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import SuperLU, splu
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def rotations_nearest(matrices: Floats) -> Floats:
    """The rotation (m, 3, 3) closest to each matrix; for a reflection, the smallest singular value is negated."""
    left, _, right = np.linalg.svd(matrices)
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    return np.asarray(left @ right)


@dataclass(frozen=True)
class RigidMotion:
    """The rigid motion that carries the first key closest to the second (Kabsch 1976)."""

    rotation: Rotation
    center0: Floats
    center1: Floats

    @classmethod
    def between(cls, key0: Floats, key1: Floats) -> RigidMotion:
        """The best motion by least squares over the vertices."""
        center0, center1 = key0.mean(axis=0), key1.mean(axis=0)
        covariance = (key1 - center1).T @ (key0 - center0)
        return cls(Rotation.from_matrix(rotations_nearest(covariance[None])[0]), center0, center1)

    def undo(self, key1: Floats) -> Floats:
        """The second key moved by the inverse of the motion."""
        return np.asarray(self.rotation.inv().apply(key1 - self.center1) + self.center0)

    def apply(self, shape: Floats, time: float) -> Floats:
        """Move a shape by the fraction ``time`` of the motion: a fraction of the angle, and the center in a line."""
        part = Rotation.from_rotvec(time * self.rotation.as_rotvec())
        center = (1.0 - time) * self.center0 + time * self.center1
        return np.asarray(part.apply(shape - self.center0) + center)


class GradientPath:
    """Interpolates gradients J (m, 3, 3) from the identity: exp(t log R) ((1 - t) I + t S) with J = R S."""

    def __init__(self, gradients: Floats) -> None:
        rotations = rotations_nearest(gradients)
        self.stretches = rotations.transpose(0, 2, 1) @ gradients
        self.rotation_vectors = Rotation.from_matrix(rotations).as_rotvec()

    def at(self, time: float) -> Floats:
        """Gradients (m, 3, 3) at the time."""
        turned = Rotation.from_rotvec(time * self.rotation_vectors).as_matrix()
        return np.asarray(turned @ ((1.0 - time) * np.eye(3) + time * self.stretches))


@dataclass(frozen=True)
class LeastSquares:
    """Shapes from prescribed gradients: minimizes the sum over elements of weight |gradient - prescribed|².

    Parameters
    ----------
    count
        Number of points.
    elements : (m, k)
        Corners of the elements (3 of a triangle, 4 of a tetrahedron).
    hat_gradients : (m, k, 3)
        Constant gradient of each corner's hat function.
    weights : (m,)
        Area or volume of each element.
    """

    count: int
    elements: Ints
    hat_gradients: Floats
    weights: Floats

    @cached_property
    def matrix(self) -> csc_array:
        """The stiffness matrix (count, count)."""
        corners = self.elements.shape[1]
        local = np.einsum("m,mad,mbd->mab", self.weights, self.hat_gradients, self.hat_gradients)
        rows = np.repeat(self.elements, corners, axis=1).ravel()
        columns = np.tile(self.elements, (1, corners)).ravel()
        return csc_array(coo_array((local.ravel(), (rows, columns)), shape=(self.count, self.count)))

    @cached_property
    def components(self) -> Ints:
        """Component (count,) of each point; points without an element are components of their own."""
        first = np.repeat(self.elements[:, :1], self.elements.shape[1] - 1, axis=1).ravel()
        others = self.elements[:, 1:].ravel()
        graph = coo_array((np.ones(len(first)), (first, others)), shape=(self.count, self.count))
        return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)

    def divergence(self, gradients: Floats) -> Floats:
        """Right-hand side (count, 3) of prescribed gradients (m, 3, 3)."""
        local = np.einsum("m,mij,maj->mai", self.weights, gradients, self.hat_gradients)
        flat = self.elements.ravel()
        return np.stack([np.bincount(flat, local[:, :, i].ravel(), self.count) for i in range(3)], axis=1)

    def gradients(self, positions: Floats) -> Floats:
        """Gradients (m, 3, 3) of a shape (count, 3)."""
        return np.asarray(np.einsum("mai,maj->mij", positions[self.elements], self.hat_gradients))

    @cached_property
    def _free(self) -> Ints:
        anchors = np.unique(self.components, return_index=True)[1]
        return np.setdiff1d(np.arange(self.count), anchors)

    @cached_property
    def _factor(self) -> SuperLU:
        return factorized(self.matrix[self._free][:, self._free])

    def shape(self, gradients: Floats, centers_like: Floats) -> Floats:
        """Points (count, 3) with gradients closest to those given, each component centered as in another shape.

        The equations leave the translation of every component undetermined, so one point of each is fixed while
        solving.
        """
        solution = np.zeros((self.count, 3))
        solution[self._free] = self._factor.solve(self.divergence(gradients)[self._free])
        sizes = np.bincount(self.components)[:, None]
        missing = centers_like - solution
        shift = np.stack([np.bincount(self.components, missing[:, i]) for i in range(3)], axis=1) / sizes
        return np.asarray(solution + shift[self.components])


def factorized(matrix: csc_array) -> SuperLU:
    """Factor a symmetric positive definite matrix."""
    return splu(csc_array(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
