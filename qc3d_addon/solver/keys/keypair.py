# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The input of the solver: two keys of one mesh, validated once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import hypot

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats, Ints
from ..errors import InputError, naming_pair
from ..settings import Mirror
from ..triangles.polygons import covering, flat_quads
from ..triangles.topology import sides, unique_edges, welded
from .checks import indices, labels, lost_far_away, positions
from .halves import MirrorPlane, Whole, mirror_planes

# The names of the first and the second key of a pair.
Ends = tuple[str, str]

# Coincident vertices may differ by this many steps of single precision at the largest coordinate, since several
# roundings add up; but never by more than a fraction of the key's size, however far from the origin the mesh is.
_SINGLE_STEP = float(np.finfo(np.float32).eps)
_ROUNDING_STEPS = 8.0
_MOST_ROUNDING = 3e-3
# Of the size: what is less far from its place counts as there, so coincident vertices may differ by twice as much.
_IN_PLACE = 1e-6


@dataclass(frozen=True, eq=False)
class KeyPair:
    """Two keys of one mesh. Build it with ``KeyPair.checked``, which validates the arrays.

    Parameters
    ----------
    key0, key1 : (n, 3) float64
        Vertex positions of the first and the second key, in the object's own units.
    faces : (m, 3) int64
        Triangles; may be empty. Polygons are triangulated by the caller.
    edges : (e, 2) int64
        Edges that belong to no face and keep their length; may be empty.
    polygons : (m,) int64
        Which triangles belong together: those of a quad, or of a polygon of more corners, have the same number.
    planes : tuple of MirrorPlane
        Where the user's mesh is one half only: across which planes it was mirrored. The mesh's own vertices and
        triangles come first, the images after them.

    Examples
    --------
    >>> key0 = [[0, 0, 0], [3, 0, 0], [0, 4, 0]]
    >>> pair = KeyPair.checked(key0, [[0, 0, 0], [3, 0, 0], [0, 0, 4]], [[0, 1, 2]])
    >>> pair.diagonal
    5.0
    """

    key0: Floats
    key1: Floats
    faces: Ints
    edges: Ints
    polygons: Ints
    planes: tuple[MirrorPlane, ...] = ()

    @classmethod
    def checked(
        cls,
        key0: ArrayLike,
        key1: ArrayLike,
        faces: ArrayLike,
        edges: ArrayLike | None = None,
        polygons: ArrayLike | None = None,
    ) -> KeyPair:
        """Validate arrays of any origin and make a pair of them.

        Without ``polygons``, two triangles that make a flat quad in both keys are taken as one.

        Raises
        ------
        InputError
            If shapes disagree, a coordinate is not finite or within a factor of 4 of that, an index is out of range, or
            there are no vertices.
        """
        first, second = (positions(key, name) for key, name in ((key0, "first"), (key1, "second")))
        if first.shape != second.shape:
            raise InputError(
                f"The keys have {len(first)} and {len(second)} vertices; both must be shapes of the same mesh."
            )
        if not len(first):
            raise InputError("The mesh has no vertices; there is nothing to move.")
        triangles = indices(faces, 3, len(first), "faces")
        wires = indices(np.empty((0, 2)) if edges is None else edges, 2, len(first), "edges")
        if polygons is None:
            return cls(first, second, triangles, wires, flat_quads([first, second], triangles))
        return cls(first, second, triangles, wires, labels(polygons, len(triangles)))

    @cached_property
    def own(self) -> KeyPair:
        """The user's own mesh: this pair, or the half that it was mirrored from."""
        if not self.planes:
            return self
        vertices, triangles, wires = (
            slice(len(array) >> len(self.planes)) for array in (self.key0, self.faces, self.edges)
        )
        keys = (self.key0[vertices], self.key1[vertices])
        return KeyPair(*keys, self.faces[triangles], self.edges[wires], self.polygons[triangles])

    def sharing(self, other: KeyPair) -> KeyPair:
        """The same pair, which takes over what another pair of the same first key, faces, edges and polygons knows."""
        found = replace(self)
        vars(found).update(covering=other.covering, every_edge=other.every_edge)
        if other._is_apart:
            every = np.arange(len(self.key0))
            vars(found)["welding"] = (every, every)
        return found

    @cached_property
    def _is_apart(self) -> bool:
        """Whether no vertices coincide in the first key; then none do in both."""
        reach = _rounding(self.key0)
        return len(welded(self.key0, self.key0, (reach, reach))[0]) == len(self.key0)

    @cached_property
    def diagonal(self) -> float:
        """Length of the first key's bounding-box diagonal, the unit of all relative errors.

        If all vertices of the first key coincide, that of the second key; if those of both do, 1.
        """
        lengths = (hypot(*np.ptp(key, axis=0)) for key in (self.key0, self.key1))
        return next((length for length in lengths if length > 0.0), 1.0)

    @cached_property
    def welding(self) -> tuple[Ints, Ints]:
        """Representatives (k,) of the groups of vertices that coincide in both keys, and the group of each vertex (n,).

        Coincident vertices may differ by a few steps of single precision, in which meshes are stored: for example at
        seams whose sides were computed separately, or between objects that were joined.
        """
        reach = (_rounding(self.key0), _rounding(self.key1))
        return welded(self.key0, self.key1, reach, np.concatenate([sides(self.faces), self.edges]))

    @cached_property
    def welded_faces(self) -> Ints:
        """(m, 3) the triangles with each vertex replaced by its group's representative, so that they join at seams."""
        vertices, group = self.welding
        return np.asarray(vertices[group[self.faces]])

    @cached_property
    def every_edge(self) -> Ints:
        """(k, 2) the sides of all triangles and the other edges, each once, smaller vertex first."""
        return unique_edges(np.concatenate([sides(self.faces), self.edges]))

    @cached_property
    def covering(self) -> tuple[Ints, Floats]:
        """Triangles (k, 3) that cover each polygon evenly, and what each counts (k,); see ``triangles.polygons``."""
        return covering(self.faces, self.polygons)

    @cached_property
    def nearly_coincident(self) -> int:
        """Number of vertices that are grouped with another although rounding separates them in a key."""
        vertices, group = self.welding
        apart = [(key != key[vertices][group]).any(axis=1) for key in (self.key0, self.key1)]
        return int(np.count_nonzero(apart[0] | apart[1]))

    @cached_property
    def far_away(self) -> str | None:
        """A sentence for the user if a key lies so far from its origin that single precision damaged its shape."""
        error = lost_far_away(self.key0, self.key1)
        return None if error is None else str(error)


