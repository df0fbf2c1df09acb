# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotations to positions, positions to rotations: a few shapes of one surface, over and over until they have settled.

Arrays of vertices and triangles are stored by coordinate and shape, (3, q, n), so that every operation runs along
memory, and over all shapes at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_array, csr_array

from ..arrays import Floats
from ..numerics.chebyshev import ChebyshevIteration
from .system import MovingSurface
from .tangents import closest_tangents, stretched

# Fixed weights: shapes have not settled fully, and what adaptive weights make of them jumps from one time to the next.
_RADIUS = 0.95
_RELAXATION = 1.3
_SETTLED = 1e-10  # cube units
_LARGEST_VOLUME_STEP = 0.1
_LAST_VOLUME_STEPS = 12
_VOLUME_TOLERANCE = 1e-12
# Arrays of so many triangles, a dozen at a time, fit into the cache of one core.
_TRIANGLES_IN_CACHE = 30_000


@dataclass(frozen=True, eq=False)
class Wanted:
    """What a surface should look like at one time.

    Parameters
    ----------
    start : (n, 3)
        Positions to start at; vertices that rest stay there.
    tangents : (3, 2, m)
        Of the moving triangles, for the first fit.
    stretch : (m, 2, 2)
        Of the moving triangles.
    anchors : (n, 3)
        Where vertices are drawn to.
    lengths : (s,)
        Of the moving springs.
    volumes : (components,)
        Zero where a component is not closed.
    """

    start: Floats
    tangents: Floats
    stretch: Floats
    anchors: Floats
    lengths: Floats
    volumes: Floats


class _Operator(NamedTuple):
    """The gradient operator of a few shapes, multiplied by their stretches.

    ``gradient`` takes a coordinate of all used vertices, shape by shape, to its derivatives, by shape, direction and
    triangle; ``spread`` is its transpose.
    """

    shapes: slice
    gradient: csr_array
    spread: csc_array

    @classmethod
    def of(cls, surface: MovingSurface, shapes: slice, stretch: Floats) -> _Operator:
        """Of a surface and the stretches (q, m, 2, 2) of the shapes."""
        # One by one: sums of products over several shapes would be rounded by how many there are.
        values = np.stack([np.einsum("mcb,mbd->dcm", surface.hats, part).transpose(0, 2, 1) for part in stretch])
        # The pattern is that of one shape, again and again.
        one = surface.gradient
        columns = one.indices + np.arange(len(stretch), dtype=one.indices.dtype)[:, None] * one.shape[1]
        starts = np.arange(0, values.size + 1, 3, dtype=one.indices.dtype)
        shape = (len(stretch) * one.shape[0], len(stretch) * one.shape[1])
        gradient = csr_array((values.ravel(), columns.ravel(), starts), shape=shape)
        return cls(shapes, gradient, gradient.T)


