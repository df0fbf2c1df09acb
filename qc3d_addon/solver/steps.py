# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The same work as :mod:`.api` in steps, for user interfaces that show progress, stay alive and can stop::

    work = qc3d.steps.bake([rest, stride, rest], faces, frames=12)
    for step in work:
        show(step.label, step.overall)
    work.result.frames

Leaving the loop stops the work; nothing has to be cleaned up.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Generic, TypeVar, Unpack

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats
from .collision.colliders import Collider
from .combinations import combine as combining
from .combinations.base import KeysOnBase
from .combinations.combine import Combination
from .errors import InputError
from .fit import fit_pair as fitting
from .fit.fitted_map import FittedMap
from .frames import task as tasks
from .frames.bake import Bake, evenly_spaced
from .frames.task import Outcome, Task
from .keys.keypair import KeyPair, consecutive_pairs
from .settings import Easing, FitChoices, FitOptions, FrameOptions, Mirror, Mode
from .support.memory import machine_limit_mb
from .support.progress import Progress, Steps, finish

T = TypeVar("T")


class Work(Generic[T]):
    """Work that goes on while its steps are asked for.

    Attributes
    ----------
    result
        What came of it.

    Raises
    ------
    AttributeError
        Where the result is asked for before the last step.
    """

    result: T

    def __init__(self, steps: Steps[T]) -> None:
        self._steps = steps

    def __iter__(self) -> Iterator[Progress]:
        self.result = yield from self._steps

    def run(self, progress: Callable[[Progress], object] | None = None) -> T:
        """Go through all steps, calling ``progress`` with each, and return the result."""
        self.result = finish(self._steps, progress)
        return self.result


def fit(
    key0: ArrayLike,
    key1: ArrayLike,
    faces: ArrayLike,
    edges: ArrayLike | None = None,
    *,
    polygons: ArrayLike | None = None,
    mirror: Mirror = "auto",
    **options: Unpack[FitChoices],
) -> Work[FittedMap]:
    """The fit of two keys, step by step; see :func:`.api.fit` for the parameters."""
    return Work(fitting.fit_pair(one_pair(key0, key1, faces, edges, polygons, mirror), FitOptions(**options)))


def one_pair(
    key0: ArrayLike,
    key1: ArrayLike,
    faces: ArrayLike,
    edges: ArrayLike | None,
    polygons: ArrayLike | None,
    mirror: Mirror,
) -> KeyPair:
    """Two keys as :func:`.api.fit` takes them."""
    ends = ("first", "second")
    shapes = dict(zip(ends, (key0, key1), strict=True))
    return consecutive_pairs(shapes, faces, edges, ends, polygons, mirror)[ends]


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
    **options: Unpack[FitChoices],
) -> Work[Bake]:
    """The frames through a row of keys, step by step; see :func:`.api.bake` for the parameters."""
    if len(keys) < 2:
        raise InputError(f"There are {len(keys)} keys; in-betweens need two or more.")
    shapes, through = _named(keys)
    task = Task.of_keys(
        shapes,
        faces,
        edges,
        through,
        FitOptions(**options),
        FrameOptions(mode, easing),
        times_of(frames, len(keys) - 1),
        Collider.joined([part.at_keys(len(keys)) for part in colliders]) if colliders else None,
        polygons,
        mirror,
    )
    task.require_memory(machine_limit_mb())
    return Work(_bake_of(tasks.carry_out(task)))


def combine(
    base: ArrayLike,
    keys: Sequence[ArrayLike],
    faces: ArrayLike,
    edges: ArrayLike | None = None,
    *,
    weights: Sequence[float] | None = None,
    order: Sequence[int] | None = None,
    **options: Unpack[FitChoices],
) -> Work[Combination]:
    """Several keys of one base on at once, step by step; see :func:`.api.combine` for the parameters."""
    return Work(combining.combine(KeysOnBase(base, keys, faces, edges), weights, order, FitOptions(**options)))


def times_of(frames: int | ArrayLike, pairs: int = 1) -> Floats:
    """Times of so many in-betweens between every two keys and of the keys themselves, or the times that are given."""
    if isinstance(frames, (int, np.integer)) and not isinstance(frames, bool):
        return evenly_spaced((int(frames) + 1) * pairs - 1)
    return np.atleast_1d(np.asarray(frames, dtype=np.float64))


def _bake_of(steps: Steps[Outcome]) -> Steps[Bake]:
    outcome = yield from steps
    assert outcome.bake is not None
    return outcome.bake


def _named(keys: Sequence[ArrayLike]) -> tuple[dict[str, ArrayLike], tuple[str, ...]]:
    """A name for every key, the same where the very same array comes again: its pairs are then fitted once."""
    names: dict[int, str] = {}
    through = tuple(names.setdefault(id(key), f"key {number}") for number, key in enumerate(keys))
    return dict(zip(through, keys, strict=True)), through
