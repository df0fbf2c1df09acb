# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Local/global (ARAP) iterations that solve several frames of one surface at once.

The local step fits a rotation to each triangle, the global step fits positions to the rotations (Sorkine & Alexa 2007,
"As-rigid-as-possible surface modeling"); one of each is a sweep. Arrays are component-major, (3, q, n) for q shapes,
so that inner loops are contiguous and cover all shapes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Bools, Floats
from ..numerics.chebyshev import ChebyshevIteration
from .pieces import TRIANGLES_IN_CACHE, Operator
from .system import MovingSurface
from .tangents import closest_tangents, stretched

# Chebyshev weights are fixed in advance: the sweeps end before full convergence, and with adaptive weights what they
# reach would jump from one time to the next. With these, 13 sweeps do the work of 30 over-relaxed ones
# (docs/science/method.md).
_RADIUS = 0.95
_RELAXATION = 1.3
_SETTLED = 1e-10  # cube units; smaller changes are mostly rounding
_LARGEST_VOLUME_STEP = 0.1  # of the wanted volume: the range in which its linear model is good enough
_LAST_VOLUME_STEPS = 12  # a cap; a few steps usually suffice
_VOLUME_TOLERANCE = 1e-12  # relative; rounding


@dataclass(frozen=True, eq=False)
class Wanted:
    """What one shape of a surface should be like.

    Parameters
    ----------
    start : (n, 3)
        Initial positions, cube units; still vertices stay there.
    tangents : (3, 2, m)
        Tangent pairs of the moving triangles for the first global step.
    stretch : (m, 2, 2)
        In-plane stretches of the moving triangles.
    anchors : (n, 3)
        Anchors of the vertices.
    lengths : (s,)
        Lengths of the moving springs.
    volumes : (components,)
        Enclosed volumes; 0 for components that are not closed.
    """

    start: Floats
    tangents: Floats
    stretch: Floats
    anchors: Floats
    lengths: Floats
    volumes: Floats


@dataclass(frozen=True, eq=False)
class Branch:
    """Where the sweeps of q shapes were when volumes were first looked at; before, it does not matter whether they are.

    Parameters
    ----------
    sweep : int
        The next one.
    moved : (3, q, k)
        Positions of the moving vertices.
    iteration : ChebyshevIteration
    going : (q,) bool
        Which shapes have not converged.
    """

    sweep: int
    moved: Floats
    iteration: ChebyshevIteration
    going: Bools

    def of(self, shapes: Sequence[int]) -> Branch:
        """The same for some of the shapes."""
        chosen = list(shapes)
        return Branch(self.sweep, self.moved[:, chosen], self.iteration.of(chosen), self.going[chosen])


