# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes for a control: which moments of a motion become shapes, and what is played between them."""

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
from ..triangles.closed_volume import ClosedComponents
from ..triangles.topology import sides, unique_edges, vertex_components
from .bake import Bake, split
from .easing import eased, uneased
from .measures import worst_excess
from .report import PlayedReport, crossing_notes
from .weights import Weights, fewest_knots

# Where it is looked at between two shapes: parts of the way from the one to the other.
_LOOKED_AT = (0.25, 0.5, 0.75)
# Enclosed volumes below this part of the largest have no deviation to speak of.
_LEAST_VOLUME = 1e-6
# Times that differ by less are one.
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Moments:
    """Which moments of a motion to compute so that a control can play it.

    Parameters
    ----------
    times : (k,)
        Positions of the control, 0..1, increasing.
    keys : (pairs + 1,) int64
        Which of them are the keys.
    shapes : (s,) int64
        Which of them become shapes where the number of in-betweens is given; the others are to compare with.
    """

    times: Floats
    keys: Ints
    shapes: Ints

    @classmethod
    def of(cls, options: PlayOptions, frames: FrameOptions, pairs: int) -> Moments:
        """The moments that a control through so many pairs of keys needs."""
        at_keys = uneased(np.linspace(0.0, 1.0, pairs + 1), frames.easing)
        steps = DENSE_STEPS if options.tolerance > 0.0 else options.count + 1
        between = np.arange(1, steps) / steps
        shapes = np.concatenate([first + between * (second - first) for first, second in pairwise(at_keys)])
        shapes = _distinct(np.concatenate([at_keys, shapes, options.also_at]))
        times = shapes
        if not options.tolerance > 0.0:
            times = np.sort(np.concatenate([shapes, 0.5 * (shapes[1:] + shapes[:-1])]))
        return cls(times, np.searchsorted(times, at_keys), np.searchsorted(times, shapes))

    def chosen(self, options: PlayOptions, frames: FrameOptions, motion: Floats) -> tuple[Ints, list[int]]:
        """The moments (c,) that become shapes, and at which of them the path turns, for the whole motion (k, n, 3)."""
        # Only natural motions go through keys without a corner.
        corners = self.keys[1:-1].tolist() if frames.mode != "natural" else []
        everywhere = options.weights == "hats"
        shapes = self.shapes
        if options.tolerance > 0.0:
            also = np.abs(self.times[:, None] - np.array(options.also_at)).argmin(axis=0)
            wanted = [*self.keys.tolist(), *also.tolist()]
            shapes = fewest_knots(self.times, motion, options.tolerance, wanted, None if everywhere else corners)
        if everywhere:
            return shapes, list(range(1, len(shapes) - 1))
        return shapes, [shapes.tolist().index(corner) for corner in corners]


def played(
    bake: Bake,
    moments: Moments,
    pairs: Sequence[KeyPair],
    fits: Sequence[FittedMap],
    options: PlayOptions,
    frames: FrameOptions,
) -> Bake:
    """The bake of the moments that become shapes, with what is played between them in its report.

    Parameters
    ----------
    bake : Bake
        At all the moments.
    pairs, fits
        Consecutive pairs of keys, and their fits; none in mode ``straight``.
    """
    chosen, corners = moments.chosen(options, frames, bake.frames)
    shapes = bake.at(chosen)
    weights = Weights.smooth(shapes.times, corners)
    missed = np.linalg.norm(weights.played(shapes.frames, bake.times) - bake.frames, axis=2).max(axis=1, initial=0.0)
    worst = int(missed.argmax())
    positions, segments, local = _between(weights.knots, frames, len(pairs))
    shown = weights.played(shapes.frames, positions)
    crossings: list[int | None] = []
    stretch, folds = 0.0, 0
    volumes: list[float] = []
    for number, pair in enumerate(pairs):
        members = np.flatnonzero(segments == number)
        stretch = max(stretch, worst_excess(pair, shown[members]).excess)
        volumes += _volume_deviations(pair, shown[members], local[members])
        crossings += _new_crossings(pair, shown[members])
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
        volume=max(volumes, default=None),
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


def _distinct(times: Floats) -> Floats:
    """Sorted times (k,), those that differ by rounding taken as one."""
    ordered = np.sort(times)
    return ordered[np.diff(ordered, prepend=-1.0) > _SAME]


def _between(knots: Floats, frames: FrameOptions, pairs: int) -> tuple[Floats, Ints, Floats]:
    """Positions (p,) between the knots, the numbers of their pairs of keys, and times within these."""
    positions = (knots[:-1, None] + np.array(_LOOKED_AT) * np.diff(knots)[:, None]).ravel()
    return positions, *split(eased(positions, frames.easing), pairs)


def _volume_deviations(pair: KeyPair, shapes: Floats, times: Floats) -> list[float]:
    """How far enclosed volumes of shapes (p, n, 3) are from the line between those of the keys, the worst part's."""
    vertices, group = pair.welding
    faces = group[pair.faces]
    closed = ClosedComponents(faces, vertex_components(unique_edges(sides(faces)), len(vertices)))
    first, second = (closed.volumes(key[vertices]) for key in (pair.key0, pair.key1))
    known = np.abs(first) > _LEAST_VOLUME * max(float(np.abs(first).max(initial=0.0)), 1e-300)
    found = []
    for shape, time in zip(shapes, times, strict=True):
        wanted = (1.0 - time) * first + time * second
        usable = known & (np.abs(wanted) > _LEAST_VOLUME * np.abs(first))
        deviation = np.abs(closed.volumes(shape[vertices]) - wanted)[usable] / np.abs(wanted[usable])
        found += [float(deviation.max())] if usable.any() else []
    return found


def _new_crossings(pair: KeyPair, shapes: Floats) -> list[int | None]:
    """Crossing pairs of triangles of each shape (p, n, 3) beyond those of the worse key."""
    crossings = PairCrossings(pair)
    return list(in_threads(crossings.excess, shapes))


def _with_keys(fitted: FittedMap, maps: Sequence[Floats]) -> Floats:
    """(k, N, 3) maps of the frames of one pair of keys, with the pair's own at its two keys."""
    return np.stack([fitted.mesh.points, *maps[1:-1], fitted.mapped])
