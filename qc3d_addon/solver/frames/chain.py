# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From prepared keys to frames, as generators that report progress and can be dropped."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Floats, Ints
from ..collision.colliders import Collider, Guard, Obstacle
from ..errors import InputError
from ..fit.fitted_map import PreparedMap
from ..fit.preparation import prepare
from ..keys.keypair import KeyPair
from ..settings import Settings
from ..support.progress import STAGES, Progress, Steps, finish, staged, timed
from .easing import eased
from .frame import Frame
from .join import join
from .linear import LinearFrames
from .measures import measure
from .natural import NaturalFrames
from .report import bake_report

__all__ = [
    "STAGES",
    "Bake",
    "Progress",
    "Steps",
    "chain_inbetweens",
    "checked_times",
    "evenly_spaced",
    "finish",
    "inbetweens",
    "prepare",
    "require_chain",
    "split",
]


@dataclass(frozen=True, eq=False)
class Bake:
    """The frames of one bake.

    Parameters
    ----------
    times : (k,)
        0 is the first key, 1 the second.
    frames : (k, n, 3)
        Positions in the keys' own coordinates.
    report : dict
        Engine, counts, folds, residuals, times: plain values that can be written as JSON.
    measures : dict
        Distortion of each frame at each vertex by the name of the measure, (k, n) each.
    """

    times: Floats
    frames: Floats
    report: dict[str, Any]
    measures: dict[str, NDArray[np.float32]] = field(default_factory=dict)


def evenly_spaced(count: int) -> Floats:
    """(count + 2,) times of ``count`` in-betweens between the keys at 0 and 1.

    Raises
    ------
    InputError
        If the count is negative.
    """
    if count < 0:
        raise InputError(f"The number of in-betweens is {count}; it must be 0 or more.")
    return np.linspace(0.0, 1.0, count + 2)


def inbetweens(prepared: PreparedMap, times: ArrayLike, settings: Settings) -> Steps[Bake]:
    """Frames of a prepared pair at any times in 0..1; the keys themselves, bit for bit, at 0 and 1.

    Raises
    ------
    InputError
        If a time is outside 0..1.
    """
    return chain_inbetweens([prepared], times, settings)


def chain_inbetweens(
    prepared: Sequence[PreparedMap], times: ArrayLike, settings: Settings, collider: Collider | None = None
) -> Steps[Bake]:
    """Frames through several keys in a row; the keys themselves, bit for bit, where the time is theirs.

    Parameters
    ----------
    prepared : sequence of PreparedMap
        Consecutive pairs of one mesh: the second key of each is the first of the next.
    times : (k,)
        0 is the first key of all, 1 the last; every pair takes the same time before ``settings.easing``.
    settings : Settings
        In mode ``natural`` velocities are continuous at the inner keys; ``linear``, as published, turns corners there.
    collider : Collider, optional
        What the frames must not touch, at each key of the chain. Mode ``linear`` does not look at it.

    Raises
    ------
    InputError
        If a time is outside 0..1 or the pairs are not consecutive.
    """
    wanted = checked_times(times)
    require_chain([part.pair for part in prepared])
    seconds = _summed(part.seconds for part in prepared)
    obstacle = None
    if collider is not None:
        with timed(seconds, "colliders"):
            obstacle = yield from _followed(collider, wanted, settings)
    segments, local = split(eased(wanted, settings.easing), len(prepared))
    yield Progress("factor", 0.0)
    with timed(seconds, "factor"):
        makers = yield from staged("factor", _makers(prepared, settings))
    yield Progress("factor", 1.0)
    frames = np.empty((len(wanted), *prepared[0].pair.key0.shape))
    made: dict[int, Frame] = {}
    key_error = 0.0
    with timed(seconds, "frames"):
        for number, maker in enumerate(makers):
            members = np.flatnonzero(segments == number)
            share = (number, len(makers))
            guard = None if obstacle is None else Guard(obstacle, prepared[number].pair, number, members)
            produced = yield from staged("frames", maker.frames(local[members], guard), share)
            made.update(zip(members.tolist(), produced, strict=True))
            for index, frame in zip(members, produced, strict=True):
                frames[index] = frame.positions
            error = _replace_by_keys(frames, members, local, prepared[number].pair)
            key_error = max(key_error, error / prepared[number].pair.diagonal)
    yield Progress("frames", 1.0)
    ordered = [made[index] for index in range(len(wanted))]
    with timed(seconds, "measure"):
        measures, worst = measure(prepared, segments, frames, [frame.values for frame in ordered])
    notes = [note for part in prepared for note in part.notes] + [note for maker in makers for note in maker.notes]
    report = bake_report(prepared, settings, wanted, ordered, notes)
    if obstacle is not None:
        report |= obstacle.report(frames, prepared[0].pair.faces, report["notes"])
    report |= {"worst_stretch": worst, "key_error": key_error, "seconds": seconds}
    return Bake(wanted, frames, report, measures)


