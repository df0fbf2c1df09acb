# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mode ``natural``: the surface follows its own interpolated rotations and stretches, guided by a fold-free map."""

from __future__ import annotations

import copy
from collections.abc import Generator, Sequence
from functools import partial

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..collision.colliders import CollisionResolver
from ..collision.self_crossings import CrossingLimit
from ..fit.fitted_map import FittedMap
from ..support.threads import batches, beside, in_threads
from ..surface.end_rates import Rates, hermite
from ..surface.path import SWEEPS
from .alignment import CalmAlignment, RigidMove
from .course import Course, shares_of_turns
from .extra_turns import ExtraSpins
from .frame import Frame
from .loose_pieces import LoosePieces
from .mirror_image import MirrorImages
from .shaping import Shaping
from .straighter import Straighter, more_than
from .volume_anchors import VolumeAnchors
from .volume_path import VolumePath, turning_inside

_UNCROSSING_ATTEMPTS = 3
_HASTE = (2, 8, 8)  # of each: first nearer to the course of a chain, then nearer to the volume
_SWEEPS_AT_KEYS = 2  # nothing is left to settle there
_PUSHES = 4  # how often the surface is solved again after colliders pushed vertices out
# Factor on the anchor weights at a crossing; there, the anchors of the volume override lengths.
_STRONGEST_ANCHOR = 1e8


