# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""When a chain is at its keys, and between which two of them it is at any time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..errors import InputError
from ..settings import Easing, FrameOptions
from .bake import evenly_spaced
from .easing import eased, uneased

_SAME = 1e-9  # times such as 1/3 are not exact; those that are meant to be at a key must hit it


@dataclass(frozen=True, eq=False)
class KeyTimes:
    """The times at which a chain is at its keys.

    Parameters
    ----------
    at : (pairs + 1,)
        Times of the keys, from 0 at the first to 1 at the last, increasing.
    easing : Easing
        Easing of the whole motion. It changes the speed between the keys, and not the times of the keys.

    Examples
    --------
    >>> times = KeyTimes.of(FrameOptions(via_at=(0.2,)), 2)
    >>> times.split(np.array([0.1, 0.2, 0.6]))
    (array([0, 1, 1]), array([0.5, 0. , 0.5]))
    """

    at: Floats
    easing: Easing = "linear"

    @classmethod
    def of(cls, options: FrameOptions, pairs: int) -> KeyTimes:
        """The times in a chain of ``pairs`` pairs; by default, all pairs take the same time before the easing.

        Raises
        ------
        InputError
            If the options give times of more or fewer inner keys than there are.
        """
        if not options.via_at:
            return cls(uneased(np.linspace(0.0, 1.0, pairs + 1), options.easing), options.easing)
        if len(options.via_at) != pairs - 1:
            raise InputError(
                f"{len(options.via_at)} times are given for {pairs - 1} keys between the first and the last; give one "
                "for each."
            )
        return cls(np.array([0.0, *options.via_at, 1.0]), options.easing)

    @property
    def pairs(self) -> int:
        """Number of pairs of keys."""
        return len(self.at) - 1

    @property
    def before_easing(self) -> KeyTimes:
        """The same chain without its easing: the fraction of the motion that is done at each key."""
        return KeyTimes(eased(self.at, self.easing))

    @property
    def durations(self) -> Floats:
        """(pairs,) parts of the time, before the easing, that each pair takes."""
        return np.diff(self.before_easing.at)

    def along(self, times: Floats) -> Floats:
        """(k,) positions along the chain at ``times`` (k,): 1.5 is half-way between the second key and the third."""
        found = np.interp(eased(times, self.easing), self.before_easing.at, np.arange(self.pairs + 1.0))
        whole = np.round(found)
        return np.asarray(np.where(np.abs(found - whole) < _SAME, whole, found))

    def split(self, times: Floats) -> tuple[Ints, Floats]:
        """(k,) indices of the pairs, and times within them, 0..1, at ``times`` (k,)."""
        along = self.along(times)
        segments = np.minimum(np.floor(along), self.pairs - 1)
        return segments.astype(np.int64), along - segments

    def between(self, count: int) -> Floats:
        """(pairs * (count + 1) + 1,) times of all keys and of ``count`` evenly spaced moments between every two.

        Raises
        ------
        InputError
            If the count is negative.
        """
        keys = np.arange(self.pairs + 1.0)
        along = (keys[:-1, None] + evenly_spaced(count)[:-1]).ravel()
        return np.asarray(np.interp([*along, keys[-1]], keys, self.at))
