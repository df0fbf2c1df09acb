# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The input of the solver: two keys of one mesh, checked once on the way in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import hypot

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats, Ints
from ..errors import InputError, naming_pair
from ..triangles.topology import sides, welded

# The names of the first and the second key of a pair.
Ends = tuple[str, str]

# Cubes of what lies between, and squares of its areas, still are numbers.
_SMALLEST, LARGEST = 1e-75, 1e75
_MOST_GROWTH = 1e10
# Copies of a vertex differ by this many steps of single precision at the largest coordinate, where several roundings
# add up; but never by more than a part of the size, however far from the origin the mesh is.
_SINGLE_STEP = float(np.finfo(np.float32).eps)
_ROUNDING_STEPS = 8.0
_MOST_ROUNDING = 3e-3
# Where single precision tells positions only this part of a key's size apart, its shape suffers.
_COARSE = 1e-3


@dataclass(frozen=True, eq=False)
class KeyPair:
    """Two shapes of one mesh. Build it with ``KeyPair.checked``, which validates.

    Parameters
    ----------
    key0, key1 : (n, 3) float64
        Vertex positions of the first and the second key, in the object's own units.
    faces : (m, 3) int64
        Triangles (polygons are triangulated before they come here); may be empty.
    edges : (e, 2) int64
        Edges to keep together that belong to no face; may be empty.
    """

    key0: Floats
    key1: Floats
    faces: Ints
    edges: Ints

    @classmethod
    def checked(cls, key0: ArrayLike, key1: ArrayLike, faces: ArrayLike, edges: ArrayLike | None = None) -> KeyPair:
        """Validate the arrays and make a pair of them.

        Raises
        ------
        InputError
            If shapes disagree, a coordinate is not finite, an index is out of range, or there are no vertices.
        """
        first, second = (_positions(key, name) for key, name in ((key0, "first"), (key1, "second")))
        if first.shape != second.shape:
            raise InputError(
                f"The keys have {len(first)} and {len(second)} vertices; both must be shapes of the same mesh."
            )
        if not len(first):
            raise InputError("The mesh has no vertices; there is nothing to move.")
        triangles = _indices(faces, 3, len(first), "faces")
        wires = _indices(np.empty((0, 2)) if edges is None else edges, 2, len(first), "edges")
        return cls(first, second, triangles, wires)

    @cached_property
    def diagonal(self) -> float:
        """Length of the first key's bounding-box diagonal, the unit of relative errors.

        Of the second key where all vertices of the first are in one place; 1 where those of both are.
        """
        lengths = (hypot(*np.ptp(key, axis=0)) for key in (self.key0, self.key1))
        return next((length for length in lengths if length > 0.0), 1.0)

    @cached_property
    def welding(self) -> tuple[Ints, Ints]:
        """One vertex of each group that coincides in both keys (k,), and the group of every vertex (n,).

        Copies of a vertex may differ by a few steps of single precision, in which meshes are stored: at seams whose
        sides were computed apart, or between objects that were joined.
        """
        reach = (_rounding(self.key0), _rounding(self.key1))
        return welded(self.key0, self.key1, reach, np.concatenate([sides(self.faces), self.edges]))

    @cached_property
    def welded_faces(self) -> Ints:
        """(m, 3) the triangles with one vertex of each group at their corners, so that they meet at seams."""
        vertices, group = self.welding
        return np.asarray(vertices[group[self.faces]])

    @cached_property
    def nearly_coincident(self) -> int:
        """How many vertices are taken as one with another although rounding has moved them apart in a key."""
        vertices, group = self.welding
        apart = [(key != key[vertices][group]).any(axis=1) for key in (self.key0, self.key1)]
        return int(np.count_nonzero(apart[0] | apart[1]))

    @cached_property
    def far_away(self) -> str | None:
        """A sentence where a key lies so far from its origin that single precision has lost much of its shape."""
        error = _lost_far_away(self.key0, self.key1)
        return None if error is None else str(error)


def consecutive_pairs(
    shapes: Mapping[str, ArrayLike], faces: ArrayLike, edges: ArrayLike | None, through: Sequence[str]
) -> dict[Ends, KeyPair]:
    """The pair of every two keys that follow each other, by their names; one that comes again is made once.

    Parameters
    ----------
    shapes : dict of (n, 3)
        Shapes of one mesh by name.
    faces, edges : (m, 3), (e, 2)
        See ``KeyPair``.
    through : sequence of str
        Names of the keys from the first to the last.

    Raises
    ------
    InputError
        If two keys that follow each other are one and the same, or cannot be used.
    """
    pairs: dict[Ends, KeyPair] = {}
    for first, second in pairwise(through):
        if first == second and len(through) == 2:
            raise InputError(f"The first and the second key are both {first!r}; choose two different keys.")
        if first == second:
            raise InputError(f"The key {first!r} comes twice in a row; choose different keys one after the other.")
        if (first, second) not in pairs:
            with naming_pair(first, second, through):
                pairs[first, second] = KeyPair.checked(shapes[first], shapes[second], faces, edges)
    return pairs


def _lost_far_away(first: Floats, second: Floats) -> InputError | None:
    """The error to raise where the cause is a far offset in single precision."""
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


def _positions(key: ArrayLike, name: str) -> Floats:
    try:
        given = np.asarray(key)
        positions = np.array(given, dtype=np.float64) if given.dtype.kind in "fiuO" else None
    except (TypeError, ValueError, OverflowError):
        positions = None
    if positions is None:
        raise InputError(f"The {name} key does not hold numbers; positions must be an (n, 3) array of them.")
    if positions.ndim != 2 or positions.shape[1] != 3:
        raise InputError(f"The {name} key has shape {positions.shape}; positions must be an (n, 3) array.")
    bad = np.flatnonzero(~np.isfinite(positions).all(axis=1))
    if bad.size:
        raise InputError(
            f"Vertex {bad[0]} of the {name} key has a coordinate that is not finite "
            f"({bad.size} such vertices); repair the key first."
        )
    return positions


def require_sizes(pair: KeyPair) -> None:
    """Check that what is computed on the way from one key to the other fits into floating point.

    Raises
    ------
    InputError
        If a key is too large, too small, or far larger or smaller than the other.
    """
    sizes = []
    for key, name in ((pair.key0, "first"), (pair.key1, "second")):
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
            f"The second key is {sizes[1] / sizes[0]:.0e} times as large as the first, more than numbers can hold; "
            "bring both keys to like sizes, or choose the mode straight."
        )


def _rounding(key: Floats) -> float:
    """How far apart copies of a vertex may be along an axis."""
    steps = _ROUNDING_STEPS * _SINGLE_STEP * float(np.abs(key).max(initial=0.0))
    return min(steps, _MOST_ROUNDING * float(np.ptp(key, axis=0).max(initial=0.0)))


def _indices(values: ArrayLike, width: int, count: int, name: str) -> Ints:
    try:
        indices = np.array(values)
    except ValueError as error:
        raise InputError(f"{name} has rows of different lengths; it must be an (m, {width}) array.") from error
    if indices.ndim != 2 or indices.shape[1] != width:
        raise InputError(f"{name} has shape {indices.shape}; it must be an (m, {width}) array of vertex indices.")
    if indices.size and indices.dtype.kind not in "iu":
        raise InputError(f"{name} holds {indices.dtype} values; vertex indices must be integers.")
    if indices.size and (indices.min() < 0 or indices.max() >= count):
        raise InputError(f"{name} refers to a vertex outside 0..{count - 1}.")
    return np.ascontiguousarray(indices, dtype=np.int64)
