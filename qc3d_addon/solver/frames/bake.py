# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes: frames at times, with a report; and the validation of times and chains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Floats, Ints
from ..errors import InputError
from ..keys.keypair import KeyPair
from .report import BakeReport


@dataclass(frozen=True, eq=False)
class Bake:
    """The frames of one bake.

    Parameters
    ----------
    times : (k,)
        0 is the first key, 1 the last.
    frames : (k, n, 3)
        Positions in the keys' own coordinates.
    report : BakeReport
    measures : dict
        Distortion of each frame at each vertex by the name of the measure, (k, n) each; empty in mode ``straight``.
    maps : tuple of (N, 3)
        Values of each frame's map, cube units; empty in mode ``straight``, and where the work was done elsewhere.
    """

    times: Floats
    frames: Floats
    report: BakeReport
    measures: dict[str, NDArray[np.float32]] = field(default_factory=dict)
    maps: tuple[Floats, ...] = ()

    def of_first(self, count: int) -> Bake:
        """The bake of the first ``count`` of its vertices, of which the others are mirror images."""
        measures = {name: values[:, :count] for name, values in self.measures.items()}
        return replace(self, frames=self.frames[:, :count], report=self.report.of_first(count), measures=measures)

    def at(self, chosen: Ints) -> Bake:
        """The bake of only some of its frames, given by their indices (c,)."""
        measures = {name: values[chosen] for name, values in self.measures.items()}
        maps = tuple(self.maps[index] for index in chosen) if self.maps else ()
        return Bake(self.times[chosen], self.frames[chosen], self.report.at(chosen.tolist()), measures, maps)


def evenly_spaced(count: int) -> Floats:
    """(count + 2,) times of ``count`` in-betweens between the keys at 0 and 1.

    Raises
    ------
    InputError
        If the count is negative.

    Examples
    --------
    >>> evenly_spaced(1)
    array([0. , 0.5, 1. ])
    """
    if count < 0:
        raise InputError(f"The number of in-betweens is {count}; it must be 0 or more.")
    return np.linspace(0.0, 1.0, count + 2)


def checked_times(times: ArrayLike) -> Floats:
    """(k,) times of frames as an array; raises InputError unless all are numbers from 0 to 1."""
    try:
        wanted = np.atleast_1d(np.asarray(times, dtype=np.float64))
    except (TypeError, ValueError) as reason:
        raise InputError("The times of the frames must be numbers.") from reason
    if wanted.ndim != 1 or not ((wanted >= 0.0) & (wanted <= 1.0)).all():
        raise InputError("The times of the frames must be a list of numbers from 0 (first key) to 1 (last key).")
    return wanted


def require_chain(pairs: Sequence[KeyPair]) -> None:
    """Raise InputError unless every pair starts with the key at which the previous one ends."""
    for left, right in pairwise(pairs):
        if not np.array_equal(left.key1, right.key0):
            raise InputError("The pairs of the chain do not meet: each must begin with the key that ended the last.")
