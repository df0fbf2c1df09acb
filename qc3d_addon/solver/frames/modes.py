# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The modes: the only place that knows what makes the frames of each."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import Protocol

from ..arrays import Floats
from ..collision.colliders import CollisionResolver
from ..fit.fitted_map import FittedMap
from ..keys.keypair import KeyPair
from ..settings import FrameOptions, Mode
from .frame import Frame
from .join import join
from .key_times import KeyTimes
from .linear import LinearFrames
from .natural import NaturalFrames
from .straight import StraightFrames


class FrameMaker(Protocol):
    """Makes the frames of one pair of keys."""

    notes: tuple[str, ...]

    def frames(self, times: Floats, resolver: CollisionResolver | None = None) -> Generator[float, None, list[Frame]]:
        """One frame for each of ``times`` (k,) in 0..1, out of colliders; yields the finished share, 0..1."""


def needs_fits(mode: Mode) -> bool:
    """Whether frames of this mode need fitted maps."""
    return mode != "straight"


def frame_makers(
    pairs: Sequence[KeyPair], fits: Sequence[FittedMap], options: FrameOptions
) -> Generator[float, None, Sequence[FrameMaker]]:
    """The makers of each pair's frames; in mode ``natural`` they are joined without a jerk at the inner keys.

    Parameters
    ----------
    pairs : sequence of KeyPair
        Consecutive pairs of one mesh.
    fits : sequence of FittedMap
        The fit of each pair; ignored in mode ``straight``.
    options : FrameOptions

    Yields
    ------
    float
        Finished share of the work, 0..1.
    """
    if options.mode == "straight":
        return [StraightFrames(pair) for pair in pairs]
    if options.mode == "linear":
        return [LinearFrames(fitted) for fitted in fits]
    makers = []
    for number, fitted in enumerate(fits):
        makers.append(NaturalFrames(fitted))
        yield (number + 1) / (len(fits) + 1)
    return join(makers, KeyTimes.of(options, len(makers)).durations) if len(makers) > 1 else makers
