# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How much a map distorts: measures of its Jacobians, and of triangles between two shapes.

With the singular values a >= b >= c of a Jacobian (Chen & Lui, section 3.1): the volume ratio abc, the dilatation a/c,
the outer dilatation a^3 / (abc) and the inner dilatation (abc) / c^3 (Vaisala 1971, *Lectures on n-dimensional
quasiconformal mappings*, section 14). All are 1 where the map is a rotation; dilatations are 1 for every similarity.
"""

from __future__ import annotations

import numpy as np

from .rotations import determinants
from .surface import hat_gradients, planar_jacobians, tangent_bases
from .tetmesh import Floats, Ints

# Triangles whose area is below this part of their squared edges have no directions in floating point.
_FLAT = 1e-14


def singular_values(jacobians: Floats) -> Floats:
    """(m, 3) singular values a >= b >= |c| of Jacobians (m, 3, 3); c < 0 where the map is folded."""
    values = np.linalg.svd(jacobians, compute_uv=False)
    values[:, 2] *= np.where(determinants(jacobians) < 0.0, -1.0, 1.0)
    return np.asarray(values)


def volume_ratio(values: Floats) -> Floats:
    """(m,) abc of singular values (m, 3): volume after the map over volume before; zero or less at folds."""
    return np.asarray(values.prod(axis=1))


def dilatation(values: Floats) -> Floats:
    """(m,) K = a/c of singular values (m, 3): 1 or more, infinite at folds."""
    return _over(values[:, 0], values[:, 2])


def outer_dilatation(values: Floats) -> Floats:
    """(m,) K_O = a^2 / (bc) of singular values (m, 3): 1 or more, infinite at folds; K <= K_O <= K^2."""
    return _over(values[:, 0] ** 2, values[:, 1] * values[:, 2])


def inner_dilatation(values: Floats) -> Floats:
    """(m,) K_I = ab / c^2 of singular values (m, 3): 1 or more, infinite at folds; K <= K_I <= K^2."""
    return _over(values[:, 0] * values[:, 1], values[:, 2] * np.abs(values[:, 2]))


class TriangleStretches:
    """Length ratios of triangles against one shape, whose own measures are taken once.

    Parameters
    ----------
    rest : (n, 3)
        The shape that others are measured against.
    faces : (m, 3)
        The triangles; those without an area in ``rest`` have the ratio NaN.
    """

    def __init__(self, rest: Floats, faces: Ints) -> None:
        edges = rest[faces[:, 1:]] - rest[faces[:, :1]]
        areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
        self._usable = areas > _FLAT * (edges**2).sum(axis=(1, 2))
        self._faces = faces[self._usable]
        self._gradients = hat_gradients(rest, self._faces, tangent_bases(rest, self._faces))

    def of(self, shape: Floats) -> Floats:
        """(m, 2) largest and smallest length ratio of each triangle from the rest shape to ``shape`` (n, 3)."""
        bases = tangent_bases(shape, self._faces)
        planar = planar_jacobians(shape, self._faces, bases, self._gradients)
        # Singular values in closed form: the parts of a 2 x 2 matrix that turn and that reflect.
        turning = np.hypot(planar[:, 0, 0] + planar[:, 1, 1], planar[:, 1, 0] - planar[:, 0, 1])
        reflecting = np.hypot(planar[:, 0, 0] - planar[:, 1, 1], planar[:, 1, 0] + planar[:, 0, 1])
        ratios = np.full((len(self._usable), 2), np.nan)
        ratios[self._usable] = 0.5 * np.stack([turning + reflecting, np.abs(turning - reflecting)], axis=1)
        return ratios


def extreme_stretch(ratios: Floats) -> Floats:
    """(m,) of largest and smallest length ratios (m, 2) the one that is farther from 1, measured in logarithms."""
    largest, smallest = ratios.T
    with np.errstate(divide="ignore"):
        return np.asarray(np.where(np.log(largest) >= -np.log(smallest), largest, smallest))


def _over(numerator: Floats, denominator: Floats) -> Floats:
    """The quotient, infinite where the denominator is not positive."""
    regular = denominator > 0.0
    return np.where(regular, numerator / np.where(regular, denominator, 1.0), np.inf)
