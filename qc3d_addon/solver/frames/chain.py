# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The frames of a chain of keys, with a report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats, Ints
from ..collision.colliders import CollisionResolver, PosedCollider
from ..fit.fitted_map import FittedMap, Residual
from ..fit.meeting import MET
from ..keys.halves import held_on_planes
from ..keys.keypair import KeyPair
from ..settings import FrameOptions
from ..support.memory import give_back, peak_memory_mb
from ..support.progress import Progress, Steps, staged, timed
from .bake import Bake, checked_times, require_chain
from .frame import Frame
from .key_times import KeyTimes
from .measures import measure, worst_stretch
from .modes import frame_makers, needs_fits
from .report import BakeReport, Folds, crossing_notes, embedding_notes, mirror_notes, welding_notes

_MANY = 100_000  # vertices: what was freed while everything was set up is a tenth of the memory


def chain_frames(
    pairs: Sequence[KeyPair],
    fits: Sequence[FittedMap],
    times: ArrayLike,
    options: FrameOptions,
    collider: PosedCollider | None = None,
) -> Steps[Bake]:
    """Compute the frames of a chain of two or more keys; at the time of a key, the frame is the key, bit for bit.

    Parameters
    ----------
    pairs : sequence of KeyPair
        Consecutive pairs of one mesh: the second key of each is the first of the next. Of a mirrored whole, frames are
        those of the mesh's own vertices.
    fits : sequence of FittedMap
        A fit for each pair; empty in mode ``straight``.
    times : (k,)
        0 is the first key of all, 1 the last; the options say when it is at the others.
    options : FrameOptions
        In mode ``natural`` velocities are continuous at the inner keys; the others turn corners there.
    collider : PosedCollider, optional
        What the frames must not touch, at the same times.

    Raises
    ------
    InputError
        If a time is outside 0..1 or the pairs are not consecutive.
    """
    wanted = checked_times(times)
    require_chain(pairs)
    seconds = _summed(fitted.seconds for fitted in fits)
    segments, local = KeyTimes.of(options, len(pairs)).split(wanted)
    yield Progress("factor", 0.0)
    with timed(seconds, "factor"):
        makers = yield from staged("factor", frame_makers(pairs, fits, options))
    yield Progress("factor", 1.0)
    if len(pairs[0].key0) > _MANY:
        give_back()
    made: dict[int, Frame] = {}
    key_error = 0.0
    with timed(seconds, "frames"):
        for number, maker in enumerate(makers):
            members = np.flatnonzero(segments == number)
            resolver = None if collider is None else CollisionResolver(collider, pairs[number], number, members)
            work = maker.frames(local[members], resolver)
            produced = yield from staged("frames", work, (number, len(makers)))
            made.update(zip(members.tolist(), produced, strict=True))
            key_error = max(key_error, _put_keys(made, members, local, pairs[number]) / pairs[number].diagonal)
    yield Progress("frames", 1.0)
    ordered = [made[index] for index in range(len(wanted))]
    frames = np.array([frame.positions for frame in ordered]).reshape(-1, *pairs[0].key0.shape)
    for frame, number, time in zip(frames, segments.tolist(), local.tolist(), strict=True):
        frame[...] = held_on_planes(frame, time, pairs[number].key0, pairs[number].key1, pairs[number].planes)
    measures = {}
    with timed(seconds, "measure"):
        worst = worst_stretch(pairs, segments, frames)
        if needs_fits(options.mode):
            measures = measure(fits, segments, frames, [frame.values for frame in ordered if frame.values is not None])
    crossings = [frame.crossings for frame in ordered]
    notes = [note for fitted in fits for note in fitted.notes] + [note for maker in makers for note in maker.notes]
    notes += mirror_notes(pairs[0]) + welding_notes(pairs) + crossing_notes(crossings, wanted)
    if fits and fits[0].options.quality == "exact":
        notes += embedding_notes([frame.certificate for frame in ordered if frame.certificate is not None], MET)
    notes += [pair.far_away for pair in pairs if pair.far_away is not None]
    report = BakeReport(
        engine=", ".join(dict.fromkeys(fitted.engine for fitted in fits)) or "none",
        mode=options.mode,
        easing=options.easing,
        stretch=fits[0].options.stretch if fits else None,
        quality=fits[0].options.quality if fits else None,
        vertices=len(pairs[0].key0),
        tetrahedra=sum(len(fitted.mesh.tets) for fitted in fits),
        welded=[len(pair.own.key0) - len(pair.own.welding[0]) for pair in pairs],
        folds=Folds(None, None),
        crossings=crossings,
        certificates=[frame.certificate for frame in ordered if frame.certificate is not None],
        residual=_largest([fitted.landmark_residual() for fitted in fits]),
        worst_stretch=worst,
        key_error=key_error,
        seconds=seconds,
        peak_memory_mb=peak_memory_mb(),
    )
    if fits:
        folds = [certificate.folds for certificate in report.certificates]
        report.folds = Folds(sum(fitted.folds(fitted.mapped) for fitted in fits), folds)
    if collider is not None:
        with timed(seconds, "colliders"):
            report.collider_crossings = collider.crossings(frames, pairs[0].faces)
        notes += crossing_notes(report.collider_crossings, wanted, "the colliders")
    report.notes = list(dict.fromkeys(notes))
    maps = tuple(frame.values for frame in ordered if frame.values is not None)
    return Bake(wanted, frames, report, measures, maps).of_first(len(pairs[0].own.key0))


def _put_keys(made: dict[int, Frame], members: Ints, times: Floats, pair: KeyPair) -> float:
    """Replace the frames at the times 0 and 1 by the keys; return the largest coordinate difference.

    Such a frame has no crossings beyond those of the key.
    """
    error = 0.0
    for index in members.tolist():
        if times[index] in (0.0, 1.0):
            key = pair.key1 if times[index] else pair.key0
            error = max(error, float(np.abs(made[index].positions - key).max()))
            made[index] = replace(made[index], positions=key, crossings=0)
    return error


def _largest(residuals: Sequence[Residual]) -> Residual | None:
    if not residuals:
        return None
    return Residual(max(one.rms for one in residuals), max(one.max for one in residuals))


def _summed(parts: Iterable[dict[str, float]]) -> dict[str, float]:
    total: dict[str, float] = {}
    for part in parts:
        for stage, value in part.items():
            total[stage] = total.get(stage, 0.0) + value
    return total
