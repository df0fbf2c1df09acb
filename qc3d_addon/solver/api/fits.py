# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A fit of two keys: made once, asked for frames often, kept in files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Unpack

from numpy.typing import ArrayLike

from .. import steps
from ..arrays import Floats
from ..collision.colliders import Collider
from ..errors import InputError
from ..fit.files import KeptMaps, read_maps, write_maps
from ..fit.fitted_map import FittedMap, Residual
from ..fit.storage import from_bytes, to_bytes
from ..frames.bake import Bake
from ..frames.chain import chain_frames
from ..frames.following import Following
from ..frames.modes import needs_fits
from ..maps.mapping import Mapping
from ..settings import Easing, FitChoices, FrameOptions, Mirror, Mode
from ..support.progress import OnProgress, Steps, finish

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
