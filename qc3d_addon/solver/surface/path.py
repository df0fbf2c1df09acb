# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface path: shapes between two keys that keep lengths, volumes and still vertices, and meet both keys."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from functools import partial

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..keys.embedding import NEARLY_STILL, STILL_TOLERANCE, Embedding
from ..numerics.blocks import in_blocks
from ..numerics.grouped_sums import sums_by_label
from ..numerics.rotation_unwrapping import consistent_turning, half_turned, mean_turns
from ..numerics.rotations import by_component
from ..numerics.symmetric_matrices import Stretch
from ..settings import StretchLaw
from ..triangles.closed_volume import ClosedComponents
from ..triangles.deformation import TriangleDeformation
from ..triangles.geometry import edge_lengths
from ..triangles.topology import edges_without_triangle, face_adjacency, sides, unique_edges, vertex_components
from .anchors import ScrewAnchors
from .end_rates import (
    EndCorrection,
    Rates,
    end_spins,
    hermite,
    rotation_vector_rates,
    slope_of_strain,
    strain_of_slope,
    stretch_slopes,
)
from .joints import Joints
from .lengths_first import LengthsFirst, onset_of_mixing
from .places import PartPlaces
from .rigid_parts import RigidParts
from .sweeps import Sweeps, Wanted
from .system import MovingSurface
from .tangents import tangents_of

ANCHOR_WEIGHT = 5e-5
_LEAST_CERTAIN = 1e-9  # far below what anchors weigh
# What travels a hundredth of the size or more is not drawn to its line at all.
_NO_LINE = (NEARLY_STILL / 1e-2) ** 2
# Of still vertices, those around which triangles turn further than this come back after a full turn. Half a turn, as of
# a page about its still spine, must not be decided by rounding.
_RETURNS = 1.5 * np.pi
SWEEPS = 13
# More shapes together save little and wait for each other; more triangles go through memory too often.
_MOST_AT_ONCE = 4
_TRIANGLES_AT_ONCE = 150_000
_MANY = 200_000  # triangles: large surfaces keep only what every frame needs


