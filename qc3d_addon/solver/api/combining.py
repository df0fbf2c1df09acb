# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Several keys of a base at once: their combination, and which pairs need one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Unpack

from numpy.typing import ArrayLike

from .. import steps
from ..combinations.base import KeysOnBase
from ..combinations.combine import Combination
from ..combinations.verdicts import Verdict, verdicts
from ..settings import Between, FitChoices, Mirror
from ..support.progress import OnProgress


def combine(
    base: ArrayLike,
    keys: Sequence[ArrayLike],
    faces: ArrayLike,
    edges: ArrayLike | None = None,
    *,
    weights: Sequence[float] | None = None,
    order: Sequence[int] | None = None,
    between: Between = "auto",
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
        Weight of each key, 0..1; all 1 by default.
    order : sequence of int, optional
        Indices of the keys, outermost first: the motion of a key happens inside those before it. By default, the outer
        of two keys is the one that turns more where the other bends.
    between : Between
        What a key with a weight between 0 and 1 shows: its ``natural`` in-between, which needs a fit; or, with
        ``auto``, if the key is the pose of one joint by linear blend skinning, the pose with the joint turned as far.
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
    work = steps.combine(
        base, keys, faces, edges, weights=weights, order=order, between=between, mirror=mirror, **options
    )
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
