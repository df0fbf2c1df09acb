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
    one, two, mixed = (
        np.einsum("c...,c...->...", *pair) for pair in ((first, first), (second, second), (first, second))
    )
    trace = one + two
    # In place from here on: arrays that are made and given up for every product take a third of the time.
    root, part, less = np.empty_like(one), np.empty_like(one), np.empty_like(one)
    # The area comes from the cross product, because one * two - mixed**2 cancels for a triangle flattened by 1e-4. The
    # floor gives even a triangle that degenerates to a line two directions; it is far below any real triangle.
    root[...] = 0.0
    for plus, minus in (((y, w), (z, v)), ((z, u), (x, w)), ((x, v), (y, u))):
        np.multiply(*plus, out=part)
        part -= np.multiply(*minus, out=less)
        root += np.multiply(part, part, out=part)
    np.sqrt(root, out=root)
    np.maximum(root, np.multiply(trace, _THINNEST, out=part), out=root)
    np.add(trace, np.multiply(root, 2.0, out=part), out=part)
    np.sqrt(part, out=part)
    part *= root
    scale = np.divide(lengths, np.maximum(part, 1e-300, out=part), out=part)
    two += root
    two *= scale
    one += root
    one *= scale
    mixed *= scale
    closest = np.empty_like(vectors)
    np.multiply(two, first, out=closest[:, 0])
    np.multiply(one, second, out=closest[:, 1])
    closest[:, 0] -= mixed * second
    closest[:, 1] -= mixed * first
    return closest
