# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The public interface for scripts: arrays in, frames out. See docs/reference/python.md."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Unpack

from numpy.typing import ArrayLike

from . import steps
from .arrays import Floats
from .collision.colliders import Collider
from .combinations.base import KeysOnBase
from .combinations.combine import Combination
from .combinations.verdicts import Verdict, verdicts
from .errors import InputError, QC3DError
from .fit.files import KeptMaps, read_maps, write_maps
from .fit.fitted_map import FittedMap, Residual
from .fit.storage import from_bytes, to_bytes
from .frames.bake import Bake
from .frames.chain import chain_frames
from .frames.following import Following
from .frames.modes import needs_fits
from .frames.task import Outcome
from .maps.mapping import Mapping
from .settings import Easing, FitChoices, FitOptions, FrameOptions, Mirror, Mode
from .support.progress import Done, Progress, Steps, finish

__all__ = [
    "Collider",
    "Combination",
    "Fit",
    "FitOptions",
    "FrameOptions",
    "InputError",
    "QC3DError",
    "Verdict",
    "bake",
    "bake_keys",
    "bake_together",
    "combine",
    "fit",
    "judge_pairs",
    "load_fit",
    "steps",
]

OnProgress = Callable[[Progress], object]
_NAMES = ("first", "second")


@dataclass(frozen=True, eq=False)
class Fit:
    """Two keys and the fold-free map between them: fitted once, then asked for frames as often as needed.

    Parameters
    ----------
    fitted : FittedMap
    """

    fitted: FittedMap

    @property
    def mapping(self) -> Mapping:
        """The fitted map of the unit cube, with its mesh, Jacobians and representation."""
        return Mapping(self.fitted.mesh, self.fitted.mapped)

    @property
    def residual(self) -> Residual:
        """How far the map's landmarks are from the second key; in-betweens meet both keys all the same."""
        return self.fitted.landmark_residual()

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences for the user, such as why another engine was used."""
        return self.fitted.notes

    def inbetweens(
        self,
        frames: int | ArrayLike = 5,
        *,
        mode: Mode = "natural",
        easing: Easing = "linear",
        colliders: Sequence[Collider] = (),
        progress: OnProgress | None = None,
    ) -> Bake:
        """Frames between the two keys.

        Parameters
        ----------
        frames : int or (k,)
            Number of evenly spaced in-betweens, to which the two keys are added; or times in 0..1.
        mode, easing
            See ``FrameOptions``.
        colliders : sequence of Collider
            Surfaces that the frames must not enter.
        progress : callable
            Called with a ``Progress`` from time to time. An exception that it raises stops the work and is passed on.

        Returns
        -------
        Bake
            ``times`` (k,), ``frames`` (k, n, 3) in the keys' own coordinates, ``report``.

        Raises
        ------
        InputError
            If a time is outside 0..1 or an option is unknown.
        """
        options = FrameOptions(mode, easing)
        return finish(self._frames(steps.times_of(frames, 1, options), options, colliders), progress)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the fit to a file that ``load_fit`` and Blender's *Load Map* read; raises InputError if it cannot."""
        write_maps(Path(path), KeptMaps(_NAMES, self.fitted.options, {_NAMES: to_bytes(self.fitted)}))

    def _frames(self, times: Floats, options: FrameOptions, colliders: Sequence[Collider]) -> Steps[Bake]:
        collider, notes = None, []
        if colliders:
            joined = Collider.joined([part.at_keys(2) for part in colliders])
            following = Following(joined, times, self.fitted.options, options)
            collider, notes = (yield from following.posed()), following.notes
        fits = [self.fitted] if needs_fits(options.mode) else []
        made = yield from chain_frames([self.fitted.pair], fits, times, options, collider)
        made.report.notes += notes
        return made


def fit(
    key0: ArrayLike,
    key1: ArrayLike,
    faces: ArrayLike,
    edges: ArrayLike | None = None,
    *,
    polygons: ArrayLike | None = None,
    mirror: Mirror = "auto",
    progress: OnProgress | None = None,
    **options: Unpack[FitChoices],
) -> Fit:
    """Fit the fold-free map from one key to another: the slow part, done once.

    Parameters
    ----------
    key0, key1 : (n, 3)
        Positions of the same vertices in both keys.
    faces : (m, 3)
        Triangles.
    edges : (e, 2), optional
        Edges that belong to no triangle and keep their length.
    polygons : (m,), optional
        The polygon of each triangle; by default, two triangles that form a flat quad in all keys are one polygon.
    mirror : Mirror
        ``auto``: a mesh that is open on a plane through the origin in all keys counts as one half; it moves with its
        mirror image, and its seam stays closed. Otherwise ``none``, or the axes to mirror across, such as ``x`` or
        ``xy``.
    progress : callable
        Called with a ``Progress`` now and then. What it raises stops the work and is passed on.
    **options
        See ``FitOptions``: ``quality``, ``engine``, ``stretch``, ``extra_turns``, ``seed``.

    Raises
    ------
    InputError
        If the keys or the options cannot be used.
    MeshingError
        If the volume cannot be filled.

    Examples
    --------
    >>> import numpy as np, qc3d_addon as qc3d
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> fit = qc3d.fit(corners, corners @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], faces)
    >>> fit.inbetweens([0.5]).frames[0, 1, :2].round(1)
    array([0.7, 0.7])
    """
    work = steps.fit(key0, key1, faces, edges, polygons=polygons, mirror=mirror, **options)
    return Fit(work.run(progress))


