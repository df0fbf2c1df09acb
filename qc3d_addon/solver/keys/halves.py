# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of which only one half was modeled: QC3D moves the mirrored whole, so that its seam stays closed.

The whole has the vertices of the half first, followed by one copy of all vertices for each plane. Vertices on the plane
are copied too; they coincide with their copies and therefore count as one vertex.
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

# Relative to the size: tolerance for coordinates that should be 0, in single precision.
_ON_PLANE = 1e-6


@dataclass(frozen=True)
class MirrorPlane:
    """A mirror plane; the image of x is x - 2 (normal . x - offset) direction.

    Parameters
    ----------
    normal, direction : tuple of 3 float
        ``normal . direction`` is 1; they are equal without shear.
    offset : float
    reach : float
        A vertex is on the plane if ``normal . x`` differs from the offset by at most this, in all keys.
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
        """(n,) signed distances of points (n, 3) from the plane, along the direction."""
        return np.asarray(points @ np.array(self.normal) - self.offset)

    def raised(self, points: Floats, by: Floats) -> Floats:
        """Points (n, 3) moved along the direction by distances (n,)."""
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
        """This mesh followed by its mirror image, whose triangles are reversed so that normals still point outward."""
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
        The axes, ``none``, or ``auto``: those across which the mesh is open. That is so if a whole loop of boundary
        edges lies on the plane in all shapes and the mesh is on one side of it.
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
    # A flat component that lies on the plane is not half of anything.
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
    """A frame (N, 3) of a whole, with the distances of vertices on a plane from it interpolated between the keys.

    Parameters
    ----------
    time : float
        Time between the keys (N, 3) of the whole, in [0, 1].
    """
    own = len(key0) >> len(planes)
    for number, plane in enumerate(planes):
        members = np.flatnonzero(on_plane(key0, key1, own, number))
        first, second = (plane.heights(key[members]) for key in (key0, key1))
        missing = first + time * (second - first) - plane.heights(frame[members])
        frame[members] = plane.raised(frame[members], missing)
    return frame


def on_plane(key0: Floats, key1: Floats, own: int, number: int) -> Bools:
    """(own,) which vertices of the half are on the plane ``number`` in both keys: those that equal their copies."""
    copies = slice(own << number, (own << number) + own)
    return np.asarray((key0[copies] == key0[:own]).all(axis=1) & (key1[copies] == key1[:own]).all(axis=1))
