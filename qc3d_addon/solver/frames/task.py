# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tasks: which keys to go through, which fits are known, and which frames to compute, as plain arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..collision.colliders import Collider
from ..errors import naming_pair
from ..fit.fit_pair import fit_pair
from ..fit.fitted_map import FittedMap
from ..fit.recent import RecentFits
from ..fit.storage import from_bytes, to_bytes
from ..fit.volume import Volume
from ..keys.halves import MirrorPlane
from ..keys.keypair import Ends, KeyPair, consecutive_pairs
from ..settings import FitOptions, FrameOptions, Mirror, PlayOptions
from ..support.memory import estimated_mb, require_memory
from ..support.progress import Steps, numbered, timed
from ..support.threads import beside
from .bake import Bake, checked_times
from .chain import chain_frames
from .following import Following
from .modes import needs_fits
from .played import Moments, played


@dataclass(frozen=True, eq=False)
class Task:
    """What to compute, checked when it is made.

    Parameters
    ----------
    pairs : dict
        The pairs of consecutive keys, by the names of the two keys.
    through : tuple of str
        Names of the keys from the first to the last.
    fit_options : FitOptions
    frame_options : FrameOptions
    times : (k,)
        Times of the frames, from 0 at the first key to 1 at the last; empty if only the fits are wanted.
    kept : dict
        Stored fits, by the names of their keys, that need not be computed again.
    collider : Collider, optional
        The collider at each of the keys ``through``.
    play : PlayOptions, optional
        Where given, the frames are those that a control needs to play the motion, in place of those at ``times``, and
        the report says what it plays between them.
    """

    pairs: dict[Ends, KeyPair]
    through: tuple[str, ...]
    fit_options: FitOptions = field(default_factory=FitOptions)
    frame_options: FrameOptions = field(default_factory=FrameOptions)
    times: Floats = field(default_factory=lambda: np.empty(0))
    kept: dict[Ends, bytes] = field(default_factory=dict)
    collider: Collider | None = None
    play: PlayOptions | None = None

    @classmethod
    def of_keys(
        cls,
        shapes: Mapping[str, ArrayLike],
        faces: ArrayLike,
        edges: ArrayLike | None,
        through: Sequence[str],
        fit_options: FitOptions | None = None,
        frame_options: FrameOptions | None = None,
        times: ArrayLike = (),
        collider: Collider | None = None,
        polygons: ArrayLike | None = None,
        mirror: Mirror | Sequence[MirrorPlane] = "auto",
    ) -> Task:
        """A task from the shapes (n, 3) of the keys by name, the triangles (m, 3) and the loose edges (e, 2).

        ``polygons`` (m,) and ``mirror`` are those of ``consecutive_pairs``.

        Raises
        ------
        InputError
            If two keys that follow each other cannot be used.
        """
        return cls(
            consecutive_pairs(shapes, faces, edges, through, polygons, mirror),
            tuple(through),
            fit_options or FitOptions(),
            frame_options or FrameOptions(),
            np.asarray(times, dtype=np.float64),
            collider=collider,
        )

    @property
    def needs_fits(self) -> bool:
        """Whether fits are wanted: for frames of all modes but ``straight``, or for themselves."""
        return needs_fits(self.frame_options.mode) or not self.frame_count

    @cached_property
    def moments(self) -> Moments | None:
        """The moments that ``play`` needs."""
        return None if self.play is None else Moments.of(self.play, self.frame_options, len(self.through) - 1)

    @property
    def frame_count(self) -> int:
        """Number of frames to compute."""
        return len(self.times) if self.moments is None else len(self.moments.times)

    @property
    def new_fits(self) -> int:
        """Number of fits of the mesh to compute."""
        return len(self.pairs) - len(self.kept) if self.needs_fits else 0

    @property
    def estimated_mb(self) -> float:
        """Estimated peak memory of the work, in megabytes."""
        pair, quality = next(iter(self.pairs.values())), self.fit_options.quality
        vertices, triangles = len(pair.key0), len(pair.faces)
        moving = max(float((pair.key0 != pair.key1).any(axis=1).mean()) for pair in self.pairs.values())
        return estimated_mb(
            vertices, len(self.pairs), self.frame_count, quality, self.needs_fits, triangles, moving
        )

    def require_memory(self, limit_mb: float) -> None:
        """Raise InputError, before the work starts, if it needs more than ``limit_mb`` megabytes; 0 means no limit."""
        if limit_mb:
            require_memory(self.estimated_mb, limit_mb, len(next(iter(self.pairs.values())).key0))

    def carried_out(self, recent: RecentFits | None = None) -> Steps[Outcome]:
        """See ``carry_out``."""
        return carry_out(self, recent=recent)


