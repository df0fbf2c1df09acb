# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Distortion: measures of a map's Jacobians, and of triangles between two shapes.

From the singular values a >= b >= c of a Jacobian (Chen & Lui, section 5.1): the volume ratio abc, the dilatation a/c,
the outer dilatation a³ / (abc) and the inner dilatation (abc) / c³ (Väisälä 1971, *Lectures on n-dimensional
quasiconformal mappings*, section 14). All are 1 for a rotation; the dilatations are 1 for any similarity.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..numerics.assembly import gradient_operator
from ..numerics.rotations import determinants
from ..triangles.geometry import areas, cross_product, hat_gradients, tangent_bases

# Of the squared edges: a triangle with a smaller area has no usable directions in floating point.
_FLAT = 1e-14


def singular_values(jacobians: Floats) -> Floats:
    """(m, 3) singular values a >= b >= |c| of Jacobians (m, 3, 3); c < 0 where the map is folded.

    Examples
    --------
    >>> import numpy as np
    >>> singular_values(np.diag([0.5, 3.0, 2.0])[None])
    array([[3. , 2. , 0.5]])
    >>> singular_values(np.diag([1.0, 1.0, -1.0])[None])  # a mirror image is folded
    array([[ 1.,  1., -1.]])
    """
    values = np.linalg.svd(jacobians, compute_uv=False)
    values[:, 2] *= np.where(determinants(jacobians) < 0.0, -1.0, 1.0)
    return np.asarray(values)


def approximate_singular_values(jacobians: Floats) -> Floats:
    """As ``singular_values``, to about 1e-8 of the largest, but several times faster.

    The eigenvalues of JᵀJ in closed form (Smith 1961, "Eigenvalues of a symmetric 3 x 3 matrix"); the smallest follows
    from the determinant.

    Examples
    --------
    >>> import numpy as np
    >>> approximate_singular_values(np.diag([0.5, 3.0, 2.0])[None]).round(6)
    array([[3. , 2. , 0.5]])
    """
    metric = jacobians.transpose(0, 2, 1) @ jacobians
    mean = np.einsum("kii->k", metric) / 3.0
    deviation = metric - mean[:, None, None] * np.eye(3)
    spread = np.sqrt(np.einsum("kij,kij->k", deviation, deviation) / 6.0)
    cosine = determinants(deviation) / np.maximum(2.0 * spread**3, 1e-300)
    angle = np.arccos(np.clip(cosine, -1.0, 1.0)) / 3.0
    largest = mean + 2.0 * spread * np.cos(angle)
    smallest = mean + 2.0 * spread * np.cos(angle + 2.0 / 3.0 * np.pi)
    values = np.sqrt(np.maximum(np.stack([largest, 3.0 * mean - largest - smallest, smallest], axis=1), 0.0))
    values[:, 2] = determinants(jacobians) / np.maximum(values[:, 0] * values[:, 1], 1e-300)
    return np.asarray(values)


def volume_ratio(values: Floats) -> Floats:
    """(m,) abc for singular values (m, 3): volume after the map over volume before; zero or negative at folds.

    Examples
    --------
    >>> import numpy as np
    >>> volume_ratio(np.array([[3.0, 2.0, 0.5]]))
    array([3.])
    """
    return np.asarray(values.prod(axis=1))


def dilatation(values: Floats) -> Floats:
    """(m,) K = a/c for singular values (m, 3): at least 1, infinite at folds.

    Examples
    --------
    >>> import numpy as np
    >>> dilatation(np.array([[3.0, 2.0, 0.5], [2.0, 2.0, 2.0], [1.0, 1.0, 0.0]]))
    array([ 6.,  1., inf])
    """
    return _over(values[:, 0], values[:, 2])


def outer_dilatation(values: Floats) -> Floats:
    """(m,) K_O = a² / (bc) for singular values (m, 3): at least 1, infinite at folds; K <= K_O <= K².

    Examples
    --------
    >>> import numpy as np
    >>> outer_dilatation(np.array([[3.0, 2.0, 0.5]]))
    array([9.])
    """
    return _over(values[:, 0] ** 2, values[:, 1] * values[:, 2])


def inner_dilatation(values: Floats) -> Floats:
    """(m,) K_I = ab / c² for singular values (m, 3): at least 1, infinite at folds; K <= K_I <= K².

    Examples
    --------
    >>> import numpy as np
    >>> inner_dilatation(np.array([[3.0, 2.0, 0.5]]))
    array([24.])
    """
    return _over(values[:, 0] * values[:, 1], values[:, 2] * np.abs(values[:, 2]))


class TriangleStretches:
    """Principal stretches of triangles relative to a rest shape, which is processed once.

    Parameters
    ----------
    rest : (n, 3)
        The shape that other shapes are compared with.
    faces : (m, 3) int64
        Triangles; the ratios of those without an area in ``rest`` are NaN.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    >>> TriangleStretches(corners, np.array([[0, 1, 2]])).of(corners * [2.0, 0.5, 1.0])
    array([[2. , 0.5]])
    """

    def __init__(self, rest: Floats, faces: Ints) -> None:
        edges = rest[faces[:, 1:]] - rest[faces[:, :1]]
        self._usable = 2.0 * areas(rest, faces) > _FLAT * (edges**2).sum(axis=(1, 2))
        faces = faces[self._usable]
        self._gradient = gradient_operator(faces, hat_gradients(rest, faces, tangent_bases(rest, faces)), len(rest))

    def of(self, shape: Floats) -> Floats:
        """(m, 2) largest and smallest length ratio of each triangle from the rest shape to ``shape`` (n, 3)."""
        first, second = np.stack([self._gradient @ row for row in shape.T]).reshape(3, 2, -1).transpose(1, 0, 2)
        # In the basis of the first image and the direction perpendicular to it, the two images are (length, 0) and
        # (along, across).
        length = np.maximum(np.sqrt((first**2).sum(axis=0)), 1e-300)
        along = (first * second).sum(axis=0) / length
        across = np.sqrt((cross_product(first, second) ** 2).sum(axis=0)) / length
        # Singular values of a 2 x 2 matrix in closed form, from its rotation part and its reflection part.
        turning, reflecting = np.hypot(length + across, along), np.hypot(length - across, along)
        ratios = np.full((len(self._usable), 2), np.nan)
        ratios[self._usable] = 0.5 * np.stack([turning + reflecting, np.abs(turning - reflecting)], axis=1)
        return ratios


def extreme_stretch(ratios: Floats) -> Floats:
    """(m,) of each pair of largest and smallest length ratio (m, 2), the one farther from 1 on a logarithmic scale.

    Examples
    --------
    >>> import numpy as np
    >>> extreme_stretch(np.array([[2.0, 0.9], [1.1, 0.5]]))
    array([2. , 0.5])
    """
    largest, smallest = ratios.T
    with np.errstate(divide="ignore"):
        return np.asarray(np.where(np.log(largest) >= -np.log(smallest), largest, smallest))


def _over(numerator: Floats, denominator: Floats) -> Floats:
    """The quotient; infinite where the denominator is not positive."""
    regular = denominator > 0.0
    return np.where(regular, numerator / np.where(regular, denominator, 1.0), np.inf)
