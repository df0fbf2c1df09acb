# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Combinations as users ask for them: of meshes that may be only one half, and of keys that may pose one joint.

A half is computed as the mirrored whole, and its seam stays on its plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import get_args

import numpy as np

from ..arrays import Floats, Ints
from ..errors import InputError
from ..keys.halves import MirrorPlane, Whole, mirror_planes
from ..settings import Between, FitOptions, Mirror
from ..support.progress import Steps
from .base import KeysOnBase
from .combine import Combination, checked_weights, combine
from .joint_poses import JointPose

_ACROSS = 1e-3  # of the size: what a half may reach across its plane
_NO_HALF = "The mesh is open on a plane, but both keys together reach across it: it was not taken as one half."


class MirroredShapes:
    """Shapes of a mesh with their mirror images.

    Parameters
    ----------
    shapes : sequence of (n, 3)
    faces, edges, polygons : (m, 3), (e, 2), (m,) int64
        As of a ``KeyPair``.
    planes : sequence of MirrorPlane
        Without any, the shapes are as they are given.

    Attributes
    ----------
    shapes : tuple of (w, 3)
        Shapes of the whole, starting with the mesh's own vertices.
    faces, edges : (m, 3), (e, 2)
        Triangles of the whole, and its edges without a triangle.
    """

    def __init__(
        self, shapes: Sequence[Floats], faces: Ints, edges: Ints, polygons: Ints, planes: Sequence[MirrorPlane]
    ) -> None:
        self._count = len(shapes[0])
        self._seams = [
            (plane, np.all([np.abs(plane.heights(shape)) <= plane.reach for shape in shapes], axis=0))
            for plane in planes
        ]
        whole = Whole(tuple(shapes), faces, edges, polygons)
        for plane in planes:
            whole = whole.mirrored(plane)
        self.shapes, self.faces, self.edges = whole.shapes, whole.faces, whole.edges

    def reaches_across(self, shape: Floats) -> bool:
        """Whether the mesh's own part of a shape (w, 3) of the whole is on both sides of a plane."""
        own = shape[: self._count]
        least = _ACROSS * max(float(np.ptp(own, axis=0).max(initial=0.0)), *(plane.reach for plane, _ in self._seams))
        heights = (plane.heights(own) for plane, _ in self._seams)
        return any(height.min() < -least and height.max() > least for height in heights)

    def own(self, shape: Floats) -> Floats:
        """(n, 3) the mesh's own part of a shape (w, 3) of the whole, with its seam on the planes."""
        half = shape[: self._count]
        for plane, on_plane in self._seams:
            half = plane.raised(half, np.where(on_plane, -plane.heights(half), 0.0))
        return half


def combine_halves(
    keys: KeysOnBase,
    mirror: Mirror,
    weights: Sequence[float] | None = None,
    order: Sequence[int] | None = None,
    options: FitOptions | None = None,
    between: Between = "auto",
) -> Steps[Combination]:
    """``combine`` keys of a mesh that may be only one half.

    Parameters
    ----------
    mirror : Mirror
        The axes to mirror across, or how to find them, see ``mirror_planes``. With ``auto``, a mesh that reaches across
        its plane with all keys on is no half.
    between : Between
        What a key with a weight between 0 and 1 shows: its ``natural`` in-between, for which a map is fitted; or, with
        ``auto``, if the key is the pose of one joint by linear blend skinning, the pose with the joint turned as far.
    keys, weights, order, options
        See ``combine``.

    Raises
    ------
    InputError
        As ``combine``, or if the choice of ``mirror`` or ``between`` is unknown.
    """
    if between not in get_args(Between):
        raise InputError(f"Unknown between {between!r}; choose one of {', '.join(get_args(Between))}.")
    posed = _posed(keys, checked_weights(weights, len(keys.pairs))) if between == "auto" else {}
    made = yield from _combined(keys, mirror, weights, order, options, posed)
    notes = [
        f"Key {number + 1} is the pose of one joint by linear blend skinning; the joint is turned by its weight."
        for number in posed
    ]
    return replace(made, notes=(*notes, *made.notes))


def _posed(keys: KeysOnBase, weights: Sequence[float]) -> dict[int, Floats]:
    """What keys (n, 3) show that are partly on and are the pose of one joint, by their indices."""
    partly = [number for number, value in enumerate(weights) if 0.0 < value < 1.0]
    found = ((number, keys.pairs[number]) for number in partly)
    poses = ((number, JointPose.found(pair.key0, pair.key1, pair.welded_faces)) for number, pair in found)
    return {number: pose.at(weights[number]) for number, pose in poses if pose is not None}


def _combined(
    keys: KeysOnBase,
    mirror: Mirror,
    weights: Sequence[float] | None,
    order: Sequence[int] | None,
    options: FitOptions | None,
    shown: dict[int, Floats],
) -> Steps[Combination]:
    """The combination of keys of a mesh that may be only one half, of which some show the shapes ``shown``."""
    first = keys.pairs[0]
    shapes = [keys.base, *(pair.key1 for pair in keys.pairs)]
    planes = mirror_planes(mirror, {str(number): shape for number, shape in enumerate(shapes)}, first.faces)
    if not planes:
        return (yield from combine(keys, weights, order, options, shown))
    mesh = MirroredShapes([*shapes, *shown.values()], first.faces, first.edges, first.polygons, planes)
    base, *others = mesh.shapes[: len(shapes)]
    whole = dict(zip(shown, mesh.shapes[len(shapes) :], strict=True))
    made = yield from combine(KeysOnBase(base, others, mesh.faces, mesh.edges), weights, order, options, whole)
    if mirror == "auto" and mesh.reaches_across(made.shape):
        alone = yield from combine(keys, weights, order, options, shown)
        return replace(alone, notes=(_NO_HALF, *alone.notes))
    return replace(made, shape=mesh.own(made.shape))
