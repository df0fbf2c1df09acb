# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs of tangent vectors of triangles, component-major: rotated, stretched, and the closest orthogonal pairs."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..numerics.rotations import products

_THINNEST = 1e-10  # of the trace: a triangle thinner than this is treated as one of this thickness


def tangents_of(rotations: Floats, tangents: Floats) -> Floats:
    """(3, 2, m) pairs of tangents, given as the columns of (m, 3, 2), after rotations (m, 3, 3); component-major."""
    return products(rotations, tangents).transpose(1, 2, 0)


def stretched(stretch: Floats, vectors: Floats) -> Floats:
    """(3, 2, ...) pairs of vectors (3, 2, ...) multiplied from the right by symmetric stretches (..., 2, 2)."""
    along, mixed, across = stretch[..., 0, 0], stretch[..., 0, 1], stretch[..., 1, 1]
    first, second = vectors[:, 0], vectors[:, 1]
    return np.stack([along * first + mixed * second, mixed * first + across * second], axis=1)


def closest_tangents(vectors: Floats, lengths: Floats | float = 1.0) -> Floats:
    """Orthogonal pairs closest to pairs of vectors: the local step of the sweeps.

    Parameters
    ----------
    vectors : (3, 2, ..., m)
        Pairs of vectors: the two columns of 3 x 2 matrices A, component-major.
    lengths : (m,) or float
        Length of both vectors of each resulting pair.

    Returns
    -------
    (3, 2, ..., m)

    Notes
    -----
    The result is the polar factor A C^(-1/2) with C = AᵀA, times the length. By the Cayley-Hamilton theorem, with
    s = sqrt(det C), C^(1/2) = (C + s I) / sqrt(tr C + 2 s), which has an inverse in closed form.
    """
    first, second = vectors[:, 0], vectors[:, 1]
    (x, y, z), (u, v, w) = first, second
    one, two, mixed = x * x + y * y + z * z, u * u + v * v + w * w, x * u + y * v + z * w
    trace = one + two
    # The area comes from the cross product, because one * two - mixed**2 cancels for a triangle flattened by 1e-4. The
    # floor gives even a triangle that degenerates to a line two directions; it is far below any real triangle.
    root = np.sqrt((y * w - z * v) ** 2 + (z * u - x * w) ** 2 + (x * v - y * u) ** 2)
    np.maximum(root, _THINNEST * trace, out=root)
    scale = lengths / np.maximum(root * np.sqrt(trace + 2.0 * root), 1e-300)
    across = scale * mixed
    closest = np.empty_like(vectors)
    np.subtract((scale * (two + root)) * first, across * second, out=closest[:, 0])
    np.subtract((scale * (one + root)) * second, across * first, out=closest[:, 1])
    return closest