def consecutive_pairs(
    shapes: Mapping[str, ArrayLike],
    faces: ArrayLike,
    edges: ArrayLike | None,
    through: Sequence[str],
    polygons: ArrayLike | None = None,
    mirror: Mirror | Sequence[MirrorPlane] = "none",
) -> dict[Ends, KeyPair]:
    """The pairs of consecutive keys of a chain, by the names of their ends; a repeated pair is made once.

    Parameters
    ----------
    shapes : mapping of str to (n, 3)
        Shapes of one mesh by name.
    faces : (m, 3) int64
        Triangles.
    edges : (e, 2) int64, optional
        Edges that belong to no face.
    through : sequence of str
        Names of the keys from the first to the last.
    polygons : (m,), optional
        The polygon of each triangle; without it, two triangles that make a flat quad in all keys are one.
    mirror
        The planes across which the mesh is mirrored, or how to find them, see ``mirror_planes``: the pairs are then of
        the mirrored whole.

    Raises
    ------
    InputError
        If two consecutive keys are the same one, or if keys cannot be used.
    """
    pairs: dict[Ends, KeyPair] = {}
    for first, second in pairwise(through):
        if first == second and len(through) == 2:
            raise InputError(f"The first and the second key are both {first!r}; choose two different keys.")
        if first == second:
            raise InputError(f"The key {first!r} comes twice in a row; choose different keys one after the other.")
        if (first, second) not in pairs:
            with naming_pair(first, second, through):
                pairs[first, second] = KeyPair.checked(shapes[first], shapes[second], faces, edges, polygons)
    if polygons is None and len(pairs) > 1:
        # What is one face must be the same on both sides of a key.
        every = [pair.key0 for pair in pairs.values()] + [pair.key1 for pair in pairs.values()]
        quads = flat_quads(every, next(iter(pairs.values())).faces)
        pairs = {ends: replace(pair, polygons=quads) for ends, pair in pairs.items()}
    return _mirrored(pairs, mirror)


def _mirrored(pairs: dict[Ends, KeyPair], mirror: Mirror | Sequence[MirrorPlane]) -> dict[Ends, KeyPair]:
    keys = {name: key for ends, pair in pairs.items() for name, key in zip(ends, (pair.key0, pair.key1), strict=True)}
    half = next(iter(pairs.values()))
    planes = mirror_planes(mirror, keys, half.faces) if isinstance(mirror, str) else tuple(mirror)
    if not planes:
        return pairs
    whole = Whole(tuple(keys.values()), half.faces, half.edges, half.polygons)
    for plane in planes:
        whole = whole.mirrored(plane)
    shapes = dict(zip(keys, whole.shapes, strict=True))
    mesh = (whole.faces, whole.edges, whole.polygons, planes)
    return {(first, second): KeyPair(shapes[first], shapes[second], *mesh) for first, second in pairs}


def _rounding(key: Floats) -> float:
    """How far apart coincident vertices of a key may be along an axis."""
    steps = _ROUNDING_STEPS * _SINGLE_STEP * float(np.abs(key).max(initial=0.0))
    size = float(np.ptp(key, axis=0).max(initial=0.0))
    return max(min(steps, _MOST_ROUNDING * size), 2.5 * _IN_PLACE * size)