class SurfacePath:
    """Shapes between the two keys of an embedded pair. Everything that does not depend on the time is factored once.

    Positions x minimize ``sum w |grad x - R(t) P(t)|^2 + a sum m |x - anchor(t)|^2`` over triangles with weight w,
    rotation R and stretch P, and vertices with area m; local/global sweeps refit the rotations. Edges that belong to no
    usable triangle act as springs that keep their interpolated lengths. Still vertices move straight between the keys.
    The enclosed volume of each closed component is interpolated linearly.

    Parameters
    ----------
    embedding : Embedding
    law : StretchLaw
        How stretches are interpolated.
    free_after_turns : bool
        Whether vertices that return to their place after full turns move with their component instead of being still.
    other_way : (p,) int64, optional
        Components that turn the other way round, by a full turn less.

    Attributes
    ----------
    vertices : (k,) int64
        One vertex of each group that coincides in both keys; ``deformation`` uses indices into these.
    group : (n,) int64
        For every vertex the one of ``vertices`` that coincides with it.
    still : (n,) bool
        Whether each vertex is still, and so stays on the straight line between the keys.
    returns : bool
        Whether vertices that both keys leave in place come back there after full turns.
    components : (n,) int64
        Connected component of each vertex.
    turning : Turning
        Unwrapped rotations of the triangles of ``deformation``.
    whole_turn : (3,)
        Rotation vector of the motion of the whole, which is taken out of the keys; radians.
    rest : (3,)
        Rotation vector of what stays in place beside that motion; zero where nothing does.
    half_turned : (p,) int64
        Components that turn by about half a turn as one, which may as well go the other way round.
    """

    def __init__(
        self,
        embedding: Embedding,
        law: StretchLaw = "linear",
        free_after_turns: bool = False,
        other_way: Ints | None = None,
    ) -> None:
        self._law: StretchLaw = law
        self.whole_turn = embedding.motion.turn
        self.vertices, self.group = embedding.pair.welding
        self._key0, key1 = embedding.key0[self.vertices], embedding.key1[self.vertices]
        self._apart = None
        if embedding.pair.nearly_coincident:
            self._apart = [key - key[self.vertices][self.group] for key in (embedding.key0, embedding.key1)]
        self._embedding = embedding
        still = embedding.still[self.vertices]
        count = len(self.vertices)
        faces, (triangles, shares) = embedding.pair.faces, embedding.pair.covering
        if count < len(self.group):
            faces, triangles = self.group[faces], self.group[triangles]
        usable = TriangleDeformation.between(self._key0, key1, triangles, shares)
        held = still[usable.faces].any(axis=1)
        centers = self._key0[usable.faces].mean(axis=1)
        # What stays in place turns back beside a motion that was taken out.
        self.rest = -embedding.motion.turn if still.any() else np.zeros(3)
        neighbors = face_adjacency(usable.faces)
        turning = consistent_turning(usable.turns, neighbors, centers, usable.weights, held, self.rest)
        # What turns half a turn from what is around it tells nothing; something must keep its vertices in place.
        usable = usable.weighing(np.maximum(turning.certainty, _LEAST_CERTAIN))
        returned = np.zeros(count, dtype=bool)
        if free_after_turns:
            returned[usable.faces[turning.angles_from(self.rest) > _RETURNS]] = True
            still &= ~returned
        self.returns = bool((embedding.still[self.vertices] & returned).any())
        self.still = still[self.group]
        self._free = ~still
        self._springs = edges_without_triangle(triangles, self.group[embedding.pair.edges], usable.faces)
        self._lengths = [edge_lengths(key, self._springs) for key in (self._key0, key1)]
        labels = vertex_components(np.concatenate([unique_edges(sides(faces)), self._springs]), count)
        self.components = labels[self.group]
        owners = labels[usable.faces[:, 0]]
        flipped = np.zeros(0, dtype=np.int64) if other_way is None else other_way
        self.turning = turning.other_way(np.isin(owners, flipped))
        self.half_turned = half_turned(self.turning, usable.weights, owners, self.rest)
        self._closed = ClosedComponents(faces, labels)
        self._volumes = [self._closed.volumes(key) for key in (self._key0, key1)]
        weights = sums_by_label(self.group, embedding.weights, count)
        covering, halfway = (triangles, shares), embedding.straight(0.5)[self.vertices]
        self._lengths_first = LengthsFirst(
            self._key0, key1, covering, self._springs, labels, self._closed, halfway, self._free
        )
        turns = mean_turns(self.turning, usable.weights, owners, int(labels.max(initial=-1)) + 1)
        self._screws = ScrewAnchors(self._key0, key1, ~self._free, weights, labels, turns)
        self._places = PartPlaces(
            self._key0, key1, ~self._free, weights, labels, usable.faces, usable.weights, self.turning
        )
        self._joints = Joints(self._key0, key1, ~self._free, weights, labels, turns)
        self._rigid = RigidParts(self._key0, key1, ~self._free, weights, labels)
        area = float(usable.weights.sum())
        density = area / float((np.ptp(self._key0, axis=0) ** 2).sum()) if area > 0.0 else 1.0
        self._anchor_weights = ANCHOR_WEIGHT * density * weights
        # What hardly travels is drawn to its straight line, in the limit as if it were still.
        travel = np.maximum(embedding.travel[self.vertices], STILL_TOLERANCE)
        self._line_weights = np.where(returned, 0.0, np.maximum((NEARLY_STILL / travel) ** 2 - _NO_LINE, 0.0) ** 2)
        self._correction: EndCorrection | None = None
        self._surface = MovingSurface(
            usable,
            self._springs,
            self._closed,
            covering,
            self._free,
            self._key0,
            self._anchor_weights + self._line_weights,
        )
        rows = self._surface.rows
        self._moving_turning = self.turning.part(rows)
        values, vectors = usable.stretch.values[rows], usable.stretch.vectors[rows]
        self._moving_stretch = Stretch(by_component(values), by_component(vectors))
        self._moving_tangents = by_component(usable.bases[rows, :, :2])
        # Of many triangles, what only chains need is computed again for them.
        many = len(usable.faces) > _MANY
        self.deformation = usable.without_motion() if many else usable.without_directions()

    def with_stronger_anchors(self, factors: Floats) -> SurfacePath:
        """The same path with anchor weights multiplied by ``factors`` (n,), each at least 1."""
        stronger = copy.copy(self)
        strongest = np.ones(len(self._key0))
        np.maximum.at(strongest, self.group, factors)
        stronger._anchor_weights = self._anchor_weights * strongest
        stronger._surface = self._surface.with_anchor_weights(stronger._anchor_weights + self._line_weights)
        return stronger

    def beside_course(self, shares: Floats) -> SurfacePath:
        """The same path where vertices follow a course other than straight lines, as far as ``shares`` (n,) in 0..1."""
        other = copy.copy(self)
        other._lengths_first = self._lengths_first.beside_course(shares[self.vertices])
        return other

    def release(self) -> None:
        """Give up, on large surfaces, memory that will be filled again when it is needed."""
        self._surface.release()

    def whole_deformation(self) -> TriangleDeformation:
        """The deformation with its turns and stretches."""
        if len(self.deformation.turns) == len(self.deformation.faces):
            return self.deformation
        triangles, shares = self._embedding.pair.covering
        key1 = self._embedding.key1[self.vertices]
        return TriangleDeformation.between(self._key0, key1, self.group[triangles], shares)

    def end_rates(self) -> tuple[Rates, Rates]:
        """Rates of rotation, stretch and volume at the first and at the second key."""
        deformation = self.whole_deformation()
        spins = end_spins(self.turning.swing, self.turning.twist)
        slopes = stretch_slopes(deformation.stretch, self._law)
        growth = self._volumes[1] - self._volumes[0]
        # In the tangent bases of the second key.
        second = deformation.spins @ strain_of_slope(deformation.stretch, slopes[1])
        second = second @ deformation.spins.transpose(0, 2, 1)
        return Rates(spins[0], slopes[0], growth), Rates(spins[1], second, growth)

    def with_end_rates(self, first: Rates, second: Rates) -> SurfacePath:
        """The same path between the same keys with other rates at its ends."""
        deformation = self.whole_deformation()
        before, after = (own.toward(new) for own, new in zip(self.end_rates(), (first, second), strict=True))
        strain = deformation.spins.transpose(0, 2, 1) @ after.strain @ deformation.spins
        corrected = copy.copy(self)
        corrected._correction = EndCorrection(
            (before.spin, rotation_vector_rates(self.turning.swing, after.spin)),
            (before.strain, slope_of_strain(deformation.stretch, strain)),
            (before.growth, after.growth),
        )
        return corrected

    @property
    def shapes_at_once(self) -> int:
        """Number of shapes to solve together: several on small meshes, which saves calls and memory traffic."""
        return max(1, min(_MOST_AT_ONCE, _TRIANGLES_AT_ONCE // max(1, len(self._surface.rows))))

    def positions(self, time: float, anchor: Floats | None = None, sweeps: int = SWEEPS) -> Floats:
        """(n, 3) positions in cube units at a time; the keys themselves at 0 and 1.

        Parameters
        ----------
        time : float
            In 0..1.
        anchor : (n, 3), optional
            Anchors of the vertices, equal to the keys at 0 and 1. By default each component follows its screw motion.
        sweeps : int
            Number of local/global iterations.
        """
        return self.shapes([(time, anchor)], sweeps)[0]

    def shapes(self, moments: Sequence[tuple[float, Floats | None]], sweeps: int = SWEEPS) -> list[Floats]:
        """The ``positions`` for several (time, anchor), solved together, which is faster than one by one."""
        wanted = [self._wanted(*moment) for moment in moments]
        work = Sweeps(self._surface, wanted)
        settled = work.settled(sweeps)
        onsets = onset_of_mixing(work.corrected)
        costly = np.flatnonzero(onsets > 0.0).tolist()
        begun = work.branch.of(costly) if work.branch is not None and costly else None
        del work  # the second sweeps must not need its memory in addition
        if costly:
            apart = Sweeps(self._surface, [wanted[shape] for shape in costly], holds_volumes=False)
            free = apart.settled(sweeps, begun)
            for shape, other in zip(costly, free, strict=True):
                mixed = self._lengths_first.mixed(settled[shape], other, moments[shape][0])
                settled[shape] = settled[shape] + onsets[shape] * (mixed - settled[shape])
        settled = [
            self._lengths_first.straightened(shape, time, self._embedding.straight(time)[self.vertices])
            for shape, (time, _) in zip(settled, moments, strict=True)
        ]
        return [self._unwelded(shape, time) for shape, (time, _) in zip(settled, moments, strict=True)]

    def bends(self, shape: Floats) -> Bools:
        """(n,) the vertices of components that are congruent in both keys and that a shape (n, 3) would bend."""
        return np.asarray(self._rigid.bent(shape[self.vertices])[self.group])

    def length_excess(self, shape: Floats) -> float:
        """How far edges of a shape (n, 3) leave the interval between their key lengths: the 99th percentile of all."""
        return self._lengths_first.lost(shape[self.vertices])

    def _unwelded(self, shape: Floats, time: float) -> Floats:
        """(n, 3) positions of all vertices; coincident ones keep the tiny, interpolated offsets of their keys."""
        positions = self._joints.closed(self._rigid.placed(shape, time), time)[self.group]
        if self._apart is not None:
            positions += (1.0 - time) * self._apart[0] + time * self._apart[1]
        return positions

    def _wanted(self, time: float, anchor: Floats | None) -> Wanted:
        anchors = self._screws.positions(time) if anchor is None else anchor[self.vertices]
        anchors = self._places.moved(anchors, time)
        lengths = (1.0 - time) * self._lengths[0] + time * self._lengths[1]
        volumes = (1.0 - time) * self._volumes[0] + time * self._volumes[1]
        if self._correction is not None:
            volumes = volumes + hermite(time, *self._correction.volumes)
        tangents, stretch = in_blocks(partial(self._wanted_triangles, time), len(self._surface.rows))
        lines = self._embedding.straight(time)[self.vertices]
        share = (self._line_weights / (self._anchor_weights + self._line_weights))[:, None]
        anchors = anchors + share * (lines - anchors)
        start = np.where(self._free[:, None], anchors, lines)
        return Wanted(start, tangents.transpose(1, 2, 0), stretch, anchors, lengths[self._surface.springs], volumes)

    def _wanted_triangles(self, time: float, part: slice) -> tuple[Floats, Floats]:
        """(p, 3, 2) the tangents and (p, 2, 2) the stretches of some moving triangles."""
        stretch = self._moving_stretch.part(part).at(time, self._law)
        change: Floats | float = 0.0
        if self._correction is not None:
            rows = self._surface.rows[part]
            stretch = stretch + hermite(time, *(slope[rows] for slope in self._correction.stretches))
            change = hermite(time, *(slope[rows] for slope in self._correction.turns))
        rotations = self._moving_turning.part(part).at(time, change)
        return tangents_of(rotations, self._moving_tangents[part]).transpose(2, 0, 1), stretch
