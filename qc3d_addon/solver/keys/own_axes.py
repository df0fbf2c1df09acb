# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Axes that two keys define together, so that keys moved, turned and scaled alike are one and the same in them."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats

# How unequally vertices count: enough to tell apart the axes of what is symmetric, such as a cube or a ball, too little
# to turn those of anything else.
_UNEQUAL = 0.5


def own_axes(key0: Floats, key1: Floats, weights: Floats) -> Floats:
    """(3, 3) orthonormal rows, right-handed: the principal axes of both keys, the longest first.

    They turn with the keys, and do not change when both are moved or scaled. Symmetric shapes have no principal axes of
    their own, and no shape tells one end of an axis from the other: the numbers of the vertices do.

    Parameters
    ----------
    key0, key1 : (n, 3)
    weights : (n,)
        Positive weights of the vertices.
    """
    random = np.random.default_rng(0)
    shares = weights * random.uniform(1.0 - _UNEQUAL, 1.0 + _UNEQUAL, len(weights))
    shares /= shares.sum()
    # Different ones for the two keys: where one is the other turned over, the ends must not cancel.
    marks = shares * random.uniform(-1.0, 1.0, (2, len(weights)))
    spreads = np.stack([key - shares @ key for key in (key0, key1)])
    size = float(np.abs(spreads).max())
    if not size > 0.0:
        return np.eye(3)
    spreads /= size
    moments = np.einsum("n,kni,knj->ij", shares, spreads, spreads)
    first, second = np.linalg.eigh(moments)[1].T[:0:-1]
    towards = np.einsum("kn,kni->i", marks, spreads)
    first, second = (axis if axis @ towards >= 0.0 else -axis for axis in (first, second))
    return np.stack([first, second, np.cross(first, second)])
