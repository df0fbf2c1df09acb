# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights of a control: how much of each shape it shows at each of its positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats, Ints
from ..errors import InputError

_LEAST_DISTANCE = 1e-6  # between knots: closer ones would give weights of very large slopes


@dataclass(frozen=True, eq=False)
class Weights:
    """Weights of shapes at knots: one piecewise cubic function of the control's position for each shape.

    Function i is 1 at knot i and 0 at all other knots, and all functions sum to 1 everywhere. Outside the knots, they
    continue linearly.

    Parameters
    ----------
    knots : (k,)
        Positions of the shapes, increasing; at least two.
    slopes : (2, k, k)
        ``slopes[:, j, i]`` is the slope of function i just before and just after knot j.
    """

    knots: Floats
    slopes: Floats

    @classmethod
    def smooth(cls, knots: ArrayLike, corners: Sequence[int] = ()) -> Weights:
        """Cardinal functions of the cubic spline with the given knots, not-a-knot at the ends.

        With three knots it is a parabola, with two a straight line. For knots a distance h apart, the spline follows a
        smooth path with an error of order h⁴, and straight blends with an error of order h² (de Boor 1978, *A Practical
        Guide to Splines*, chapter IV).

        Parameters
        ----------
        knots : (k,)
            Positions of the shapes.
        corners : sequence of int
            Indices of inner knots at which the path may have a corner; the spline is split there.

        Examples
        --------
        >>> Weights.smooth([0.0, 0.5, 1.0]).at([0.25]).round(3)
        array([[ 0.375,  0.75 , -0.125]])
        """
        places = _checked(knots)
        slopes = np.zeros((2, len(places), len(places)))
        ends = [0, *sorted(set(corners)), len(places) - 1]
        for first, last in pairwise(ends):
            part = slice(first, last + 1)
            derivative = _spline_slopes(places[part])
            slopes[0, first + 1 : last + 1, part] = derivative[1:]
            slopes[1, first:last, part] = derivative[:-1]
        slopes[0, 0], slopes[1, -1] = slopes[1, 0], slopes[0, -1]
        return cls(places, slopes)

    @classmethod
    def hats(cls, knots: ArrayLike) -> Weights:
        """Piecewise linear functions: between two shapes, the control plays their straight blend.

        Examples
        --------
        >>> Weights.hats([0.0, 0.5, 1.0]).at([0.25])
        array([[0.5, 0.5, 0. ]])
        """
        places = _checked(knots)
        return cls.smooth(places, range(1, len(places) - 1))

    def at(self, positions: ArrayLike) -> Floats:
        """(p, k) weights at positions (p,) of the control."""
        wanted = np.atleast_1d(np.asarray(positions, dtype=np.float64))
        knots, count = self.knots, len(self.knots)
        before = np.clip(np.searchsorted(knots, wanted, side="right") - 1, 0, count - 2)
        width = (knots[before + 1] - knots[before])[:, None]
        part = np.clip((wanted - knots[before])[:, None] / width, 0.0, 1.0)
        values, rest = np.eye(count), 1.0 - part
        # Cubic Hermite basis.
        found = rest * rest * (1.0 + 2.0 * part) * values[before]
        found += part * part * (1.0 + 2.0 * rest) * values[before + 1]
        found += width * part * rest * (rest * self.slopes[1, before] - part * self.slopes[0, before + 1])
        found += np.minimum(wanted - knots[0], 0.0)[:, None] * self.slopes[1, 0]
        found += np.maximum(wanted - knots[-1], 0.0)[:, None] * self.slopes[0, -1]
        return np.asarray(found)

    def played(self, shapes: Floats, positions: ArrayLike) -> Floats:
        """(p, n, 3) shapes that the control plays at positions (p,), given the shapes (k, n, 3) at its knots."""
        return np.tensordot(self.at(positions), shapes, axes=1)