def load_fit(
    path: str | os.PathLike[str],
    key0: ArrayLike,
    key1: ArrayLike,
    faces: ArrayLike,
    edges: ArrayLike | None = None,
    *,
    polygons: ArrayLike | None = None,
    mirror: Mirror = "auto",
) -> Fit:
    """Read a fit of these keys from a file that ``Fit.save`` or Blender's *Save Map* wrote.

    All other parameters are those of ``fit``.

    Raises
    ------
    InputError
        If the file cannot be read, or holds no fit of these keys.
    """
    pair = steps.one_pair(key0, key1, faces, edges, polygons, mirror)
    maps = read_maps(Path(path)).maps
    for number, data in enumerate(maps.values(), start=1):
        try:
            return Fit(from_bytes(data, pair))
        except InputError:
            if number == len(maps):
                raise
    raise InputError(f"{path} holds no maps; name another file.")


def bake(
    keys: Sequence[ArrayLike],
    faces: ArrayLike,
    frames: int | ArrayLike = 5,
    edges: ArrayLike | None = None,
    *,
    polygons: ArrayLike | None = None,
    mirror: Mirror = "auto",
    mode: Mode = "natural",
    easing: Easing = "linear",
    via_at: Sequence[float] = (),
    colliders: Sequence[Collider] = (),
    progress: OnProgress | None = None,
    **options: Unpack[FitChoices],
) -> Bake:
    """Compute frames through two or more keys in one call, without a stop at the inner keys.

    Parameters
    ----------
    keys : sequence of (n, 3)
        Shapes of one mesh, from the first to the last; the same array may be repeated.
    faces, edges, polygons, mirror
        See ``fit``.
    frames : int or (k,)
        Number of in-betweens between every two keys, to which the keys are added; or times, from 0 at the first key to
        1 at the last.
    mode, easing
        See ``FrameOptions``.
    via_at : sequence of float
        Times of the keys between the first and the last; by default, all pairs of keys take the same time.
    colliders : sequence of Collider
        Surfaces that the frames must not enter.
    progress : callable
        Called with a ``Progress`` now and then. What it raises stops the work and is passed on.
    **options
        See ``FitOptions``.

    Raises
    ------
    QC3DError
        If the keys or the options cannot be used, the volume cannot be filled, or memory would not do.

    Examples
    --------
    >>> import numpy as np, qc3d_addon as qc3d
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> qc3d.bake([corners, 2.0 * corners, corners], faces, frames=1).frames.shape
    (5, 4, 3)
    """
    work = steps.bake(
        keys,
        faces,
        frames,
        edges,
        polygons=polygons,
        mirror=mirror,
        mode=mode,
        easing=easing,
        via_at=via_at,
        colliders=colliders,
        **options,
    )
    return work.run(progress)


def bake_keys(
    base: ArrayLike,
    keys: Sequence[ArrayLike],
    faces: ArrayLike,
    frames: int | ArrayLike = 5,
    edges: ArrayLike | None = None,
    *,
    polygons: ArrayLike | None = None,
    mirror: Mirror = "auto",
    mode: Mode = "natural",
    easing: Easing = "linear",
    progress: Callable[[Done], object] | None = None,
    **options: Unpack[FitChoices],
) -> Iterator[tuple[int, Bake | QC3DError]]:
    """Bake many keys of one base in one run: what they have in common is made once, and they run on all cores.

    Parameters
    ----------
    base : (n, 3)
        The shape that the keys are relative to.
    keys : sequence of (n, 3)
    faces, frames, edges, polygons, mirror, mode, easing, **options
        See ``bake``; ``frames`` is for each key.
    progress : callable
        Called with a ``Done`` now and then: how many keys have ended, and the finished share ``overall``, 0..1.

    Yields
    ------
    (int, Bake or QC3DError)
        The index of a key and its frames, from the base to the key, as soon as they are there; or, for a key that
        cannot be baked, the error that says why. The others go on. Leaving the loop stops the work.

    Raises
    ------
    InputError
        If an option or the number of frames cannot be used.

    Examples
    --------
    >>> import numpy as np, qc3d_addon as qc3d
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> bakes = dict(qc3d.bake_keys(corners, [1.1 * corners, corners[:2]], faces, frames=1))
    >>> bakes[0].frames.shape
    (3, 4, 3)
    >>> str(bakes[1])
    'The keys have 4 and 2 vertices; both must be shapes of the same mesh.'
    """
    run, failed = steps.run_of_keys(
        base, keys, faces, frames, edges, polygons=polygons, mirror=mirror, mode=mode, easing=easing, **options
    )
    yield from failed.items()
    numbers = [number for number in range(len(keys)) if number not in failed]
    for step in run.carried_out():
        if isinstance(step, Done):
            if progress is not None:
                progress(step)
        elif isinstance(step.outcome, QC3DError):
            yield numbers[step.number], step.outcome
        else:
            assert isinstance(step.outcome, Outcome)
            assert step.outcome.bake is not None
            yield numbers[step.number], step.outcome.bake