@dataclass(frozen=True, eq=False)
class Outcome:
    """The outcome of a task.

    Parameters
    ----------
    fits : dict
        The stored fit of each pair, by the names of its keys; empty if the task needs no fits.
    bake : Bake or None
        The frames; None if none were wanted.
    """

    fits: dict[Ends, bytes]
    bake: Bake | None


def carry_out(
    task: Task,
    shared: Callable[[KeyPair], Volume | None] = lambda pair: None,
    recent: RecentFits | None = None,
) -> Steps[Outcome]:
    """Compute the missing fits, then the frames. All bakes go this way.

    Parameters
    ----------
    task : Task
    shared : callable
        Returns the volume around the first key of a pair, if other tasks made it already.
    recent : RecentFits, optional
        Where maps are looked for, and remembered for the next task.

    Raises
    ------
    QC3DError
        If a kept fit is damaged or belongs to other keys, a fit cannot be made, or a time is outside 0..1.
    """
    times = checked_times(task.times if task.moments is None else task.moments.times)  # before the slow part
    following = None
    if task.collider is not None and len(times):
        following = Following(task.collider, times, task.fit_options, task.frame_options)
    every = task.new_fits + (following.fits if following is not None else 0)
    fits: dict[Ends, FittedMap] = {}
    made = 0
    names = list(dict.fromkeys(task.through))
    for ends, pair in task.pairs.items() if task.needs_fits else ():
        with naming_pair(*ends, names):
            data = task.kept.get(ends)
            if data is None:
                fits[ends] = yield from numbered(fit_pair(pair, task.fit_options, shared(pair)), made, every)
                made += 1
            else:
                fits[ends] = from_bytes(data, pair) if recent is None else recent.restored(data, pair)
    with beside(partial(_stored, fits, task.kept, recent)) as stored:
        bake = (yield from _baked(task, times, fits, following, every)) if len(times) else None
    return Outcome(stored.result(), bake)


def _stored(
    fits: Mapping[Ends, FittedMap], kept: Mapping[Ends, bytes], recent: RecentFits | None
) -> dict[Ends, bytes]:
    """The stored fits, those that are new stored and remembered now."""
    stored = {ends: kept[ends] if ends in kept else to_bytes(fitted) for ends, fitted in fits.items()}
    if recent is not None:
        for ends in fits.keys() - kept.keys():
            recent.keep(stored[ends], fits[ends])
    return stored


def _baked(
    task: Task, times: Floats, fits: Mapping[Ends, FittedMap], following: Following | None, every: int
) -> Steps[Bake]:
    """The frames, by the fits of the pairs; ``every`` is the number of fits that came before."""
    collider = None
    if following is not None:
        collider = yield from numbered(following.posed(), task.new_fits, every)
    along = list(pairwise(task.through))
    pairs, fitted = [task.pairs[ends] for ends in along], [fits[ends] for ends in along if ends in fits]
    bake = yield from numbered(chain_frames(pairs, fitted, times, task.frame_options, collider), every, every)
    if following is not None:
        bake.report.notes += following.notes
    if task.play is not None and task.moments is not None:
        with timed(bake.report.seconds, "played"):
            own = [pair.own for pair in pairs]
            bake = played(bake, task.moments, own, fitted, task.play, task.frame_options)
    return bake
