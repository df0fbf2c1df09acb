# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames in one call: through several keys, of many keys of a base, of several meshes together."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Unpack

from numpy.typing import ArrayLike

from .. import steps
from ..collision.colliders import Collider
from ..errors import QC3DError
from ..frames.bake import Bake
from ..frames.task import Outcome
from ..settings import Easing, FitChoices, Mirror, Mode
from ..support.progress import Done, OnProgress


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
