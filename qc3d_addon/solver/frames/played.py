# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes for a control: which moments of a motion become shapes, and how well the control plays the motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..arrays import Floats, Ints
from ..collision.self_crossings import CrossingLimit, PairCrossings
from ..fit.fitted_map import FittedMap
from ..keys.keypair import KeyPair
from ..settings import DENSE_STEPS, FrameOptions, PlayOptions
from ..support.threads import in_threads
from .bake import Bake
from .component_volumes import ComponentVolumes
from .key_times import KeyTimes
from .measures import worst_excess
from .report import PlayedReport, crossing_notes
from .weights import Weights, fewest_knots

_LOOKED_AT = (0.25, 0.5, 0.75)  # places between two neighboring shapes at which what is played is measured
_LOST_VOLUME = 0.001  # relative deviation beyond that of the computed motion; smaller ones cannot be seen
_LEVELS = 3  # see ``Moments.denser``
_SAME = 1e-5  # times that differ by less are equal


@dataclass(frozen=True, eq=False)
class Moments:
    """The moments of a motion that are computed so that a control can play it.

    Parameters
    ----------
    times : (k,)
        Positions of the control, 0..1, increasing.
    keys : (pairs + 1,) int64
        Indices of the keys among them.
    shapes : (s,) int64
        Indices of the moments that become shapes, if the number of in-betweens is given; the other moments are for
        comparison.
    """

    times: Floats
    keys: Ints
    shapes: Ints

    @classmethod
    def of(cls, options: PlayOptions, frames: FrameOptions, pairs: int) -> Moments:
        """The moments for a control that goes through ``pairs`` pairs of keys."""
        key_times = KeyTimes.of(frames, pairs)
        count = DENSE_STEPS - 1 if options.tolerance > 0.0 else options.count
        others = np.concatenate([key_times.between(count), options.also_at])
        others = others[np.abs(others[:, None] - key_times.at).min(axis=1) > _SAME]  # keys are met exactly
        shapes = np.sort(np.concatenate([key_times.at, _distinct(others)]))
        times = shapes
        if not options.tolerance > 0.0:
            times = np.sort(np.concatenate([shapes, 0.5 * (shapes[1:] + shapes[:-1])]))
        return cls(times, np.searchsorted(times, key_times.at), np.searchsorted(times, shapes))

    def chosen(self, options: PlayOptions, frames: FrameOptions, motion: Floats) -> tuple[Ints, list[int]]:
        """Choose shapes for a motion (k, n, 3): indices (c,) of their moments, and those of shapes with a corner."""
        shapes = self.shapes
        if options.tolerance > 0.0:
            wanted = [*self.keys.tolist(), *self.also(options)]
            corners = None if options.weights == "hats" else self._corners(frames)
            shapes = fewest_knots(self.times, motion, options.tolerance, wanted, corners)
        return shapes, self.corners(shapes, options, frames)

    def denser(self, options: PlayOptions, levels: Sequence[int]) -> Ints:
        """Indices (c,) of moments that become shapes, by the level of each pair.

        Level 0 has the given number of in-betweens, level 1 those half-way between them and the keys, which are one
        more and nearer to the keys, and level 2 all of both.
        """
        chosen = {*self.keys.tolist(), *self.also(options)}
        for (first, last), level in zip(pairwise(self.keys.tolist()), levels, strict=True):
            even = self.shapes[(self.shapes > first) & (self.shapes < last)]
            inside = np.arange(first + 1, last)
            chosen |= {*(even, np.setdiff1d(inside, even), inside)[level].tolist()}
        return np.array(sorted(chosen), dtype=np.int64)

    def also(self, options: PlayOptions) -> list[int]:
        """Indices of the moments of the additional in-betweens."""
        return list(np.abs(self.times[:, None] - np.array(options.also_at)).argmin(axis=0).tolist())

    def corners(self, shapes: Ints, options: PlayOptions, frames: FrameOptions) -> list[int]:
        """Indices, among these shapes (c,), of those at which the played path has a corner."""
        if options.weights == "hats":
            return list(range(1, len(shapes) - 1))
        return [shapes.tolist().index(corner) for corner in self._corners(frames)]

    def _corners(self, frames: FrameOptions) -> list[int]:
        """Indices of the moments at which the motion has a corner: only natural motions have none at keys."""
        return [] if frames.mode == "natural" else list(self.keys[1:-1].tolist())


