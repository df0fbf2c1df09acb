# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The public door for scripts: arrays in, frames out. See docs/reference/python.md."""

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
from .maps.mapping import Mapping
from .settings import Easing, FitChoices, FitOptions, FrameOptions, Mirror, Mode
from .support.progress import Progress, Steps, finish

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
    """Two keys and the fold-free map that carries the first onto the second: made once, asked for frames often.

    Parameters
    ----------
    fitted : FittedMap
    """

    fitted: FittedMap

    @property
    def mapping(self) -> Mapping:
        """The map of the unit cube: mesh, images of its vertices, Jacobians, representation."""
        return Mapping(self.fitted.mesh, self.fitted.mapped)

    @property
    def residual(self) -> Residual:
        """How far the map leaves vertices from the second key; in-betweens meet both keys all the same."""
        return self.fitted.landmark_residual()

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences for the user, such as why another engine did the work."""
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
            The number of in-betweens, evenly spaced, the keys at both ends beside them; or times in 0..1.
        mode, easing
            See ``FrameOptions``.
        colliders : sequence of Collider
            What the frames must not touch.
        progress : callable
            Called with a ``Progress`` now and then. What it raises stops the work and is passed on.

        Returns
        -------
        Bake
            ``times`` (k,), ``frames`` (k, n, 3) in the keys' own coordinates, ``report``.

        Raises
        ------
        InputError
            If a time is outside 0..1 or an option is unknown.
        """
        return finish(self._frames(steps.times_of(frames), FrameOptions(mode, easing), colliders), progress)

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
    """Fit the fold-free map that carries one key onto another: the slow part, done once.

    Parameters
    ----------
    key0, key1 : (n, 3)
        Positions of the same vertices in both keys.
    faces : (m, 3)
        Triangles.
    edges : (e, 2), optional
        Edges to keep together that belong to no triangle.
    polygons : (m,), optional
        The polygon of each triangle; without it, two triangles that make a flat quad in all keys are one.
    mirror
        ``auto``: a mesh that is open on a plane through the origin, in all keys, is one half and moves with its mirror
        image; its seam stays shut. ``none``, or the axes to mirror across, such as ``x`` or ``xy``.
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

    All but the path as for ``fit``.

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
    colliders: Sequence[Collider] = (),
    progress: OnProgress | None = None,
    **options: Unpack[FitChoices],
) -> Bake:
    """Frames through two keys or more in one call, without a stop at the keys between.

    Parameters
    ----------
    keys : sequence of (n, 3)
        Shapes of one mesh, from the first to the last; the same array may come again.
    faces, edges, polygons, mirror
        See ``fit``.
    frames : int or (k,)
        The number of in-betweens between every two keys, the keys themselves beside them; or times, 0 the first key
        and 1 the last.
    mode, easing
        See ``FrameOptions``.
    colliders : sequence of Collider
        What the frames must not touch.
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
        colliders=colliders,
        **options,
    )
    return work.run(progress)


def combine(
    base: ArrayLike,
    keys: Sequence[ArrayLike],
    faces: ArrayLike,
    edges: ArrayLike | None = None,
    *,
    weights: Sequence[float] | None = None,
    order: Sequence[int] | None = None,
    progress: OnProgress | None = None,
    **options: Unpack[FitChoices],
) -> Combination:
    """The shape with several keys of one base on at once.

    Parameters
    ----------
    base : (n, 3)
        The shape that the keys are relative to.
    keys : sequence of (n, 3)
        Two or more.
    faces, edges
        See ``fit``.
    weights : sequence of float, optional
        How much each key is on, 0..1; all fully where none are given. One that is partly on takes a fit.
    order : sequence of int, optional
        Numbers of the keys, the outermost first: a key's motion happens inside those before it. Where it is not given
        it is found: the outer of two keys is the one that turns more where the other bends.
    progress : callable
        Called with a ``Progress`` now and then. What it raises stops the work and is passed on.
    **options
        See ``FitOptions``.

    Raises
    ------
    QC3DError
        If the keys, weights, order or options cannot be used, the volume of a key that is partly on cannot be filled,
        or memory would not do.
    """
    return steps.combine(base, keys, faces, edges, weights=weights, order=order, **options).run(progress)


def judge_pairs(
    base: ArrayLike,
    keys: Sequence[ArrayLike],
    faces: ArrayLike,
    edges: ArrayLike | None = None,
    *,
    pairs: Sequence[tuple[int, int]] | None = None,
) -> Iterator[Verdict]:
    """For every two keys of one base, one after the other: is their sum right, or does it need a combination?

    Parameters
    ----------
    base, keys, faces, edges
        See ``combine``.
    pairs : sequence of (int, int), optional
        Numbers of the keys, where not every two are asked for.

    Raises
    ------
    InputError
        If the keys cannot be used.
    """
    return verdicts(KeysOnBase(base, keys, faces, edges), pairs)