class Sweeps:
    """The sweeps of q shapes at once; the result of each shape does not depend on the others.

    Parameters
    ----------
    surface : MovingSurface
        The factored system.
    wanted : sequence of Wanted
        One for each shape.
    holds_volumes : bool
        Whether closed components get the volumes that are wanted.

    Attributes
    ----------
    corrected : (q,)
        For each shape the largest part of a wanted volume that is missing half-way, before volumes are looked at.
    branch : Branch, optional
        Where the sweeps were then.
    """

    def __init__(self, surface: MovingSurface, wanted: Sequence[Wanted], holds_volumes: bool = True) -> None:
        self._surface = surface
        self._holds_volumes = holds_volumes and not surface.volumes.empty
        self.corrected = np.zeros(len(wanted))
        self.branch: Branch | None = None
        self._wanted = wanted
        self._moving = slice(0, len(surface.moving))
        # The moving vertices first, then the still ones next to them.
        self._positions = np.stack([shape.start[surface.used].T for shape in wanted], axis=1)
        self._anchors = np.stack([shape.anchors[surface.moving].T for shape in wanted], axis=1)
        self._stretch = [shape.stretch for shape in wanted]
        self._lengths = np.stack([shape.lengths for shape in wanted])
        self._missing_volumes = [shape.volumes - surface.volumes.resting(shape.start) for shape in wanted]
        self._volume_direction: Floats | None = None
        self._found: list[tuple[Floats, Floats]] | None = None

    def settled(self, sweeps: int, begun: Branch | None = None) -> list[Floats]:
        """(n, 3) positions of each shape, cube units, after the given number of sweeps, of which some may be begun."""
        settled = [shape.start.copy() for shape in self._wanted]
        if len(self._surface.moving):
            self._sweep(sweeps, begun)
            for positions, moved in zip(settled, self._moved.transpose(1, 2, 0), strict=True):
                positions[self._surface.moving] = moved
        return settled

    def _sweep(self, sweeps: int, begun: Branch | None) -> None:
        # Volumes are restored in the second half only: doing it earlier improves no measure.
        first_with_volumes = sweeps // 2 + 1 if self._holds_volumes else 0
        if begun is None:
            first, iteration = 1, ChebyshevIteration(_RADIUS, _RELAXATION)
            going = np.ones(len(self._wanted), dtype=bool)
            self._move(self._corrected(True))
        else:
            first, iteration, going = begun.sweep, begun.iteration, begun.going.copy()
            self._move(begun.moved)
        for sweep in range(first, sweeps):
            if self._holds_volumes and sweep == first_with_volumes:
                self.branch = Branch(sweep, self._moved.copy(), iteration.of(slice(None)), going.copy())
            present, refitted = self._moved.copy(), self._refitted()
            if self._holds_volumes and sweep >= first_with_volumes:
                # What had converged before has not, if its volume is another one.
                going |= sweep == first_with_volumes
                self._note_missing()
                refitted = self._with_volumes(refitted)
            # Acceleration would only amplify the rounding of a shape that has converged.
            going &= np.abs(refitted - present).max(axis=(0, 2)) > _SETTLED
            if not going.any() and sweep >= first_with_volumes:
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
        self._found = None

    def _volumes_and_slopes(self) -> list[tuple[Floats, Floats]]:
        """Of each shape, where it is now."""
        if self._found is None:
            shapes = self._positions.transpose(1, 0, 2)
            self._found = [self._surface.volumes.with_slope(shape) for shape in shapes]
        return self._found

    @cached_property
    def _few(self) -> list[slice]:
        """The shapes, as many at a time as the processor's cache can hold."""
        size, count = max(1, TRIANGLES_IN_CACHE // max(1, len(self._surface.rows))), len(self._wanted)
        return [slice(first, min(first + size, count)) for first in range(0, count, size)]

    @cached_property
    def _operators(self) -> list[Operator]:
        """Gradient operators with the wanted stretches."""
        return [piece.operator(shapes, self._stretch) for shapes in self._few for piece in self._surface.pieces]

    @cached_property
    def _constant_load(self) -> Floats:
        resting = self._positions[:, :, len(self._surface.moving) :]
        return np.asarray(
            self._surface.anchor_weights * self._anchors - self._surface.stiffness_beside(resting)
        )

    def _closest_tangents(self, operator: Operator, lengths: Floats | float = 1.0) -> Floats:
        """(3, 2, q, p) the local step for the operator's shapes; in memory, the shape comes before the direction."""
        return closest_tangents(operator.gradients(self._positions), lengths)

    def _refitted(self) -> Floats:
        """(3, q, k) positions after one sweep: rotations are fitted to the present positions, positions to them."""
        load = np.zeros_like(self._positions)
        for operator in self._operators:
            operator.add_spread(self._closest_tangents(operator, self._surface.weights[operator.triangles]), load)
        if self._lengths.size:
            load += self._surface.spans.transposed(self._wanted_spans())
        return self._surface.solve(self._constant_load + load[:, :, self._moving])

    def _corrected(self, first: bool) -> Floats:
        """(3, q, k) positions after a global step that is solved for the change from the present positions.

        The first such step uses the wanted tangents, the last one the closest. Solving for the change keeps rounding in
        needles and tiny parts from spoiling positions that are right already.
        """
        surface = self._surface
        load = np.zeros_like(self._positions)
        pieces = ((shapes, piece) for shapes in self._few for piece in surface.pieces)
        for operator, (shapes, piece) in zip(self._operators, pieces, strict=True):
            part = piece.triangles
            if first:
                tangents = np.stack([shape.tangents[:, :, part] for shape in self._wanted[shapes]], axis=2)
            else:
                tangents = self._closest_tangents(operator)
            unstretched = piece.operator(shapes)
            missing = stretched(np.stack([one[part] for one in self._stretch[shapes]]), tangents)
            missing -= unstretched.gradients(self._positions)
            missing *= surface.weights[part]
            unstretched.add_spread(missing, load)
        if self._lengths.size:
            load += surface.spans.transposed(self._wanted_spans() - surface.spans(self._positions))
        present = self._moved
        pulled = surface.anchor_weights * (self._anchors - present)
        return np.asarray(present + surface.solve(pulled + load[:, :, self._moving]))

    def _wanted_spans(self) -> Floats:
        """(3, q, s) the springs' vectors with the wanted lengths, in their present directions."""
        spans = self._surface.spans(self._positions)
        present = np.sqrt((spans**2).sum(axis=0))
        return np.asarray(spans * np.where(present > 1e-12, self._lengths / np.maximum(present, 1e-12), 0.0))

    def _with_volumes(self, moved: Floats) -> Floats:
        """(3, q, k) positions ``moved``, corrected so that every closed component has its volume to first order."""
        volumes, found = self._surface.volumes, self._volumes_and_slopes()
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
        found = np.stack([enclosed for enclosed, _ in self._volumes_and_slopes()])
        wanted = np.abs(np.stack([shape.volumes for shape in self._wanted]))
        missing = np.abs(np.stack(self._missing_volumes) - found)
        self.corrected = (missing / np.where(wanted > 0.0, wanted, np.inf)).max(axis=1, initial=0.0)

    def _direction(self) -> Floats:
        """(3, q, k) K⁻¹ ∇V, computed at the first call only: shapes change too little afterward to matter."""
        if self._volume_direction is None:
            even = [self._surface.volumes.even_slope(shape) for shape in self._positions.transpose(1, 0, 2)]
            self._volume_direction = self._surface.solve(np.stack(even, axis=1))
        return self._volume_direction

    def _limited(self, missing: Floats, shape: int) -> Floats:
        # The volume is cubic in the step: far from the wanted volume, the linear model would overshoot.
        largest = _LARGEST_VOLUME_STEP * np.abs(self._wanted[shape].volumes)
        return np.clip(missing, -largest, largest)

    def _restore_volumes(self) -> None:
        """Steps along K⁻¹ ∇V until every closed component of every shape has its volume, up to rounding."""
        volumes = self._surface.volumes
        if not self._holds_volumes:
            return
        for _ in range(_LAST_VOLUME_STEPS):
            found, direction = self._volumes_and_slopes(), self._direction()
            self._found = None
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