def played(
    bake: Bake,
    moments: Moments,
    pairs: Sequence[KeyPair],
    fits: Sequence[FittedMap],
    options: PlayOptions,
    frames: FrameOptions,
) -> Bake:
    """The bake of only those moments that become shapes; its report measures what is played between them.

    Parameters
    ----------
    bake : Bake
        The bake of all moments.
    moments : Moments
    pairs : sequence of KeyPair
        Consecutive pairs of keys.
    fits : sequence of FittedMap
        The fit of each pair; empty in mode ``straight``.
    options : PlayOptions
    frames : FrameOptions
    """
    volumes = [ComponentVolumes(pair) for pair in pairs]
    chosen, corners = moments.chosen(options, frames, bake.frames)
    if options.more and not options.tolerance > 0.0:
        chosen = _keeping_volumes(bake, moments, volumes, options, frames)
        corners = moments.corners(chosen, options, frames)
    shapes = bake.at(chosen)
    weights = Weights.smooth(shapes.times, corners)
    missed = np.linalg.norm(weights.played(shapes.frames, bake.times) - bake.frames, axis=2).max(axis=1, initial=0.0)
    worst = int(missed.argmax())
    positions, segments, local = _between(weights.knots, frames, len(pairs))
    shown = weights.played(shapes.frames, positions)
    crossings: list[int | None] = []
    stretch, folds = 0.0, 0
    lost: list[float] = []
    for number, pair in enumerate(pairs):
        members = np.flatnonzero(segments == number)
        stretch = max(stretch, worst_excess(pair, shown[members]).excess)
        lost += volumes[number].deviations(shown[members], local[members])
        fitted = fits[number] if frames.mode == "natural" else None
        crossings += _new_crossings(pair, fitted, shown[members], local[members])
        if fits:
            first, last = np.searchsorted(weights.knots, bake.times[moments.keys[number : number + 2]])
            knots, maps = weights.knots[first : last + 1], shapes.maps[first : last + 1]
            shown_maps = Weights.smooth(knots).played(_with_keys(fits[number], maps), positions[members])
            folds = max([folds, *map(fits[number].folds_left, shown_maps, local[members].tolist())])
    report = PlayedReport(
        weights=options.weights,
        corners=corners,
        positions=len(positions),
        distance=float(missed[worst]) / pairs[0].diagonal,
        distance_at=float(bake.times[worst]),
        worst_stretch=stretch,
        volume=max(lost, default=None),
        folds=folds if fits else None,
        crossings=None if None in crossings else max((count or 0 for count in crossings), default=0),
    )
    notes = [*shapes.report.notes]
    if 0.0 < options.tolerance < missed[worst]:
        notes.append(
            f"All {len(chosen) - len(moments.keys)} in-betweens that a tolerance can make miss it: vertices are up to "
            f"{missed[worst]:.2g} off. Choose more by their number, or a larger tolerance."
        )
    if CrossingLimit.left(crossings) > CrossingLimit.left(shapes.report.crossings):
        notes += [note for note in crossing_notes(crossings, positions) if note not in notes]
    return replace(shapes, report=replace(shapes.report, played=report, notes=notes))


def _keeping_volumes(
    bake: Bake,
    moments: Moments,
    volumes: Sequence[ComponentVolumes],
    options: PlayOptions,
    frames: FrameOptions,
) -> Ints:
    """Indices (c,) of the shapes: of each pair as few as play its volumes like the motion itself, from ``count`` on."""
    segments, local = KeyTimes.of(frames, len(volumes)).split(bake.times)
    most = []
    for number, measured in enumerate(volumes):
        members = np.flatnonzero(segments == number)
        most.append(max(measured.deviations(bake.frames[members], local[members]), default=0.0) + _LOST_VOLUME)
    levels = [0] * len(volumes)
    while True:
        chosen = moments.denser(options, levels)
        weights = Weights.smooth(bake.times[chosen], moments.corners(chosen, options, frames))
        positions, segments, local = _between(weights.knots, frames, len(volumes))
        shown = weights.played(bake.frames[chosen], positions)
        beyond = []
        for number, measured in enumerate(volumes):
            members = np.flatnonzero(segments == number)
            lost = max(measured.deviations(shown[members], local[members]), default=0.0)
            beyond.append(lost - most[number] if levels[number] < _LEVELS - 1 else 0.0)
        worst = int(np.argmax(beyond))
        if not beyond[worst] > 0.0:
            return chosen
        levels[worst] += 1


def _distinct(times: Floats) -> Floats:
    """(k,) distinct times, sorted; times that differ by rounding only are equal."""
    ordered = np.sort(times)
    return ordered[np.diff(ordered, prepend=-1.0) > _SAME]


def _between(knots: Floats, frames: FrameOptions, pairs: int) -> tuple[Floats, Ints, Floats]:
    """Positions (p,) between the knots, the indices of their pairs of keys, and their times within these pairs."""
    positions = (knots[:-1, None] + np.array(_LOOKED_AT) * np.diff(knots)[:, None]).ravel()
    return positions, *KeyTimes.of(frames, pairs).split(positions)


def _new_crossings(pair: KeyPair, fitted: FittedMap | None, shapes: Floats, times: Floats) -> list[int | None]:
    """For each shape (p, n, 3) at a time (p,), how many more pairs of triangles cross than in the worse key."""
    if fitted is None or fitted.pair.planes:  # the map of a mirrored whole knows the crossings of the whole
        return list(in_threads(PairCrossings(pair).excess, shapes))
    places = [fitted.embedding.to_cube(shape, time) for shape, time in zip(shapes, times.tolist(), strict=True)]
    return list(in_threads(fitted.crossings.excess, places))


def _with_keys(fitted: FittedMap, maps: Sequence[Floats]) -> Floats:
    """(k, N, 3) maps of the frames of one pair, with the identity and the fitted map at the two keys."""
    return np.stack([fitted.mesh.points, *maps[1:-1], fitted.mapped])
