# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Distortion of every frame at every vertex, relative to the first key of the chain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints
from ..fit.fitted_map import FittedMap
from ..keys.keypair import KeyPair
from ..maps.distortion import TriangleStretches, approximate_singular_values, dilatation, extreme_stretch, volume_ratio
from ..support.threads import in_threads
from ..triangles.geometry import edge_lengths
from .report import WorstStretch

_MOST = 1e6  # larger ratios only say that something is flat
_SHORTEST = 1e-6  # of the diagonal; a relative length of shorter edges means little


def measure(
    fitted: Sequence[FittedMap], segments: Ints, frames: Floats, values: Sequence[Floats]
) -> dict[str, NDArray[np.float32]]:
    """Distortion of all frames.

    Parameters
    ----------
    fitted : sequence of FittedMap
        Consecutive pairs of one mesh.
    segments : (k,)
        Number of the pair that each frame belongs to.
    frames : (k, n, 3)
        Positions in the keys' coordinates.
    values : sequence of (N, 3)
        The frames' maps, cube units.

    Returns
    -------
    Measures (k, n) by name, see ``VertexMeasures``.
    """
    vertex_measures = VertexMeasures(fitted)
    measures: dict[str, NDArray[np.float32]] = {}
    moments = zip(segments.tolist(), frames, values, strict=True)
    for index, found in enumerate(in_threads(lambda moment: vertex_measures.of(*moment), moments)):
        for name, at_vertices in found.items():
            measures.setdefault(name, np.empty(frames.shape[:2], dtype=np.float32))[index] = at_vertices
    return measures


def worst_stretch(pairs: Sequence[KeyPair], segments: Ints, frames: Floats) -> WorstStretch:
    """The worst stretch beyond the keys among the frames (k, n, 3) of the pairs ``segments`` (k,)."""
    worst = WorstStretch(0.0, 0, 0)
    for number, pair in enumerate(pairs):
        members = np.flatnonzero(segments == number)
        found = worst_excess(pair, frames[members])
        if found.excess > worst.excess:
            worst = replace(found, frame=int(members[found.frame]))
    return worst


class VertexMeasures:
    """Measures the frames of one or more consecutive pairs.

    ``stretch``
        The length ratio of the surface around the vertex that is farthest from 1; above 1 longer, below 1 shorter.
    ``volume``
        Volume of the space around the vertex over its volume in the first key.
    ``dilatation``
        K = a/c of the map of the space around the vertex, 1 or more.

    Stretch is measured on the triangles. The other two are measured on the map of the volume, whose Jacobians are
    averaged around each vertex, those inside the object before all; Jacobians of consecutive pairs are multiplied.

    Parameters
    ----------
    fitted : sequence of FittedMap
        Consecutive pairs of one mesh.
    """

    def __init__(self, fitted: Sequence[FittedMap]) -> None:
        self._fitted = fitted
        self._count = len(fitted[0].pair.key0)
        faces = fitted[0].pair.faces
        self._triangles = TriangleStretches(fitted[0].pair.key0, faces)
        # Triangles in the order of their corners, and where each vertex that has any begins.
        corners = faces.ravel()
        order = np.argsort(corners, kind="stable")
        self._triangles_around = order // 3
        self._starts = np.flatnonzero(np.diff(corners[order], prepend=-1))
        self._with_triangles = corners[order][self._starts]
        self._before = [np.broadcast_to(np.eye(3), (self._count, 3, 3))]
        for number, part in enumerate(fitted[:-1]):
            whole = part.embedding.motion.rotation @ self._jacobians(number, part.mapped)
            # From the axes of one cube to those of the next, by way of the keys'.
            between = fitted[number + 1].embedding.axes @ part.embedding.axes.T
            self._before.append(between @ whole @ self._before[-1])

    def of(self, number: int, positions: Floats, values: Floats) -> dict[str, Floats]:
        """Measures (n,) by name of a frame of pair ``number``.

        Parameters
        ----------
        positions : (n, 3)
            The frame, in the keys' coordinates.
        values : (N, 3)
            Its map, cube units.
        """
        singular = approximate_singular_values(self._jacobians(number, values) @ self._before[number])
        return {
            "stretch": self._at_vertices(extreme_stretch(self._triangles.of(positions))),
            "volume": np.maximum(volume_ratio(singular), 0.0),
            "dilatation": np.minimum(dilatation(singular), _MOST),
        }

    def _jacobians(self, number: int, values: Floats) -> Floats:
        """(n, 3, 3) Jacobians around the vertices of a map of the cube (N, 3)."""
        volume = self._fitted[number].volume
        landmarks, around = volume.around_landmarks
        jacobians = volume.mesh.jacobians(values).reshape(-1, 9)
        return np.asarray((landmarks @ (around @ jacobians)).reshape(-1, 3, 3))

    def _at_vertices(self, ratios: Floats) -> Floats:
        """(n,) the ratio of the triangles (m,) around each vertex that is farthest from 1; 1 where there are none."""
        logarithms = np.nan_to_num(np.log(np.clip(ratios, 1.0 / _MOST, _MOST)))
        around = logarithms[self._triangles_around]
        farthest = np.zeros(self._count)
        if len(around):
            largest, smallest = (extreme.reduceat(around, self._starts) for extreme in (np.maximum, np.minimum))
            farthest[self._with_triangles] = np.where(largest >= -smallest, largest, smallest)
        return np.asarray(np.exp(farthest))


class EdgeExcess:
    """How far edges leave the interval between their lengths in the two keys of a pair.

    Parameters
    ----------
    pair : KeyPair

    Attributes
    ----------
    edges : (k, 2) int64
        The edges that are measured: those that no key makes a point.
    """

    def __init__(self, pair: KeyPair) -> None:
        # Squares of what is very large or very small are no numbers.
        self._unit = max(pair.diagonal, float(np.ptp(pair.key1, axis=0).max()))
        self.edges = pair.every_edge
        ends = self._lengths(pair.key0), self._lengths(pair.key1)
        shortest, longest = np.minimum(*ends), np.maximum(*ends)
        usable = shortest > _SHORTEST * (pair.diagonal / self._unit)
        self.edges, self._shortest, self._longest = self.edges[usable], shortest[usable], longest[usable]

    def of(self, frame: Floats) -> Floats:
        """(k,) for a frame (n, 3): 0.05 is 5 % longer or shorter than in both keys; negative between them."""
        length = self._lengths(frame)
        return np.asarray(np.maximum(length / self._longest - 1.0, 1.0 - length / self._shortest))

    def _lengths(self, shape: Floats) -> Floats:
        return edge_lengths(shape / self._unit, self.edges)


def worst_excess(pair: KeyPair, frames: Floats) -> WorstStretch:
    """The edge that leaves the interval between its lengths in the two keys farthest, among frames (k, n, 3)."""
    measure = EdgeExcess(pair)
    worst = WorstStretch(0.0, 0, 0)
    for number, frame in enumerate(frames):
        excess = measure.of(frame)
        edge = int(np.argmax(excess)) if len(excess) else 0
        if len(excess) and excess[edge] > worst.excess:
            worst = WorstStretch(float(excess[edge]), number, int(measure.edges[edge, 0]))
    return worst
