# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of the arrays that a user gives: numbers that can be computed with, and indices of vertices that exist.

All raise ``InputError``, with a sentence that says what is wrong and what to do.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats, Ints
from ..errors import InputError

# Between these sizes, cubes of lengths and squares of areas stay within the range of double precision.
_SMALLEST, LARGEST = 1e-75, 1e75
_FARTHEST = 0.25 * float(np.finfo(np.float64).max)  # so that twice the size of a key is still a number
_MOST_GROWTH = 1e10  # of the sizes of two keys: beyond it their common scale leaves the smaller one too few digits
# If a step of single precision exceeds this fraction of a key's size, its shape is visibly damaged.
_COARSE = 1e-3


def positions(key: ArrayLike, name: str) -> Floats:
    """(n, 3) float64, finite and not too large; ``name`` tells in messages which key they are."""
    try:
        given = np.asarray(key)
        found = np.array(given, dtype=np.float64) if given.dtype.kind in "fiuO" else None
    except (TypeError, ValueError, OverflowError):
        found = None
    if found is None:
        raise InputError(f"The {name} key does not hold numbers; positions must be an (n, 3) array of them.")
    if found.ndim != 2 or found.shape[1] != 3:
        raise InputError(f"The {name} key has shape {found.shape}; positions must be an (n, 3) array.")
    bad = np.flatnonzero(~np.isfinite(found).all(axis=1))
    if bad.size:
        raise InputError(
            f"Vertex {bad[0]} of the {name} key has a coordinate that is not finite "
            f"({bad.size} such vertices); repair the key first."
        )
    largest = float(np.abs(found).max(initial=0.0))
    if largest > _FARTHEST:
        raise InputError(
            f"The {name} key has coordinates up to {largest:.0e}, whose differences are no numbers; repair the key "
            "first."
        )
    return found


def indices(values: ArrayLike, width: int, count: int, name: str) -> Ints:
    """(m, width) int64, each in 0..count - 1."""
    try:
        found = np.array(values)
    except ValueError as error:
        raise InputError(f"{name} has rows of different lengths; it must be an (m, {width}) array.") from error
    if found.ndim != 2 or found.shape[1] != width:
        raise InputError(f"{name} has shape {found.shape}; it must be an (m, {width}) array of vertex indices.")
    if found.size and found.dtype.kind not in "iu":
        raise InputError(f"{name} holds {found.dtype} values; vertex indices must be integers.")
    if found.size and (found.min() < 0 or found.max() >= count):
        raise InputError(f"{name} refers to a vertex outside 0..{count - 1}.")
    return np.ascontiguousarray(found, dtype=np.int64)


def labels(values: ArrayLike, count: int) -> Ints:
    """(count,) int64, which triangles belong together."""
    found = np.asarray(values)
    if found.shape != (count,) or (count and found.dtype.kind not in "iu"):
        raise InputError(
            f"polygons has shape {found.shape} and holds {found.dtype} values; it must be a list of {count} whole "
            "numbers, for each triangle that of its polygon."
        )
    return np.ascontiguousarray(found, dtype=np.int64)


def require_sizes(key0: Floats, key1: Floats) -> None:
    """Check that the computation from one key to the other stays within the range of floating point.

    Raises
    ------
    InputError
        If a key is too large or too small, or the keys' sizes differ by more than a factor of 1e10.
    """
    sizes = []
    for key, name in ((key0, "first"), (key1, "second")):
        largest = float(np.abs(key).max())
        if largest > LARGEST:
            raise InputError(
                f"The {name} key has coordinates up to {largest:.0e}; scale the mesh to below {LARGEST:.0e}, or choose "
                "the mode straight."
            )
        sizes.append(float(np.ptp(key, axis=0).max()))
        if 0.0 < sizes[-1] < _SMALLEST:
            raise InputError(
                f"The {name} key is only {sizes[-1]:.0e} in size; scale the mesh to above {_SMALLEST:.0e}, or choose "
                "the mode straight."
            )
    if min(sizes) > 0.0 and not 1.0 / _MOST_GROWTH <= sizes[1] / sizes[0] <= _MOST_GROWTH:
        raise InputError(
            f"The second key is {sizes[1] / sizes[0]:.0e} times as large as the first, too much for "
            "floating point; bring both keys to similar sizes, or choose the mode straight."
        )


def lost_far_away(first: Floats, second: Floats) -> InputError | None:
    """The error that says that a key is too far from its origin for single precision; None if none is."""
    size = max(float(np.ptp(key, axis=0).max()) for key in (first, second))
    for key, name in ((first, "first"), (second, "second")):
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            single = key.astype(np.float32)
            step = float(np.spacing(np.abs(single).max()))
        if step > _COARSE * size > 0.0 and (single == key).all():
            return InputError(
                f"The {name} key lies so far from its origin, at {np.abs(key).max():.1e}, that single precision tells "
                f"positions only {step:.1g} apart there, {step / size:.1%} of its size, and has lost much of its "
                "shape; model it near the origin and move the object instead."
            )
    return None