def combine(
    base: ArrayLike,
    keys: Sequence[ArrayLike],
    faces: ArrayLike,
    edges: ArrayLike | None = None,
    *,
    weights: Sequence[float] | None = None,
    order: Sequence[int] | None = None,
    mirror: Mirror = "auto",
    progress: OnProgress | None = None,
    **options: Unpack[FitChoices],
) -> Combination:
    """Combine several keys of one base into the shape that they should make together.

    Parameters
    ----------
    base : (n, 3)
        The shape that the keys are relative to.
    keys : sequence of (n, 3)
        Two or more.
    faces, edges
        See ``fit``.
    weights : sequence of float, optional
        Weight of each key, 0..1; all 1 by default. Each weight between 0 and 1 needs a fit.
    order : sequence of int, optional
        Indices of the keys, outermost first: the motion of a key happens inside those before it. By default, the outer
        of two keys is the one that turns more where the other bends.
    mirror : Mirror
        See ``fit``: of a half mesh, the mirrored whole is combined, and its seam stays on the plane.
    progress : callable
        Called with a ``Progress`` now and then. What it raises stops the work and is passed on.
    **options
        See ``FitOptions``.

    Raises
    ------
    QC3DError
        If the keys, weights, order or options cannot be used, if the volume of a key with a weight between 0 and 1
        cannot be filled, or if memory would not be enough.

    Examples
    --------
    >>> import numpy as np, qc3d_addon as qc3d
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> turned, longer = corners @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], corners * [2.0, 1.0, 1.0]
    >>> qc3d.combine(corners, [turned, longer], faces).shape[1].round(6) + 0.0  # the sum has (1, 1, 0)
    array([0., 2., 0.])
    """
    work = steps.combine(base, keys, faces, edges, weights=weights, order=order, mirror=mirror, **options)
    return work.run(progress)


def judge_pairs(
    base: ArrayLike,
    keys: Sequence[ArrayLike],
    faces: ArrayLike,
    edges: ArrayLike | None = None,
    *,
    pairs: Sequence[tuple[int, int]] | None = None,
) -> Iterator[Verdict]:
    """Yield, for each pair of keys of one base, a verdict: is their sum right, or do they need a combination?

    Parameters
    ----------
    base, keys, faces, edges
        See ``combine``.
    pairs : sequence of (int, int), optional
        Indices of the keys of the pairs to judge; all pairs by default.

    Raises
    ------
    InputError
        If the keys cannot be used.

    Examples
    --------
    >>> import numpy as np, qc3d_addon as qc3d
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> turned, longer = corners @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], corners * [2.0, 1.0, 1.0]
    >>> [verdict.adding_is_right for verdict in qc3d.judge_pairs(corners, [turned, longer], faces)]
    [False]
    """
    return verdicts(KeysOnBase(base, keys, faces, edges), pairs)


def bake_together(
    meshes: Sequence[tuple[Sequence[ArrayLike], ArrayLike]],
    frames: int | ArrayLike = 5,
    *,
    mode: Mode = "natural",
    easing: Easing = "linear",
    via_at: Sequence[float] = (),
    progress: OnProgress | None = None,
    **options: Unpack[FitChoices],
) -> list[Bake]:
    """Frames of several meshes of one character in one map: what coincides in all keys stays together.

    Parameters
    ----------
    meshes : sequence of (keys, faces)
        Of each mesh its keys, (n, 3) each and equally many for all, in coordinates that all share, and its triangles.
    frames, mode, easing, via_at, progress, **options
        See ``bake``.

    Returns
    -------
    list of Bake
        Of each mesh. Notes, crossings and folds are those of all together.

    Raises
    ------
    QC3DError
        As ``bake``.

    Examples
    --------
    >>> import numpy as np, qc3d_addon as qc3d
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> bakes = qc3d.bake_together([([corners, 2.0 * corners], faces), ([-corners, corners], faces[:1])], frames=1)
    >>> [bake.frames.shape for bake in bakes]
    [(3, 4, 3), (3, 4, 3)]
    """
    return steps.bake_together(meshes, frames, mode=mode, easing=easing, via_at=via_at, **options).run(progress)
