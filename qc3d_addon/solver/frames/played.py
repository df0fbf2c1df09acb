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
from ..triangles.closed_volume import ClosedComponents
from ..triangles.topology import sides, unique_edges, vertex_components
from .bake import Bake, split
from .easing import eased, uneased
from .measures import worst_excess
from .report import PlayedReport, crossing_notes
from .weights import Weights, fewest_knots

_LOOKED_AT = (0.25, 0.5, 0.75)  # places between two neighboring shapes at which what is played is measured
_LEAST_VOLUME = 1e-6  # of the largest volume; a relative deviation of smaller ones means little
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
        """Choose shapes for a motion (k, n, 3): indices (c,) of their moments, and those of shapes with a corner."""
        # Only natural motions have no corners at keys.
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
    """(k,) distinct times, sorted; times that differ by rounding only are equal."""
    ordered = np.sort(times)
    return ordered[np.diff(ordered, prepend=-1.0) > _SAME]


def _between(knots: Floats, frames: FrameOptions, pairs: int) -> tuple[Floats, Ints, Floats]:
    """Positions (p,) between the knots, the indices of their pairs of keys, and their times within these pairs."""
    positions = (knots[:-1, None] + np.array(_LOOKED_AT) * np.diff(knots)[:, None]).ravel()
    return positions, *split(eased(positions, frames.easing), pairs)


def _volume_deviations(pair: KeyPair, shapes: Floats, times: Floats) -> list[float]:
    """For each shape (p, n, 3), the largest relative deviation of a component's volume from the interpolated one."""
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
    """For each shape (p, n, 3), the number of crossing pairs of triangles beyond that of the worse key."""
    crossings = PairCrossings(pair)
    return list(in_threads(crossings.excess, shapes))


def _with_keys(fitted: FittedMap, maps: Sequence[Floats]) -> Floats:
    """(k, N, 3) maps of the frames of one pair, with the identity and the fitted map at the two keys."""
    return np.stack([fitted.mesh.points, *maps[1:-1], fitted.mapped])