class NaturalFrames:
    """In-betweens of a fitted pair: both keys are met exactly, still vertices stay, and no frame's map has folds.

    Parameters
    ----------
    fitted : FittedMap
    """

    def __init__(self, fitted: FittedMap) -> None:
        self._fitted = fitted
        self.notes: tuple[str, ...] = ()
        embedding = fitted.embedding
        self._surface = fitted.surface_path
        self._spins = ExtraSpins(embedding, self._surface, fitted.options.extra_turns)
        self._turns = turns = bool(self._spins) or self._surface.returns
        if fitted.options.extra_turns and not turns:
            self.notes = ("The extra turns change nothing: no part turns freely or by more than half a turn.",)
        with beside(lambda: fitted.crossings) as limit:
            turning = turning_inside(fitted, self._surface)
            self._volume = VolumePath(fitted.volume.system, fitted.maps, turning, fitted.options.stretch)
        self._limit = limit.result()
        self._slopes: tuple[Floats, Floats] | None = None
        self._alignment = CalmAlignment(embedding, self._surface, turns)
        self._anchors = VolumeAnchors(fitted, self._volume)
        self._mirror_images = MirrorImages(fitted.pair)
        if self._mirror_images:
            moment = self._anchors.of([self._volume.at(0.5)], [0.5])
            halfway = self._spins.apply(self._surface.shapes(moment)[0], 0.5)
            self._mirror_images.keep(embedding.from_cube(halfway, 0.5))
        self._shaping = Shaping(embedding, self._spins, self._mirror_images)

    @property
    def still(self) -> Bools:
        """(n,) vertices that stay in place."""
        return self._surface.still

    @property
    def rows(self) -> Ints:
        """(m,) which triangles of the pair's covering have rates: those with an area in both keys."""
        return self._surface.deformation.rows

    @property
    def resting(self) -> Bools:
        """(m,) whether a corner of these triangles stays in place."""
        return np.asarray(self.still[self._fitted.pair.covering[0][self.rows]].any(axis=1))

    @property
    def components(self) -> Ints:
        """(n,) labels of the connected components, which the rates of volumes are listed by."""
        return self._surface.components

    def key(self, end: int) -> Floats:
        """(n, 3) the first key (0) or the second (1)."""
        return self._fitted.pair.key1 if end else self._fitted.pair.key0

    def end_rates(self) -> tuple[Rates, Rates]:
        """Rates at both keys, in the keys' own coordinates."""
        embedding = self._fitted.embedding
        motion, axes, volume = embedding.motion, embedding.axes, embedding.scale**-3
        first, second = self._surface.end_rates()
        spins = ((first.spin + motion.turn) @ axes, (second.spin @ motion.rotation.T + motion.turn) @ axes)
        return Rates(spins[0], first.strain, volume * first.growth), Rates(
            spins[1], second.strain, volume * second.growth
        )

    def with_end_rates(self, first: Rates, second: Rates, inner: tuple[bool, bool]) -> NaturalFrames:
        """The same in-betweens with other rates at the two keys, in the keys' own coordinates.

        ``inner`` tells which of the two lies between this pair and another one.
        """
        embedding = self._fitted.embedding
        motion, axes, volume = embedding.motion, embedding.axes.T, embedding.scale**3
        spins = (first.spin @ axes - motion.turn, (second.spin @ axes - motion.turn) @ motion.rotation)
        changed = copy.copy(self)
        changed._surface = self._surface.with_end_rates(
            Rates(spins[0], first.strain, volume * first.growth), Rates(spins[1], second.strain, volume * second.growth)
        )
        changed._alignment = self._alignment.beside(inner)
        return changed

    def course_share(self) -> Floats:
        """(n,) how much the vertices may follow the course of a chain, 0..1; not at all with extra turns."""
        if self._turns:
            return np.zeros(len(self.still))
        deformation, count = self._surface.deformation, len(self.still)
        spins = [rates.spin for rates in self.end_rates()]
        angles = np.linalg.norm(0.5 * (spins[0] + spins[1]), axis=1)
        corners = self._fitted.pair.covering[0][self.rows]
        return shares_of_turns(angles, deformation.weights, corners, count)

    def along(self, course: Course) -> NaturalFrames:
        """The same in-betweens, drawn to the course of the chain that they are part of."""
        led = copy.copy(self)
        led._anchors, led._alignment = self._anchors.along(course), self._alignment.along(course)
        led._surface = self._surface.with_stronger_anchors(course.strength).beside_course(course.share)
        return led

    def with_end_slopes(self, first: Floats, second: Floats) -> NaturalFrames:
        """The same in-betweens with velocities (n, 3) added at the two keys."""
        changed = copy.copy(self)
        changed._slopes = (first, second)
        return changed

    def shape(self, time: float) -> Floats:
        """(n, 3) positions at ``time`` in 0..1, without resolving crossings."""
        shape = self._shaping.shaped(self._surface, self._anchors.of([self._volume.at(time)], [time]))[0]
        return self._finished(shape, time, self._alignment.of(shape, time))

    def frames(self, times: Floats, resolver: CollisionResolver | None = None) -> Generator[float, None, list[Frame]]:
        """One frame for each of ``times`` (k,) in 0..1, out of colliders; yields the finished share, 0..1."""
        volumes: list[Floats] = []
        positions: list[Floats] = []
        excess: list[int | None] = []
        yield 0.0
        at_keys = np.isin(times, (0.0, 1.0))
        few = batches(times[~at_keys].tolist(), self._surface.shapes_at_once)
        few += [times[at_keys].tolist()] if at_keys.any() else []
        for maps, shapes, crossing in self._shaping.side_by_side(self._first_try, few):
            volumes.extend(maps)
            positions.extend(shapes)
            excess.extend(crossing)
            yield len(volumes) / len(times)
        order = np.argsort(np.argsort(at_keys, kind="stable"))
        volumes, positions, excess = ([found[place] for place in order] for found in (volumes, positions, excess))
        positions, crossings = yield from self._uncrossed(times, volumes, positions, excess)
        moves = [self._alignment.of(shape, time) for shape, time in zip(positions, times.tolist(), strict=True)]
        held = self.still
        if any(crossings) and not self._turns:
            positions, crossings, straight = self._straighter(times, positions, moves, crossings)
            held = held | straight
        if resolver is not None:
            positions = yield from self._cleared(resolver, times, volumes, positions, moves)
            held = self.still
            crossings = list(in_threads(self._limit.excess, positions))
        moments = zip(times.tolist(), volumes, positions, moves, crossings, strict=True)
        return list(in_threads(partial(self._certified, held), moments))

    def _certified(self, held: Bools, moment: tuple[float, Floats, Floats, RigidMove, int | None]) -> Frame:
        """The frame of a time, its map's values, its surface in the cube, where it goes and its excess of crossings.

        ``held`` (n,) are the vertices that go straight.
        """
        time, values, shape, move, crossings = moment
        # The maps that were fitted on the way lead nearer to the surface, and past most folds.
        found = self._volume.followed(time, values)
        repaired = self._fitted.folds(found) > 0
        if repaired and not self._fitted.folds(values):
            found, repaired = values, False
        if repaired:
            found = self._fitted.unfolded(found, time)
        positions = self._finished(shape, time, move, held)
        return Frame.of(self._fitted, positions, found, time, repaired, crossings, move)

    def _first_try(self, times: Sequence[float]) -> tuple[Floats, list[Floats], list[int | None]]:
        """Values (k, N, 3) of the maps at ``times``, the surface's cube positions, and their excess of crossings.

        The times are those of the two keys, or others.
        """
        maps = self._volume.maps_at(times)
        at_keys = times[0] in (0.0, 1.0)
        sweeps = _SWEEPS_AT_KEYS if at_keys else SWEEPS
        shapes = self._shaping.shaped(self._surface, self._anchors.of(maps, times), sweeps)
        return maps, shapes, [0 if at_keys else self._limit.excess(shape) for shape in shapes]

    def _finished(self, shape: Floats, time: float, move: RigidMove, held: Bools | None = None) -> Floats:
        """Cube positions (n, 3) carried to the keys' coordinates; what goes straight, ``held`` (n,), is exactly there.

        Without ``held``, it is what both keys leave in place.
        """
        pair, held = self._fitted.pair, self.still if held is None else held
        positions = self._mirror_images.averaged(self._fitted.embedding.from_cube(move.apply(shape), time), time)
        if self._slopes is not None:
            positions += hermite(time, *self._slopes)
        positions[held] = pair.key0[held] + time * (pair.key1 - pair.key0)[held]
        return positions

    def _uncrossed(
        self, times: Floats, volumes: list[Floats], positions: list[Floats], excess: list[int | None]
    ) -> Generator[float, None, tuple[list[Floats], list[int | None]]]:
        """Where a frame crosses itself more than the keys do, move loose pieces aside.

        If that does not suffice, the volume's anchors win as far as that helps, before pieces move aside. Returns the
        positions and what is left of the excess of crossings in each frame.
        """
        if not any(excess):
            return positions, excess
        embedding, faces = self._fitted.embedding, self._fitted.pair.welded_faces
        pieces = LoosePieces(embedding.key0, faces, self.components, self.still)
        # Moving aside depends on the keys alone, and changes as little as they do; the volume's tetrahedra do not.
        aside, left = pieces.apart(self._limit, times, positions, excess)
        if not any(left):
            return aside, left
        positions, excess = yield from self._anchored(times, volumes, positions, excess)
        return pieces.apart(self._limit, times, positions, excess)

    def _anchored(
        self, times: Floats, volumes: list[Floats], positions: list[Floats], excess: list[int | None]
    ) -> Generator[float, None, tuple[list[Floats], list[int | None]]]:
        """Where a frame crosses itself more than the keys do, let the volume's anchors win as far as that helps."""
        reach = np.zeros(len(self.still))
        for attempt in range(_UNCROSSING_ATTEMPTS):
            if not any(excess):
                break
            yield attempt / _UNCROSSING_ATTEMPTS
            for shape in positions:
                reach = np.maximum(reach, self._limit.faded(self._limit.new_vertices(shape)))
            self._surface.release()
            surface = self._surface.with_stronger_anchors(_STRONGEST_ANCHOR**reach)
            anchored = self._anchors.aside(volumes, times.tolist(), reach, _HASTE[attempt])
            tried = self._shaping.all_shaped(surface, anchored)
            remaining = list(self._shaping.side_by_side(self._limit.excess, tried))
            if CrossingLimit.left(remaining) >= CrossingLimit.left(excess):
                if attempt == 0 and self._anchors.is_led:
                    continue
                break
            positions, excess = tried, remaining
        return positions, excess

    def _straighter(
        self, times: Floats, shapes: list[Floats], moves: list[RigidMove], excess: list[int | None]
    ) -> tuple[list[Floats], list[int | None], Bools]:
        """Go straight where that leaves fewer crossings; say where the straight blend still has fewer.

        Also returns the vertices that go all the way straight (n,).
        """
        moments = times.tolist()
        lines = [move.undo(self._fitted.embedding.straight(time)) for move, time in zip(moves, moments, strict=True)]
        onsets = [self._alignment.onset(time) for time in moments]
        found = Straighter(self._limit, self._surface, onsets).apart(shapes, lines, excess)
        over = more_than(found.excess, found.straight_excess)
        if over:
            self.notes += (
                f"{'A frame has' if len(over) == 1 else f'{len(over)} frames have'} up to {max(over)} more pairs of "
                "triangles that cross than the straight blend; mode straight has fewer there, and worse lengths.",
            )
        shapes = [self._shaping.symmetric(shape, time) for shape, time in zip(found.shapes, moments, strict=True)]
        return shapes, found.excess, np.asarray((found.part == 1.0) & (min(onsets) == 1.0) & (self._slopes is None))

    def _cleared(
        self,
        resolver: CollisionResolver,
        times: Floats,
        volumes: list[Floats],
        positions: list[Floats],
        moves: list[RigidMove],
    ) -> Generator[float, None, list[Floats]]:
        """Resolve collisions: push vertices out of colliders and solve the surface around them again, repeatedly."""
        embedding = self._fitted.embedding
        moments = times.tolist()
        reach = np.zeros(len(self.still))
        for attempt in range(_PUSHES + 1):
            yield attempt / (_PUSHES + 1)
            nearby, pushed = [], []
            for index, time in enumerate(moments):
                place = self._finished(positions[index], time, moves[index])
                near, moved = resolver.pushed(index, place, time)
                nearby.append(near & ~self.still)
                push = moves[index].undo_vectors(embedding.vectors_to_cube(moved - place, time))
                pushed.append(positions[index] + np.where(nearby[-1][:, None], push, 0.0))
            if not any(near.any() for near in nearby):
                return positions
            # The last push stands as it is; so does the only one where extra turns come on top of the surface's path.
            if attempt == _PUSHES or self._spins:
                return pushed
            for near in nearby:
                reach = np.maximum(reach, self._limit.faded(near))
            self._surface.release()
            surface = self._surface.with_stronger_anchors(_STRONGEST_ANCHOR**reach)
            anchored = self._anchors.of(volumes, moments)
            positions = self._shaping.all_shaped(
                surface,
                [
                    (time, np.where(reach[:, None] > 0.0, push, anchor))
                    for (time, anchor), push in zip(anchored, pushed, strict=True)
                ],
            )
        return positions
