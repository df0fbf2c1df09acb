# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs of tangent vectors of triangles: turned, stretched, and the orthogonal pairs closest to them."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..numerics.rotations import products

# Of the trace: what is thinner than this is a line for a moment.
_THINNEST = 1e-10


def tangents_of(rotations: Floats, tangents: Floats) -> Floats:
    """(3, 2, m) pairs of tangents, the columns of (m, 3, 2), after ``rotations`` (m, 3, 3), by coordinate."""
    return products(rotations, tangents).transpose(1, 2, 0)


def stretched(stretch: Floats, vectors: Floats) -> Floats:
    """(3, 2, ...) pairs of vectors (3, 2, ...), mixed by symmetric stretches (..., 2, 2)."""
    along, mixed, across = stretch[..., 0, 0], stretch[..., 0, 1], stretch[..., 1, 1]
    first, second = vectors[:, 0], vectors[:, 1]
    return np.stack([along * first + mixed * second, mixed * first + across * second], axis=1)


def closest_tangents(vectors: Floats, lengths: Floats | float = 1.0) -> Floats:
    """(3, 2, ..., m) orthogonal pairs of ``lengths`` (m,), in the directions closest to pairs of vectors.

    The directions are the polar factor A (A^T A)^-1/2. The inverse root of the 2 x 2 matrix C = A^T A comes from the
    theorem of Cayley and Hamilton: with s = sqrt(det C), C^1/2 = (C + s I) / sqrt(tr C + 2 s).
    """
    first, second = vectors[:, 0], vectors[:, 1]
    (x, y, z), (u, v, w) = first, second
    one, two, mixed = x * x + y * y + z * z, u * u + v * v + w * w, x * u + y * v + z * w
    trace = one + two
    # From the cross product: one * two - mixed**2 loses a triangle flattened by 1e-4 to rounding. One that is a line
    # for a moment still gets two directions; the floor is far below any real triangle.
    root = np.sqrt((y * w - z * v) ** 2 + (z * u - x * w) ** 2 + (x * v - y * u) ** 2)
    np.maximum(root, _THINNEST * trace, out=root)
    scale = lengths / np.maximum(root * np.sqrt(trace + 2.0 * root), 1e-300)
    across = scale * mixed
    closest = np.empty_like(vectors)
    np.subtract((scale * (two + root)) * first, across * second, out=closest[:, 0])
    np.subtract((scale * (one + root)) * second, across * first, out=closest[:, 1])
    return closest
