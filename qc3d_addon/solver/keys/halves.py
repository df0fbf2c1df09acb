# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of which only one half was modeled: the mirrored whole is what moves, and its seam stays shut.

The whole has the vertices of the half first and one copy of all for each plane after them, also of those on the plane:
their copies are where they are, so that they are taken as one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..errors import InputError
from ..settings import Mirror
from ..triangles.topology import open_loops, sides, unique_edges, vertex_components, welded

# Of the size: coordinates that are meant to be 0 are no farther off in single precision.
_ON_PLANE = 1e-6


@dataclass(frozen=True)
class MirrorPlane:
    """A plane and what lies across it: x goes to x - 2 (normal . x - offset) direction.

    Parameters
    ----------
    normal, direction : tuple of 3 float
        ``normal . direction`` is 1; they are equal where nothing is sheared.
    offset : float
    reach : float
        A vertex is on the plane where ``normal . x`` is no farther than this from the offset, in all keys.
    """

    normal: tuple[float, float, float]
    direction: tuple[float, float, float]
    offset: float = 0.0
    reach: float = 0.0

    @classmethod
    def across(cls, axis: int, reach: float = 0.0) -> MirrorPlane:
        """The plane where the coordinate ``axis`` is 0."""
        x, y, z = (float(number == axis) for number in range(3))
        return cls((x, y, z), (x, y, z), 0.0, reach)

    def heights(self, points: Floats) -> Floats:
        """(n,) how far points (n, 3) are above the plane, along the direction."""
        return np.asarray(points @ np.array(self.normal) - self.offset)

    def raised(self, points: Floats, by: Floats) -> Floats:
        """Points (n, 3) moved along the direction by (n,)."""
        return np.asarray(points + by[:, None] * np.array(self.direction))


@dataclass(frozen=True, eq=False)
class Whole:
    """A mesh with its mirror images.

    Parameters
    ----------
    shapes : tuple of (2^p n, 3)
    faces, edges, polygons
        As of a ``KeyPair``.
    """

    shapes: tuple[Floats, ...]
    faces: Ints
    edges: Ints
    polygons: Ints

    def mirrored(self, plane: MirrorPlane) -> Whole:
        """This with its mirror image behind it, whose triangles are turned so that normals go on pointing out."""
        count = len(self.shapes[0])
        heights = [plane.heights(shape) for shape in self.shapes]
        apart = np.any([np.abs(height) > plane.reach for height in heights], axis=0)
        images = (
            plane.raised(shape, np.where(apart, -2.0 * height, 0.0))
            for shape, height in zip(self.shapes, heights, strict=True)
        )
        shapes = tuple(np.concatenate(both) for both in zip(self.shapes, images, strict=True))
        faces = np.concatenate([self.faces, self.faces[:, ::-1] + count])
        edges = np.concatenate([self.edges, self.edges + count])
        polygons = np.unique(self.polygons, return_inverse=True)[1].ravel()
        return Whole(shapes, faces, edges, np.concatenate([polygons, polygons + len(polygons)]))


def mirror_planes(mirror: Mirror, shapes: Mapping[str, Floats], faces: Ints) -> tuple[MirrorPlane, ...]:
    """The planes through the origin across which shapes of a mesh are to be mirrored.

    Parameters
    ----------
    mirror
        The axes, ``none``, or ``auto``: those across which the mesh is open. It is where a whole loop of open edges
        lies on the plane in all shapes, and the mesh on one side of it.
    shapes : dict of (n, 3)
    faces : (m, 3)

    Raises
    ------
    InputError
        If the choice is unknown.
    """
    if mirror not in get_args(Mirror):
        raise InputError(f"Unknown mirror {mirror!r}; choose one of {', '.join(get_args(Mirror))}.")
    if mirror == "none" or not len(faces):
        return ()
    size = max(float(np.ptp(shape, axis=0).max(initial=0.0)) for shape in shapes.values())
    axes = range(3) if mirror == "auto" else ["xyz".index(letter) for letter in mirror]
    planes = [MirrorPlane.across(axis, _ON_PLANE * size) for axis in axes]
    if mirror == "auto":
        planes = [plane for plane in planes if _is_open_across(plane, list(shapes.values()), faces)]
    return tuple(planes)


def _is_open_across(plane: MirrorPlane, shapes: Sequence[Floats], faces: Ints) -> bool:
    heights = np.stack([plane.heights(shape) for shape in shapes])
    low, high = heights.min(axis=1), heights.max(axis=1)
    if not ((low >= -plane.reach).all() or (high <= plane.reach).all()):
        return False
    on_plane = (np.abs(heights) <= plane.reach).all(axis=0)
    if np.count_nonzero(on_plane) < 3:
        return False
    vertices, group = welded(shapes[0], shapes[-1])
    faces = group[faces]
    # A page that lies on the plane is no half of anything.
    labels = vertex_components(unique_edges(sides(faces)), len(vertices))
    lies = np.zeros(len(vertices), dtype=bool)
    for height in heights:
        farthest = np.zeros(len(vertices))
        np.maximum.at(farthest, labels, np.abs(height[vertices]))
        lies |= (farthest <= plane.reach)[labels]
    corners, loop = open_loops(faces)
    inside = np.bincount(loop, weights=(on_plane[vertices] & ~lies)[corners])
    return bool((inside == np.bincount(loop)).any())


def held_on_planes(
    frame: Floats, time: float, key0: Floats, key1: Floats, planes: Sequence[MirrorPlane]
) -> Floats:
    """A frame (N, 3) of a whole whose vertices on a plane stay as near to it as the keys have them.

    Parameters
    ----------
    time : float
        0..1 between the keys (N, 3) of the whole.
    """
    own = len(key0) >> len(planes)
    for number, plane in enumerate(planes):
        members = np.flatnonzero(on_plane(key0, key1, own, number))
        first, second = (plane.heights(key[members]) for key in (key0, key1))
        missing = first + time * (second - first) - plane.heights(frame[members])
        frame[members] = plane.raised(frame[members], missing)
    return frame


def on_plane(key0: Floats, key1: Floats, own: int, number: int) -> Bools:
    """(own,) which vertices of the half are on the plane ``number`` in both keys: there their copies are themselves."""
    copies = slice(own << number, (own << number) + own)
    return np.asarray((key0[copies] == key0[:own]).all(axis=1) & (key1[copies] == key1[:own]).all(axis=1))