def fewest_knots(
    times: Floats, frames: Floats, tolerance: float, required: Sequence[int] = (), corners: Sequence[int] | None = ()
) -> Ints:
    """Choose as few knots as play all frames within a tolerance; they need not be evenly spaced.

    Parameters
    ----------
    times : (d,)
        Times of the frames, increasing.
    frames : (d, n, 3)
        Frames of the whole motion, dense enough to represent all of it.
    tolerance : float
        Largest distance of a vertex from its place in a frame, in the unit of the frames.
    required : sequence of int
        Indices of frames that must be knots, such as those at keys; the first and the last always are.
    corners : sequence of int or None
        Indices, among these, of the frames at which the path has a corner; None if it has one at every knot, as with
        hats.

    Returns
    -------
    (k,) numbers of the frames that are knots, sorted; all of them where no fewer are enough.

    Notes
    -----
    Knots are added where the path is farthest from its frames; then fewer are tried where the path bends most evenly
    between them, with a density that follows the fourth root of its fourth derivative (de Boor 1978, chapter XII).
    """
    fixed = sorted({0, *required, *(corners or ()), len(times) - 1})
    greedy = list(fixed)
    while (missed := _missed(times, frames, greedy, corners)).max() > tolerance and len(greedy) < len(times):
        greedy = sorted({*greedy, int(missed.argmax())})
    bends = _bends(times, frames, fixed)
    for count in range(len(fixed), len(greedy)):
        placed = _placed(bends, fixed, count)
        if len(placed) == count and _missed(times, frames, placed, corners).max() <= tolerance:
            return np.array(placed, dtype=np.int64)
    return np.array(greedy, dtype=np.int64)


def _spline_slopes(knots: Floats) -> Floats:
    """(k, k) the slope, at each of two or more knots, of the cubic spline that is 1 at one knot and 0 at the others.

    The same as ``scipy.interpolate.CubicSpline(knots, np.eye(k))(knots, 1)``, without the tenth of a second and the 10
    MB that loading that takes in every new process.
    """
    count, width = len(knots), np.diff(knots)
    secant = np.diff(np.eye(count), axis=0) / width[:, None]
    if count == 2:
        return np.asarray(secant[[0, 0]])
    matrix, wanted = np.zeros((count, count)), np.empty((count, count))
    inner = np.arange(1, count - 1)
    matrix[inner, inner - 1], matrix[inner, inner + 1] = width[1:], width[:-1]
    matrix[inner, inner] = 2.0 * (width[1:] + width[:-1])
    wanted[inner] = 3.0 * (width[1:, None] * secant[:-1] + width[:-1, None] * secant[1:])
    # Both pieces at an end belong to one cubic. With three knots that says the same at both ends, and the spline is the
    # parabola, whose slope changes evenly.
    for end, beside in ((0, 1), (-1, -2)):
        both = width[end] + width[beside]
        matrix[end, end], matrix[end, beside] = (1.0, 1.0) if count == 3 else (width[beside], both)
        wanted[end] = 2.0 * secant[end]
        if count > 3:
            near = (width[end] + 2.0 * both) * width[beside] * secant[end]
            wanted[end] = (near + width[end] ** 2 * secant[beside]) / both
    return np.asarray(np.linalg.solve(matrix, wanted))


def _checked(knots: ArrayLike) -> Floats:
    places = np.asarray(knots, dtype=np.float64)
    if places.ndim != 1 or len(places) < 2 or not (np.diff(places) > _LEAST_DISTANCE).all():
        raise InputError("The positions of the shapes must be two or more different numbers in increasing order.")
    return places


def _missed(times: Floats, frames: Floats, knots: Sequence[int], corners: Sequence[int] | None) -> Floats:
    """(d,) largest distance of a vertex in each frame from the path through the knots; 0 at the knots."""
    turning = range(1, len(knots) - 1) if corners is None else [knots.index(corner) for corner in corners]
    weights = Weights.smooth(times[list(knots)], turning)
    missed = np.linalg.norm(weights.played(frames[list(knots)], times) - frames, axis=2).max(axis=1, initial=0.0)
    missed[list(knots)] = 0.0
    return np.asarray(missed)


def _bends(times: Floats, frames: Floats, fixed: Sequence[int]) -> Floats:
    """(d,) cumulative density of knots that the path needs up to each frame, in an arbitrary unit."""
    density = np.zeros(len(times))
    for first, last in pairwise(fixed):
        flat = frames[first : last + 1].reshape(last + 1 - first, -1)
        if len(flat) > 4:
            for _ in range(4):
                flat = np.asarray(np.gradient(flat, axis=0))
            density[first : last + 1] += np.abs(flat).max(axis=1, initial=0.0) ** 0.25
    density += 1e-3 * (density.mean() or 1.0)
    return np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(times))])


def _placed(bends: Floats, fixed: Sequence[int], count: int) -> list[int]:
    """About ``count`` knots: the fixed ones, and others evenly spaced in ``bends``."""
    free = count - len(fixed)
    wanted = bends[-1] * np.arange(1, free + 1) / (free + 1)
    return sorted({*fixed, *np.abs(bends[:, None] - wanted).argmin(axis=0).tolist()} if free else {*fixed})
