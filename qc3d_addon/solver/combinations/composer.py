# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Composition of keys: rotations are multiplied, stretches added, and positions solved for.

If one key turns a triangle by R_A and stretches it by P_A, and another by R_B and P_B, both together turn it by R_A R_B
and stretch it by P_A + P_B - I: the second motion happens inside the first one, as with the joints of a limb. The sum
of the two shapes would instead let the second motion happen where it would be without the first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..numerics.rotations import by_component, products, rotation_matrices
from ..surface.path import ANCHOR_WEIGHT, SWEEPS
from ..surface.sweeps import Sweeps, Wanted
from ..surface.system import MovingSurface
from ..surface.tangents import tangents_of
from ..triangles.closed_volume import ClosedComponents
from ..triangles.deformation import TriangleDeformation
from ..triangles.geometry import vertex_areas
from ..triangles.topology import edges_without_triangle
from .averages import Averages
from .base import KeysOnBase
from .volumes import volume_off_range

# Two keys that each squash by more than half must not turn anything inside out together. Where both shrink, the product
# of their stretches is larger than the sum, so that only half of the product is a lower limit.
_LEAST_OF_PRODUCT = 0.5


class Composer:
    """Composes shapes of several keys. Everything that does not depend on their weights is factored once.

    Parameters
    ----------
    keys : KeysOnBase
    """

    def __init__(self, keys: KeysOnBase) -> None:
        self._keys = keys
        self._base = keys.scaled(keys.base)
        self._free = ~keys.still[keys.vertices]
        self._closed = ClosedComponents(keys.faces, keys.labels)
        self._weights = vertex_areas(self._base, keys.faces)
        self._weights /= self._weights.sum()
        self._built: _System | None = None

    def composed(
        self,
        shapes: Sequence[Floats],
        anchor: Floats | None = None,
        places: Bools | None = None,
        strength: float = 1.0,
    ) -> Floats:
        """The composition of all ``shapes``.

        Parameters
        ----------
        shapes : sequence of (n, 3)
            The shape of each key alone, outermost first: the key itself, or an in-between if its weight is below 1.
        anchor : (n, 3), optional
            Anchors of the vertices; by default the ``carried`` shapes.
        places : (k,) bool, optional
            Vertices whose anchor weights are multiplied by ``strength``.
        strength : float

        Returns
        -------
        (n, 3)
            Positions in the keys' own units.
        """
        keys = self._keys
        scaled = [keys.scaled(shape) for shape in shapes]
        system = self._system(self._usable(scaled))
        turned = [TriangleDeformation.between(self._base, shape, system.faces) for shape in scaled]
        anchors = system.carried(self._base, scaled, turned) if anchor is None else keys.scaled(anchor)
        surface = system.surface
        if places is not None:
            surface = surface.with_anchor_weights(self._anchor_weights(turned[0]) * system.stronger(places, strength))
        start = anchors.copy()
        start[~self._free] = (self._base + sum(shape - self._base for shape in scaled))[~self._free]
        rotation = _composed_rotations(turned)
        rows = surface.rows
        wanted = Wanted(
            start,
            tangents_of(by_component(rotation[rows]), by_component(turned[0].bases[rows][:, :, :2])),
            by_component(_stretches(turned)[rows]),
            anchors,
            _lengths(self._base, scaled, system.springs[surface.springs]),
            self._volumes(anchors, scaled),
        )
        return keys.whole(Sweeps(surface, [wanted]).settled(SWEEPS)[0], shapes)

    def carried(self, shapes: Sequence[Floats]) -> Floats:
        """(n, 3) the outermost shape plus the displacements of the inner ``shapes`` (n, 3), carried along by it.

        The displacement of an inner shape is turned by the mean rotation of the outer shape in the region around. So
        neighbors are never turned against each other, and nothing new crosses where rotations differ from triangle to
        triangle, as at the corners of a mouth. But lengths are kept only where a whole region turns alike.
        """
        scaled = [self._keys.scaled(shape) for shape in shapes]
        system = self._system(self._usable(scaled))
        turned = [TriangleDeformation.between(self._base, shape, system.faces) for shape in scaled]
        return self._keys.whole(system.carried(self._base, scaled, turned), shapes)

    def turns(self, shapes: Sequence[Floats]) -> Floats:
        """(n, 3, 3) how all of ``shapes`` (n, 3) together turn the region around each vertex."""
        scaled = [self._keys.scaled(shape) for shape in shapes]
        system = self._system(self._usable(scaled))
        turned = [TriangleDeformation.between(self._base, shape, system.faces) for shape in scaled]
        return np.asarray(system.averages.rotations(_composed_rotations(turned))[self._keys.group])

    def _volumes(self, about: Floats, scaled: Sequence[Floats]) -> Floats:
        """(c,) wanted volumes: those of positions (n, 3) that are about right, within what the keys explain."""
        volumes = self._closed.volumes(about)
        alone = [self._closed.volumes(shape) for shape in scaled]
        return volumes - volume_off_range(volumes, self._closed.volumes(self._base), alone)

    def _usable(self, scaled: Sequence[Floats]) -> Ints:
        """(u, 3) the usable triangles: those that have an area in all shapes."""
        faces = self._keys.faces
        count = np.zeros(len(faces), dtype=np.int64)
        for shape in scaled:
            count[TriangleDeformation.between(self._base, shape, faces).rows] += 1
        return np.asarray(faces[count == len(scaled)])

    def _system(self, faces: Ints) -> _System:
        """The factored system for the usable triangles; the latest one is cached."""
        if self._built is None or not np.array_equal(self._built.faces, faces):
            deformation = TriangleDeformation.between(self._base, self._base, faces)
            springs = edges_without_triangle(self._keys.faces, self._keys.edges, deformation.faces)
            anchors = self._anchor_weights(deformation)
            every = (self._keys.faces, np.ones(len(self._keys.faces)))
            surface = MovingSurface(deformation, springs, self._closed, every, self._free, self._base, anchors)
            self._built = _System(deformation.faces, springs, surface, Averages(deformation, self._base))
        return self._built

    def _anchor_weights(self, deformation: TriangleDeformation) -> Floats:
        area = float(deformation.weights.sum())
        density = area / float((np.ptp(self._base, axis=0) ** 2).sum()) if area > 0.0 else 1.0
        return np.asarray(ANCHOR_WEIGHT * density * self._weights)


