# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotations to positions, positions to rotations: the moving part of a surface, over and over until it has settled.

The part that moves is small on most shape keys, so vertices that rest, and triangles among them, are left out. Arrays
of vertices and triangles are stored by coordinate, (3, n), so that every operation runs along memory.
"""

from __future__ import annotations

import copy
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array

from .chebyshev import ChebyshevIteration
from .enclosed import ClosedComponents, MovingVolumes
from .factorization import dissection_order, factored
from .stiffness import StiffnessPattern, stiffness_elements
from .surface import TriangleDeformation, closest_tangents, gradient_operator, stretched
from .tetmesh import Bools, Floats, Ints
from .topology import distinct

# Fixed weights: shapes have not settled fully, and what adaptive weights make of them jumps from one time to the next.
_RADIUS = 0.95
_RELAXATION = 1.3
_SETTLED = 1e-10  # cube units
_LARGEST_VOLUME_STEP = 0.1
_LAST_VOLUME_STEPS = 12
_VOLUME_TOLERANCE = 1e-12

Result = TypeVar("Result")
# Work that yields loads (3, k) and is sent their solutions.
Solving = Generator[Floats, Floats, Result]


class MovingSurface:
    """The system that a surface's moving vertices solve; it is factored once for all times.

    Parameters
    ----------
    deformation : TriangleDeformation
    springs : (s, 2) int64
        Edges that keep their length.
    closed : ClosedComponents
    free : (n,) bool
        Vertices that move.
    points : (n, 3)
        Where the vertices are, for the order of elimination.
    anchor_weights : (n,)

    Attributes
    ----------
    rows : (m,) int64
        The triangles of the deformation that have a moving corner.
    springs : (s,) int64
        The springs that have a moving end.
    moving, used : (k,), (l,) int64
        The vertices that move, and these with those that rest beside them.
    """

    def __init__(
        self,
        deformation: TriangleDeformation,
        springs: Ints,
        closed: ClosedComponents,
        free: Bools,
        points: Floats,
        anchor_weights: Floats,
    ) -> None:
        count = len(free)
        self.rows: Ints = np.flatnonzero(free[deformation.faces].any(axis=1))
        self.springs: Ints = np.flatnonzero(free[springs].any(axis=1))
        faces, edges = deformation.faces[self.rows], springs[self.springs]
        self.weights = deformation.weights[self.rows]
        self.hats = deformation.gradients[self.rows]
        spring = np.broadcast_to(np.array([[1.0, -1.0], [-1.0, 1.0]]), (len(edges), 2, 2))
        stiffness = csr_array(
            StiffnessPattern(faces, count).assemble(stiffness_elements(self.weights, self.hats))
            + StiffnessPattern(edges, count).assemble(spring)
        )
        moving = np.flatnonzero(free)
        moving = moving[dissection_order(points[moving], csr_array(stiffness[moving][:, moving]))]
        touched = closed.faces[free[closed.faces].any(axis=1)]
        beside = distinct(np.concatenate([faces.ravel(), edges.ravel(), touched.ravel()]))
        beside = beside[~free[beside]]
        self.moving, self.used = moving, np.concatenate([moving, beside])
        number = np.zeros(count, dtype=np.int64)
        number[self.used] = np.arange(len(self.used))
        self.faces = number[faces]
        self._stiffness = csr_array(stiffness[moving][:, moving])
        self.stiffness_beside = csr_array(stiffness[moving][:, beside])
        self.volumes = MovingVolumes(closed, moving, self.used)
        self.gradient = gradient_operator(self.faces, self.hats, len(self.used))
        ends = np.tile([-1.0, 1.0], len(edges)), number[edges].ravel(), np.arange(0, 2 * len(edges) + 1, 2)
        self.spans = csr_array(ends, shape=(len(edges), len(self.used)))
        self._factor(anchor_weights)

    def with_anchor_weights(self, anchor_weights: Floats) -> MovingSurface:
        """The same system with other anchor weights (n,)."""
        other = copy.copy(self)
        other._factor(anchor_weights)
        return other

    def _factor(self, anchor_weights: Floats) -> None:
        self.anchor_weights = anchor_weights[self.moving]
        self._factored = factored(csr_array(self._stiffness + diags_array(self.anchor_weights)))

    def solve(self, loads: Floats) -> Floats:
        """(c, k) solutions for loads (c, k) on the moving vertices."""
        return np.asarray(self._factored.solve(loads.T).T)


@dataclass(frozen=True, eq=False)
class Wanted:
    """What a surface should look like at one time.

    Parameters
    ----------
    stretch : (m, 2, 2)
        Of the moving triangles.
    anchors : (n, 3)
        Where vertices are drawn to.
    lengths : (s,)
        Of the moving springs.
    volumes : (components,)
        Zero where a component is not closed.
    """

    stretch: Floats
    anchors: Floats
    lengths: Floats
    volumes: Floats


class Sweeps:
    """The sweeps of one shape; loads of the system go out, solutions come in, so that shapes can be solved together.

    Parameters
    ----------
    surface : MovingSurface
    start : (n, 3)
        Positions to start at; vertices that rest stay there.
    wanted : Wanted
    """

    def __init__(self, surface: MovingSurface, start: Floats, wanted: Wanted) -> None:
        self._surface = surface
        self._start = start
        self._wanted = wanted
        self._moving = slice(0, len(surface.moving))
        # The moving vertices, then those beside them.
        self._positions = np.ascontiguousarray(start[surface.used].T)
        self._anchors = np.ascontiguousarray(wanted.anchors[surface.moving].T)
        self._missing_volumes = wanted.volumes - surface.volumes.resting(start)
        self._largest_volume_step = _LARGEST_VOLUME_STEP * np.abs(wanted.volumes)
        self._volume_direction: Floats | None = None

    def settling(self, tangents: Floats, sweeps: int) -> Solving[Floats]:
        """(n, 3) positions after so many sweeps; the first fit is to ``tangents`` (3, 2, m)."""
        settled = self._start.copy()
        if len(self._surface.moving):
            iteration = ChebyshevIteration(_RADIUS, _RELAXATION)
            self._move((yield from self._corrected(tangents)))
            for sweep in range(1, sweeps):
                present = self._moved.copy()
                refitted = yield from self._refitted()
                # The first half gets by without volumes.
                if 2 * sweep > sweeps:
                    refitted = yield from self._with_volumes(refitted)
                if np.abs(refitted - present).max() <= _SETTLED:  # else rounding would be amplified
                    break
                self._move(iteration.next(present, refitted))
            self._move((yield from self._corrected(closest_tangents(self._stretched_gradients()))))
            yield from self._restore_volumes()
            settled[self._surface.moving] = self._moved.T
        return settled

    @property
    def _moved(self) -> Floats:
        return np.asarray(self._positions[:, self._moving])

    def _move(self, moved: Floats) -> None:
        self._positions[:, self._moving] = moved

    @cached_property
    def _stretched_gradient(self) -> csr_array:
        """The operator of gradients, multiplied by the wanted stretches."""
        surface = self._surface
        return gradient_operator(surface.faces, surface.hats @ self._wanted.stretch, len(surface.used))

    @cached_property
    def _constant_load(self) -> Floats:
        resting = self._positions[:, len(self._surface.moving) :]
        return np.asarray(
            self._surface.anchor_weights * self._anchors - _applied(self._surface.stiffness_beside, resting)
        )

    @cached_property
    def _spread(self) -> csc_array:
        """(k, 2m): takes tangents to what they give to the moving vertices, stretched gradients transposed."""
        return self._stretched_gradient[:, self._moving].T

    def _stretched_gradients(self) -> Floats:
        return _applied(self._stretched_gradient, self._positions).reshape(3, 2, -1)

    def _refitted(self) -> Solving[Floats]:
        """Positions (3, k) fitted to the rotations that the present ones ask for."""
        tangents = closest_tangents(self._stretched_gradients(), self._surface.weights)
        load = _applied(self._spread, tangents.reshape(3, -1)) + self._constant_load
        if len(self._wanted.lengths):
            load += _applied(self._surface.spans.T, self._wanted_spans())[:, self._moving]
        return np.asarray((yield load))

    def _corrected(self, tangents: Floats) -> Solving[Floats]:
        """Positions (3, k) fitted to tangents (3, 2, m), solved for the change.

        Where the present positions are right, needles and tiny parts do not spoil them.
        """
        surface = self._surface
        missing = stretched(self._wanted.stretch, tangents).reshape(3, -1)
        missing -= _applied(surface.gradient, self._positions)
        load = _applied(surface.gradient.T, missing * np.tile(surface.weights, 2))[:, self._moving]
        load += surface.anchor_weights * (self._anchors - self._moved)
        if len(self._wanted.lengths):
            missing_spans = self._wanted_spans() - _applied(surface.spans, self._positions)
            load += _applied(surface.spans.T, missing_spans)[:, self._moving]
        return np.asarray(self._moved + (yield load))

    def _wanted_spans(self) -> Floats:
        """(3, s) the springs as long as they should be, in their present directions."""
        spans = _applied(self._surface.spans, self._positions)
        present = np.sqrt((spans**2).sum(axis=0))
        return np.asarray(spans * np.where(present > 1e-12, self._wanted.lengths / np.maximum(present, 1e-12), 0.0))

    def _with_volumes(self, moved: Floats) -> Solving[Floats]:
        """Positions (3, k) moved on until, to first order, every closed component has its volume."""
        volumes = self._surface.volumes
        if volumes.empty:
            return moved
        enclosed, slope = volumes.with_slope(self._positions)
        missing = self._missing_volumes - enclosed - volumes.changes(slope, moved - self._moved)
        return volumes.stepped(moved, (yield from self._direction(slope)), slope, self._limited(missing))

    def _direction(self, slope: Floats) -> Solving[Floats]:
        """(3, k) K^-1 grad V where it is first asked for; the shape changes too little for it to be worth renewing."""
        if self._volume_direction is None:
            self._volume_direction = yield slope
        return self._volume_direction

    def _limited(self, missing: Floats) -> Floats:
        # Volume is cubic along a step; a shape that is still far off must not be blown up by the linear model.
        return np.clip(missing, -self._largest_volume_step, self._largest_volume_step)

    def _restore_volumes(self) -> Solving[None]:
        """Steps along K^-1 grad V until every closed component has its volume."""
        volumes = self._surface.volumes
        if volumes.empty:
            return
        for _ in range(_LAST_VOLUME_STEPS):
            enclosed, slope = volumes.with_slope(self._positions)
            missing = self._missing_volumes - enclosed
            if (np.abs(missing) <= _VOLUME_TOLERANCE * np.abs(self._wanted.volumes)).all():
                break
            direction = yield from self._direction(slope)
            self._move(volumes.stepped(self._moved, direction, slope, self._limited(missing)))


def solved_together(surface: MovingSurface, shapes: Sequence[Solving[Floats]]) -> list[Floats]:
    """What each of ``shapes`` returns. They go on in step: the factors pass through memory once for all their loads."""
    results: dict[int, Floats] = {}
    answers: dict[int, Floats | None] = dict.fromkeys(range(len(shapes)))
    while answers:
        loads: dict[int, Floats] = {}
        for number, answer in answers.items():
            try:
                loads[number] = next(shapes[number]) if answer is None else shapes[number].send(answer)
            except StopIteration as end:
                results[number] = end.value
        if not loads:
            break
        solutions = surface.solve(np.concatenate(list(loads.values())))
        answers = dict(zip(loads, np.split(solutions, len(loads)), strict=True))
    return [results[number] for number in range(len(shapes))]


def _applied(matrix: csr_array | csc_array, coordinates: Floats) -> Floats:
    """(3, r) a matrix (r, c) applied to each row of (3, c)."""
    return np.stack([matrix @ row for row in coordinates])
