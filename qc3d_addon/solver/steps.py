# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The functions of :mod:`.api` step by step, for user interfaces that show progress, stay responsive and can cancel::

    work = qc3d.steps.bake([rest, stride, rest], faces, frames=12)
    for step in work:
        show(step.label, step.overall)
    work.result.frames

Leaving the loop stops the work; nothing has to be cleaned up.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Generic, TypeVar, Unpack

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats
from .collision.colliders import Collider
from .combinations import mirrored
from .combinations.base import KeysOnBase
from .combinations.combine import Combination
from .errors import InputError, QC3DError
from .fit import fit_pair as fitting
from .fit.fitted_map import FittedMap
from .frames import task as tasks
from .frames.bake import Bake
from .frames.key_times import KeyTimes
from .frames.many import Run
from .frames.task import Outcome, Task
from .frames.together import PlacedMesh, Together
from .keys.keypair import KeyPair, consecutive_pairs
from .settings import Between, Easing, FitChoices, FitOptions, FrameOptions, Mirror, Mode
from .support.memory import machine_limit_mb
from .support.progress import OnProgress, Progress, Steps, finish
from .triangles.polygons import flat_quads

T = TypeVar("T")


class Work(Generic[T]):
    """Work that advances while one iterates over its steps.

    Attributes
    ----------
    result
        The result, after the last step; before that, an AttributeError.
    """

    result: T

    def __init__(self, steps: Steps[T]) -> None:
        self._steps = steps

    def __iter__(self) -> Iterator[Progress]:
        self.result = yield from self._steps

    def run(self, progress: OnProgress | None = None) -> T:
        """Run all steps, calling ``progress`` after each, and return the result."""
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
    """Validate two keys, given as for :func:`.api.fit`."""
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
    via_at: Sequence[float] = (),
    colliders: Sequence[Collider] = (),
    **options: Unpack[FitChoices],
) -> Work[Bake]:
    """The frames through a chain of keys, step by step; see :func:`.api.bake` for the parameters."""
    if len(keys) < 2:
        raise InputError(f"There are {len(keys)} keys; in-betweens need two or more.")
    shapes, through = _named(keys)
    frame_options = FrameOptions(mode, easing, tuple(via_at))
    task = Task.of_keys(
        shapes,
        faces,
        edges,
        through,
        FitOptions(**options),
        frame_options,
        times_of(frames, len(keys) - 1, frame_options),
        Collider.joined([part.at_keys(len(keys)) for part in colliders]) if colliders else None,
        polygons,
        mirror,
    )
    task.require_memory(machine_limit_mb())
    return Work(_bake_of(tasks.carry_out(task)))


def run_of_keys(
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
    **options: Unpack[FitChoices],
) -> tuple[Run, dict[int, QC3DError]]:
    """The run of many keys of one base, see :func:`.api.bake_keys`, and why keys are not in it, by their numbers."""
    ends = ("base", "key")
    frame_options = FrameOptions(mode, easing)
    choices = FitOptions(**options), frame_options, times_of(frames, 1, frame_options)
    usable: dict[int, KeyPair] = {}
    failed: dict[int, QC3DError] = {}
    for number, key in enumerate(keys):
        try:
            shapes = dict(zip(ends, (base, key), strict=True))
            usable[number] = consecutive_pairs(shapes, faces, edges, ends, polygons)[ends]
        except QC3DError as error:
            failed[number] = error
    tasks = {}
    for number, pair in usable.items():
        # Quads that are flat in all keys, so that all have the same covering and can share a volume.
        every = [pair.key0, *(other.key1 for other in usable.values())]
        if polygons is None:
            polygons = flat_quads(every, pair.faces)
        try:
            shapes = dict(zip(ends, (pair.key0, pair.key1), strict=True))
            task = Task.of_keys(shapes, faces, edges, ends, *choices, None, polygons, mirror)
            task.require_memory(machine_limit_mb())
            tasks[number] = task
        except QC3DError as error:
            failed[number] = error
    return Run.of(list(tasks.values()), machine_limit_mb()), failed


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
    **options: Unpack[FitChoices],
) -> Work[Combination]:
    """The combination of several keys, step by step; see :func:`.api.combine` for the parameters."""
    given = KeysOnBase(base, keys, faces, edges)
    return Work(mirrored.combine_halves(given, mirror, weights, order, FitOptions(**options), between))


def bake_together(
    meshes: Sequence[tuple[Sequence[ArrayLike], ArrayLike]],
    frames: int | ArrayLike = 5,
    *,
    mode: Mode = "natural",
    easing: Easing = "linear",
    via_at: Sequence[float] = (),
    **options: Unpack[FitChoices],
) -> Work[list[Bake]]:
    """The frames of several meshes in one map, step by step; see :func:`.api.bake_together` for the parameters."""
    counts = sorted({len(keys) for keys, _ in meshes})
    if len(counts) != 1 or counts[0] < 2:
        raise InputError(f"The meshes have {', '.join(map(str, counts)) or 'no'} keys; all need the same two or more.")
    through = tuple(f"key {number}" for number in range(counts[0]))
    placed = [
        PlacedMesh(consecutive_pairs(dict(zip(through, keys, strict=True)), faces, None, through), np.eye(4))
        for keys, faces in meshes
    ]
    together, frame_options = Together(placed), FrameOptions(mode, easing, tuple(via_at))
    times = times_of(frames, len(through) - 1, frame_options)
    task = Task(together.pairs, through, FitOptions(**options), frame_options, times)
    task.require_memory(machine_limit_mb())
    return Work(_apart(tasks.carry_out(task), together, frame_options, through))


def _apart(
    steps: Steps[Outcome], together: Together, options: FrameOptions, through: Sequence[str]
) -> Steps[list[Bake]]:
    bake = yield from _bake_of(steps)
    return together.apart(bake, options, through)


def times_of(frames: int | ArrayLike, pairs: int, options: FrameOptions) -> Floats:
    """(k,) times of the keys and of the given number of in-betweens between every two; or the given times."""
    key_times = KeyTimes.of(options, pairs)
    if isinstance(frames, (int, np.integer)) and not isinstance(frames, bool):
        return key_times.between(int(frames))
    return np.atleast_1d(np.asarray(frames, dtype=np.float64))


def _bake_of(steps: Steps[Outcome]) -> Steps[Bake]:
    outcome = yield from steps
    assert outcome.bake is not None
    return outcome.bake


def _named(keys: Sequence[ArrayLike]) -> tuple[dict[str, ArrayLike], tuple[str, ...]]:
    """A name for each key; the same array gets the same name, so that repeated pairs are fitted only once."""
    names: dict[int, str] = {}
    through = tuple(names.setdefault(id(key), f"key {number}") for number, key in enumerate(keys))
    return dict(zip(through, keys, strict=True)), through