@dataclass(frozen=True, eq=False)
class _System:
    """Everything that does not depend on how the usable triangles ``faces`` (u, 3) turn and stretch."""

    faces: Ints
    springs: Ints
    surface: MovingSurface
    averages: Averages

    def carried(self, base: Floats, scaled: Sequence[Floats], turned: Sequence[TriangleDeformation]) -> Floats:
        offsets = scaled[-1] - base
        for shape, deformation in zip(reversed(scaled[:-1]), reversed(turned[:-1]), strict=True):
            around = self.averages.rotations(rotation_matrices(deformation.turns))
            offsets = shape - base + np.einsum("nij,nj->ni", around, offsets)
        return np.asarray(base + offsets)

    def stronger(self, places: Bools, strength: float) -> Floats:
        """(k,) factors on the anchor weights: ``strength`` at the places, fading to 1 around them."""
        return np.asarray(strength ** self.averages.faded(places))


def _composed_rotations(turned: Sequence[TriangleDeformation]) -> Floats:
    """(m, 3, 3) the rotations of all, the first the outermost."""
    rotation = rotation_matrices(turned[0].turns)
    for inner in turned[1:]:
        rotation = products(rotation, rotation_matrices(inner.turns))
    return rotation


def _stretches(turned: Sequence[TriangleDeformation]) -> Floats:
    """(m, 2, 2) the sum of all stretches, with eigenvalues of at least half of the product of the smallest ones."""
    parts = [deformation.stretch for deformation in turned]
    total = sum((part.at(1.0, "linear") - np.eye(2) for part in parts), start=np.eye(2))
    values, vectors = np.linalg.eigh(total)
    least = _LEAST_OF_PRODUCT * np.prod([part.values.min(axis=1) for part in parts], axis=0)
    values = np.maximum(values, least[:, None])
    return products(vectors * values[:, None, :], vectors.transpose(0, 2, 1))


def _lengths(base: Floats, scaled: Sequence[Floats], edges: Ints) -> Floats:
    """(e,) wanted lengths of edges: the base's plus each key's change, but at least half of the product of ratios."""
    lengths = [np.linalg.norm(shape[edges[:, 1]] - shape[edges[:, 0]], axis=1) for shape in (base, *scaled)]
    changes = [length - lengths[0] for length in lengths[1:]]
    with np.errstate(divide="ignore", invalid="ignore"):
        product = lengths[0] * np.prod([length / lengths[0] for length in lengths[1:]], axis=0)
    least = np.where(lengths[0] > 0.0, _LEAST_OF_PRODUCT * product, 0.0)
    return np.asarray(np.maximum(lengths[0] + sum(changes, start=np.zeros_like(lengths[0])), least))
