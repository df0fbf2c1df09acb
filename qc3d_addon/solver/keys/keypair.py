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
from .halves import MirrorPlane, Whole, mirror_planes

# The names of the first and the second key of a pair.
Ends = tuple[str, str]

# Between these sizes, cubes of lengths and squares of areas stay within the range of double precision.
_SMALLEST, LARGEST = 1e-75, 1e75
_FARTHEST = 0.25 * float(np.finfo(np.float64).max)  # so that twice the size of a key is still a number
_MOST_GROWTH = 1e10  # of the sizes of two keys: beyond it their common scale leaves the smaller one too few digits
# Coincident vertices may differ by this many steps of single precision at the largest coordinate, since several
# roundings add up; but never by more than a fraction of the key's size, however far from the origin the mesh is.
_SINGLE_STEP = float(np.finfo(np.float32).eps)
_ROUNDING_STEPS = 8.0
_MOST_ROUNDING = 3e-3
# Of the size: what is less far from its place counts as there, so coincident vertices may differ by twice as much.
_IN_PLACE = 1e-6
# If a step of single precision exceeds this fraction of a key's size, its shape is visibly damaged.
_COARSE = 1e-3


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
        first, second = (_positions(key, name) for key, name in ((key0, "first"), (key1, "second")))
        if first.shape != second.shape:
            raise InputError(
                f"The keys have {len(first)} and {len(second)} vertices; both must be shapes of the same mesh."
            )
        if not len(first):
            raise InputError("The mesh has no vertices; there is nothing to move.")
        triangles = _indices(faces, 3, len(first), "faces")
        wires = _indices(np.empty((0, 2)) if edges is None else edges, 2, len(first), "edges")
        if polygons is None:
            return cls(first, second, triangles, wires, flat_quads([first, second], triangles))
        return cls(first, second, triangles, wires, _labels(polygons, len(triangles)))

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
        error = _lost_far_away(self.key0, self.key1)
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


def _lost_far_away(first: Floats, second: Floats) -> InputError | None:
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
    largest = float(np.abs(positions).max(initial=0.0))
    if largest > _FARTHEST:
        raise InputError(
            f"The {name} key has coordinates up to {largest:.0e}, whose differences are no numbers; repair the key "
            "first."
        )
    return positions


def require_sizes(pair: KeyPair) -> None:
    """Check that the computation from one key to the other stays within the range of floating point.

    Raises
    ------
    InputError
        If a key is too large or too small, or the keys' sizes differ by more than a factor of 1e10.
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
            f"The second key is {sizes[1] / sizes[0]:.0e} times as large as the first, too much for "
            "floating point; bring both keys to similar sizes, or choose the mode straight."
        )


def _rounding(key: Floats) -> float:
    """How far apart coincident vertices of a key may be along an axis."""
    steps = _ROUNDING_STEPS * _SINGLE_STEP * float(np.abs(key).max(initial=0.0))
    size = float(np.ptp(key, axis=0).max(initial=0.0))
    return max(min(steps, _MOST_ROUNDING * size), 2.5 * _IN_PLACE * size)


def _labels(values: ArrayLike, count: int) -> Ints:
    labels = np.asarray(values)
    if labels.shape != (count,) or (count and labels.dtype.kind not in "iu"):
        raise InputError(
            f"polygons has shape {labels.shape} and holds {labels.dtype} values; it must be a list of {count} whole "
            "numbers, for each triangle that of its polygon."
        )
    return np.ascontiguousarray(labels, dtype=np.int64)


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
