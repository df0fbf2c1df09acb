# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets a surface go straight where it crosses itself more often than in the straight blend, such as at lids and lips.

Where parts lie close to each other, each on its own arc, they may meet on the way although straight lines would pass.
Nobody sees the difference in lengths there, but everybody sees a lid that an eye pierces.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ..arrays import Bools, Floats
from ..collision.self_crossings import CrossingLimit
from ..support.threads import in_threads
from ..surface.path import SurfacePath

# What goes straight fades out over so many rings of neighbors.
_RINGS = (2, 4, 9, 18, 36)
# How far edges may leave the interval between their key lengths for that, 99th percentile of those that move: by the
# first more than before, or than in the straight blend as long as that keeps within the second.
_MORE, _FAIR = 0.0025, 0.02


class Straightened(NamedTuple):
    """Shapes that may go straighter.

    Parameters
    ----------
    shapes : list of (n, 3)
    excess : list of int or None
        How many more pairs of triangles cross in each than in the worse key; None where that is not known.
    straight_excess : list of int or None
        The same of the straight blend.
    part : (n,)
        How far each vertex goes straight, 0..1.
    """

    shapes: list[Floats]
    excess: list[int | None]
    straight_excess: list[int | None]
    part: Floats


class Straighter:
    """Blends shapes between two keys with the straight blend.

    Parameters
    ----------
    limit : CrossingLimit
    path : SurfacePath
    onsets : sequence of float
        For each shape the part, 0..1, of the difference that is due: near a key where velocities must stay as they are,
        less than 1.
    """

    def __init__(self, limit: CrossingLimit, path: SurfacePath, onsets: Sequence[float]) -> None:
        self._limit, self._path, self._onsets = limit, path, onsets

    def apart(self, shapes: list[Floats], lines: list[Floats], excess: list[int | None]) -> Straightened:
        """Shapes (n, 3) that cross themselves no more than the straight blend, as far as possible.

        Parameters
        ----------
        shapes, lines : list of (n, 3)
            The shapes, and the straight blend at the same times.
        excess : list of int or None
            How many more pairs of triangles cross in each shape than in the worse key.
        """
        allowed = list(in_threads(self._limit.excess, lines))
        best, left, chosen = shapes, excess, np.zeros(len(shapes[0]))
        bound = max(self._lost(shapes), min(self._lost(lines), _FAIR)) + _MORE
        for part in self._parts(shapes, lines[len(lines) // 2]) if more_than(excess, allowed) else ():
            tried = [
                shape + (onset * part)[:, None] * (line - shape)
                for shape, line, onset in zip(shapes, lines, self._onsets, strict=True)
            ]
            if self._lost(tried) > bound:
                continue
            found = list(in_threads(self._limit.excess, tried))
            if _badness(found, allowed) < _badness(left, allowed):
                best, left, chosen = tried, found, part
            if not any(_badness(left, allowed)):
                break
        return Straightened(best, left, allowed, chosen)

    def _parts(self, shapes: Sequence[Floats], straight: Floats) -> Iterator[Floats]:
        """(n,) how far each vertex goes straight: more and more of the surface around what crosses, at last all."""
        bends = self._path.bends(straight)
        crossing = np.logical_or.reduce([self._limit.new_vertices(shape) for shape in shapes])
        for rings in _RINGS:
            yield np.where(bends, 0.0, self._limit.faded(crossing, rings))
        labels = self._path.components
        whole: Bools = np.isin(labels, labels[crossing])
        yield np.where(bends, 0.0, whole.astype(np.float64))
        yield np.where(bends, 0.0, 1.0)

    def _lost(self, shapes: Sequence[Floats]) -> float:
        return max(self._path.length_excess(shape) for shape in shapes)


def _badness(excess: Sequence[int | None], allowed: Sequence[int | None]) -> tuple[int, int]:
    """How many crossings more than the straight blend, and than one less: who rounds differently counts differently."""
    fewer = [None if most is None else max(0, most - 1) for most in allowed]
    return sum(more_than(excess, allowed)), sum(more_than(excess, fewer))


def more_than(excess: Sequence[int | None], allowed: Sequence[int | None]) -> list[int]:
    """By how many crossings each frame exceeds what is allowed, where it does and both are known."""
    over = [
        count - most for count, most in zip(excess, allowed, strict=True) if count is not None and most is not None
    ]
    return [count for count in over if count > 0]
