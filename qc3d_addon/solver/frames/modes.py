# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The one place that knows the modes: what makes the frames of each pair of a chain."""

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
from .linear import LinearFrames
from .natural import NaturalFrames
from .straight import StraightFrames


class FrameMaker(Protocol):
    """Makes the frames of one pair of keys."""

    notes: tuple[str, ...]

    def frames(self, times: Floats, resolver: CollisionResolver | None = None) -> Generator[float, None, list[Frame]]:
        """One frame for each of ``times`` (k,) in 0..1, clear of colliders; yields the part that is done."""


def needs_fits(mode: Mode) -> bool:
    """Whether frames of this mode are made from fitted maps."""
    return mode != "straight"


def frame_makers(
    pairs: Sequence[KeyPair], fits: Sequence[FittedMap], options: FrameOptions
) -> Generator[float, None, Sequence[FrameMaker]]:
    """What makes the frames of each pair, joined without a jerk at the keys between where the mode does that.

    Parameters
    ----------
    pairs : sequence of KeyPair
        Consecutive pairs of one mesh.
    fits : sequence of FittedMap
        A fit for each; not looked at in mode ``straight``.
    options : FrameOptions
    """
    if options.mode == "straight":
        return [StraightFrames(pair) for pair in pairs]
    if options.mode == "linear":
        return [LinearFrames(fitted) for fitted in fits]
    makers = []
    for number, fitted in enumerate(fits):
        makers.append(NaturalFrames(fitted))
        yield (number + 1) / (len(fits) + 1)
    return join(makers) if len(makers) > 1 else makers