def checked_times(times: ArrayLike) -> Floats:
    """(k,) times of frames; raises InputError where they are no numbers from 0 to 1."""
    try:
        wanted = np.atleast_1d(np.asarray(times, dtype=np.float64))
    except (TypeError, ValueError) as reason:
        raise InputError("The times of the frames must be numbers.") from reason
    if wanted.ndim != 1 or not ((wanted >= 0.0) & (wanted <= 1.0)).all():
        raise InputError("The times of the frames must be a list of numbers from 0 (first key) to 1 (last key).")
    return wanted


def require_chain(pairs: Sequence[KeyPair]) -> None:
    """Raise InputError unless every pair begins with the key that ended the one before."""
    for left, right in pairwise(pairs):
        if not np.array_equal(left.key1, right.key0):
            raise InputError("The pairs of the chain do not meet: each must begin with the key that ended the last.")


class _FrameMaker(Protocol):
    """Makes the frames of one pair."""

    notes: tuple[str, ...]

    def frames(self, times: Floats, guard: Guard | None = None) -> Generator[float, None, list[Frame]]:
        """One frame for each of ``times`` (k,) in 0..1, kept off by ``guard``; yields the part that is done."""


def _followed(collider: Collider, times: Floats, settings: Settings) -> Steps[Obstacle]:
    """The collider at the times of the frames: where it is, or, where it moves, on its own natural way."""
    if not collider.moves:
        return Obstacle(collider, np.broadcast_to(collider.shapes[0], (len(times), *collider.shapes[0].shape)))
    prepared = []
    for pair in collider.pairs():
        prepared.append((yield from prepare(pair, settings)))
    bake = yield from chain_inbetweens(prepared, times, settings)
    return Obstacle(collider, bake.frames)


def _makers(prepared: Sequence[PreparedMap], settings: Settings) -> Generator[float, None, Sequence[_FrameMaker]]:
    """What makes the frames of each pair, joined so that velocities are continuous where the mode does that."""
    if settings.mode == "linear":
        return [LinearFrames(part) for part in prepared]
    makers = []
    for number, part in enumerate(prepared):
        makers.append(NaturalFrames(part, settings.stretch))
        yield (number + 1) / (len(prepared) + 1)
    return join(makers) if len(makers) > 1 else makers


def split(times: Floats, count: int) -> tuple[Ints, Floats]:
    """Number of the pair and time within it, 0..1, for times along a chain of ``count`` pairs."""
    along = times * count
    # Times like 1/3 are not exact: what is meant to be a key is one.
    whole = np.round(along)
    along = np.where(np.abs(along - whole) < 1e-9, whole, along)
    segments = np.minimum(np.floor(along), count - 1)
    return segments.astype(np.int64), along - segments


def _summed(parts: Iterable[dict[str, float]]) -> dict[str, float]:
    total: dict[str, float] = {}
    for part in parts:
        for stage, value in part.items():
            total[stage] = total.get(stage, 0.0) + value
    return total


def _replace_by_keys(frames: Floats, members: Ints, times: Floats, pair: KeyPair) -> float:
    """Put the keys themselves at 0 and 1; returns how far the frames computed there were from them."""
    error = 0.0
    for index in members:
        if times[index] in (0.0, 1.0):
            key = pair.key1 if times[index] else pair.key0
            error = max(error, float(np.abs(frames[index] - key).max()))
            frames[index] = key
    return error