class Sweeps:
    """The sweeps of a few shapes, q in number; the result of each is that of its own sweeps.

    Parameters
    ----------
    surface : MovingSurface
    wanted : sequence of Wanted
    holds_volumes : bool
        Whether closed components get the volumes that are wanted.

    Attributes
    ----------
    corrected : (q,)
        For each shape the largest part of a wanted volume that is missing half-way, before volumes are looked at.
    """

    def __init__(self, surface: MovingSurface, wanted: Sequence[Wanted], holds_volumes: bool = True) -> None:
        self._surface = surface
        self._holds_volumes = holds_volumes and not surface.volumes.empty
        self.corrected = np.zeros(len(wanted))
        self._wanted = wanted
        self._moving = slice(0, len(surface.moving))
        # The moving vertices, then those beside them.
        self._positions = np.stack([shape.start[surface.used].T for shape in wanted], axis=1)
        self._anchors = np.stack([shape.anchors[surface.moving].T for shape in wanted], axis=1)
        self._stretch = np.stack([shape.stretch for shape in wanted])
        self._lengths = np.stack([shape.lengths for shape in wanted])
        self._missing_volumes = [shape.volumes - surface.volumes.resting(shape.start) for shape in wanted]
        self._volume_direction: Floats | None = None

    def settled(self, sweeps: int) -> list[Floats]:
        """(n, 3) positions of each shape after so many sweeps."""
        settled = [shape.start.copy() for shape in self._wanted]
        if len(self._surface.moving):
            self._sweep(sweeps)
            for positions, moved in zip(settled, self._moved.transpose(1, 2, 0), strict=True):
                positions[self._surface.moving] = moved
        return settled

    def _sweep(self, sweeps: int) -> None:
        iteration = ChebyshevIteration(_RADIUS, _RELAXATION)
        going = np.ones(len(self._wanted), dtype=bool)
        self._move(self._corrected(True))
        for sweep in range(1, sweeps):
            present, refitted = self._moved.copy(), self._refitted()
            # The first half gets by without volumes.
            if 2 * sweep > sweeps and self._holds_volumes:
                self._note_missing()
                refitted = self._with_volumes(refitted)
            # Of a shape that has settled only rounding would be amplified.
            going &= np.abs(refitted - present).max(axis=(0, 2)) > _SETTLED
            if not going.any():
                break
            following = iteration.next(present, refitted)
            self._move(following if going.all() else np.where(going[:, None], following, present))
        self._note_missing()
        self._move(self._corrected(False))
        self._restore_volumes()

    @property
    def _moved(self) -> Floats:
        return np.asarray(self._positions[:, :, self._moving])

    def _move(self, moved: Floats) -> None:
        self._positions[:, :, self._moving] = moved

    @cached_property
    def _operators(self) -> list[_Operator]:
        """Gradients multiplied by the wanted stretches, for as many shapes at once as the processor's cache holds."""
        surface, shapes = self._surface, len(self._wanted)
        size = max(1, _TRIANGLES_IN_CACHE // max(1, len(surface.rows)))
        return [
            _Operator.of(surface, slice(first, first + size), self._stretch[first : first + size])
            for first in range(0, shapes, size)
        ]

    @cached_property
    def _constant_load(self) -> Floats:
        resting = self._positions[:, :, len(self._surface.moving) :]
        return np.asarray(
            self._surface.anchor_weights * self._anchors - _applied(self._surface.stiffness_beside, resting)
        )

    def _closest_tangents(self, operator: _Operator, lengths: Floats | float = 1.0) -> Floats:
        """(3, 2, q, m) of the operator's shapes, in memory by coordinate, shape and direction."""
        positions = self._positions[:, operator.shapes]
        rows = [operator.gradient @ coordinate.ravel() for coordinate in positions]
        gradients = np.stack(rows).reshape(3, positions.shape[1], 2, len(self._surface.rows))
        return closest_tangents(gradients.transpose(0, 2, 1, 3), lengths)

    def _refitted(self) -> Floats:
        """Positions (3, q, k) fitted to the rotations that the present ones ask for."""
        load = self._constant_load.copy()
        for operator in self._operators:
            tangents = self._closest_tangents(operator, self._surface.weights).transpose(0, 2, 1, 3)
            for coordinate, towards in enumerate(tangents):
                spread = operator.spread @ towards.ravel()
                load[coordinate, operator.shapes] += spread.reshape(len(towards), -1)[:, self._moving]
        if self._lengths.size:
            load += _applied(self._surface.spans.T, self._wanted_spans())[:, :, self._moving]
        return self._surface.solve(load)

    def _corrected(self, first: bool) -> Floats:
        """Positions (3, q, k) fitted at first to the wanted tangents, later to the closest, and solved for the change.

        Where the present positions are right, needles and tiny parts do not spoil them.
        """
        surface = self._surface
        load = surface.anchor_weights * (self._anchors - self._moved)
        for operator in self._operators:
            shapes = operator.shapes
            if first:
                tangents = np.stack([shape.tangents for shape in self._wanted[shapes]], axis=2)
            else:
                tangents = self._closest_tangents(operator)
            gradients = _applied(surface.gradient, self._positions[:, shapes])
            missing = stretched(self._stretch[shapes], tangents).transpose(0, 2, 1, 3).reshape(gradients.shape)
            missing = (missing - gradients) * np.tile(surface.weights, 2)
            load[:, shapes] += _applied(surface.gradient.T, missing)[:, :, self._moving]
        if self._lengths.size:
            missing_spans = self._wanted_spans() - _applied(surface.spans, self._positions)
            load += _applied(surface.spans.T, missing_spans)[:, :, self._moving]
        return np.asarray(self._moved + surface.solve(load))

    def _wanted_spans(self) -> Floats:
        """(3, q, s) the springs as long as they should be, in their present directions."""
        spans = _applied(self._surface.spans, self._positions)
        present = np.sqrt((spans**2).sum(axis=0))
        return np.asarray(spans * np.where(present > 1e-12, self._lengths / np.maximum(present, 1e-12), 0.0))

    def _with_volumes(self, moved: Floats) -> Floats:
        """Positions (3, q, k) moved on until, to first order, every closed component has its volume."""
        volumes = self._surface.volumes
        found = [volumes.with_slope(shape) for shape in self._positions.transpose(1, 0, 2)]
        direction = self._direction()
        present, result = self._moved, np.empty_like(moved)
        for shape, (enclosed, slope) in enumerate(found):
            missing = self._missing_volumes[shape] - enclosed
            missing -= volumes.changes(slope, moved[:, shape] - present[:, shape])
            missing = self._limited(missing, shape)
            result[:, shape] = volumes.stepped(moved[:, shape], direction[:, shape], slope, missing)
        return result

    def _note_missing(self) -> None:
        """Keep what volumes miss where they are looked at for the first time."""
        if not self._holds_volumes or self.corrected.any():
            return
        shapes = self._positions.transpose(1, 0, 2)
        found = np.stack([self._surface.volumes.with_slope(shape)[0] for shape in shapes])
        wanted = np.abs(np.stack([shape.volumes for shape in self._wanted]))
        missing = np.abs(np.stack(self._missing_volumes) - found)
        self.corrected = (missing / np.where(wanted > 0.0, wanted, np.inf)).max(axis=1, initial=0.0)

    def _direction(self) -> Floats:
        """(3, q, k) K^-1 grad V where it is first asked for; shapes change too little for it to be worth renewing."""
        if self._volume_direction is None:
            even = [self._surface.volumes.even_slope(shape) for shape in self._positions.transpose(1, 0, 2)]
            self._volume_direction = self._surface.solve(np.stack(even, axis=1))
        return self._volume_direction

    def _limited(self, missing: Floats, shape: int) -> Floats:
        # Volume is cubic along a step; a shape that is still far off must not be blown up by the linear model.
        largest = _LARGEST_VOLUME_STEP * np.abs(self._wanted[shape].volumes)
        return np.clip(missing, -largest, largest)

    def _restore_volumes(self) -> None:
        """Steps along K^-1 grad V until every closed component of every shape has its volume."""
        volumes = self._surface.volumes
        if not self._holds_volumes:
            return
        for _ in range(_LAST_VOLUME_STEPS):
            found = [volumes.with_slope(shape) for shape in self._positions.transpose(1, 0, 2)]
            direction = self._direction()
            restored = True
            for shape, (enclosed, slope) in enumerate(found):
                missing = self._missing_volumes[shape] - enclosed
                if (np.abs(missing) > _VOLUME_TOLERANCE * np.abs(self._wanted[shape].volumes)).any():
                    restored = False
                    moved, missing = self._positions[:, shape, self._moving], self._limited(missing, shape)
                    self._positions[:, shape, self._moving] = volumes.stepped(
                        moved, direction[:, shape], slope, missing
                    )
            if restored:
                break


def _applied(matrix: csr_array | csc_array, coordinates: Floats) -> Floats:
    """(3, q, r) a matrix (r, c) applied to the rows of (3, q, c)."""
    return np.stack([[matrix @ row for row in shapes] for shapes in coordinates])
