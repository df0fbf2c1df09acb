# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From two keys to frames: prepare, fit, interpolate, as generators that report progress and can be dropped."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .continuation import follow_path
from .embedding import Embedding
from .errors import InputError
from .foldfree import FoldFreeFitter
from .keypair import KeyPair
from .linear import LinearFrames
from .location import interpolation_matrix
from .memory import peak_memory_mb
from .meshing import fill_cube
from .natural import NaturalFrames
from .prepared import PreparedMap
from .settings import Settings
from .surface_path import SurfacePath
from .tetmesh import Floats

T = TypeVar("T")


class Progress(NamedTuple):
    """Where the work is: the stage's name and how much of that stage is done, 0..1."""

    stage: str
    fraction: float


Steps = Generator[Progress, None, T]


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
    """

    times: Floats
    frames: Floats
    report: dict[str, Any]


def finish(steps: Steps[T], on_progress: Callable[[Progress], None] | None = None) -> T:
    """Run steps to their end and return what they return."""
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            result: T = stop.value
            return result
        if on_progress is not None:
            on_progress(progress)


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


def prepare(pair: KeyPair, settings: Settings) -> Steps[PreparedMap]:
    """Embed both keys, fill the cube and fit the fold-free map that carries the first key onto the second.

    Raises
    ------
    MeshingError
        If the engine asked for cannot fill the cube.
    FitError
        If no map without folds was found.
    """
    seconds: dict[str, float] = {}
    embedding = Embedding.of(pair)
    yield Progress("mesh", 0.0)
    with _timed(seconds, "mesh"):
        filled = fill_cube(embedding.key0, pair.faces, settings)
    yield Progress("mesh", 1.0)
    yield Progress("locate", 0.0)
    with _timed(seconds, "locate"):
        landmarks = interpolation_matrix(filled.mesh, embedding.key0)
    yield Progress("locate", 1.0)
    with _timed(seconds, "fit"):
        fitter = FoldFreeFitter(filled.mesh, landmarks, embedding.weights)
        path = SurfacePath(embedding, settings.stretch, settings.extra_turns)
        followed = yield from _staged("fit", follow_path(fitter, path, embedding.key1))
    yield Progress("fit", 1.0)
    return PreparedMap(
        pair,
        filled.mesh,
        followed.maps,
        followed.turns,
        settings.extra_turns,
        filled.engine,
        filled.notes,
        seconds,
    )


def inbetweens(prepared: PreparedMap, times: ArrayLike, settings: Settings) -> Steps[Bake]:
    """Frames of a prepared pair at any times in 0..1; the keys themselves, bit for bit, at 0 and 1.

    Raises
    ------
    InputError
        If a time is outside 0..1.
    """
    wanted = np.atleast_1d(np.asarray(times, dtype=np.float64))
    if wanted.ndim != 1 or not ((wanted >= 0.0) & (wanted <= 1.0)).all():
        raise InputError("The times of the frames must be a list of numbers from 0 (first key) to 1 (second key).")
    seconds = dict(prepared.seconds)
    yield Progress("factor", 0.0)
    with _timed(seconds, "factor"):
        maker = LinearFrames(prepared) if settings.mode == "linear" else NaturalFrames(prepared, settings.stretch)
    yield Progress("factor", 1.0)
    with _timed(seconds, "frames"):
        made = yield from _staged("frames", maker.frames(wanted))
    yield Progress("frames", 1.0)
    frames = np.stack([frame.positions for frame in made])
    key_error = _replace_by_keys(frames, wanted, prepared.pair) / prepared.pair.diagonal
    report = {
        "engine": prepared.engine,
        "mode": settings.mode,
        "stretch": settings.stretch,
        "quality": settings.quality,
        "vertices": len(prepared.pair.key0),
        "tetrahedra": len(prepared.mesh.tets),
        "folds": {"map": prepared.folds(prepared.mapped), "frames": [frame.folds for frame in made]},
        "certificates": [frame.certificate(float(time)) for frame, time in zip(made, wanted, strict=True)],
        "residual": prepared.landmark_residual(),
        "key_error": key_error,
        "seconds": seconds,
        "peak_memory_mb": peak_memory_mb(),
        "notes": [*prepared.notes, *maker.notes],
    }
    return Bake(wanted, frames, report)


def _replace_by_keys(frames: Floats, times: Floats, pair: KeyPair) -> float:
    """Put the keys themselves at 0 and 1; returns how far the frames computed there were from them."""
    error = 0.0
    for time, key in ((0.0, pair.key0), (1.0, pair.key1)):
        for index in np.flatnonzero(times == time):
            error = max(error, float(np.abs(frames[index] - key).max()))
            frames[index] = key
    return error


def _staged(stage: str, work: Generator[float, None, T]) -> Steps[T]:
    """Name the progress of a piece of work."""
    while True:
        try:
            done = next(work)
        except StopIteration as stop:
            result: T = stop.value
            return result
        yield Progress(stage, done)


@contextmanager
def _timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    started = clock.perf_counter()
    yield
    seconds[stage] = clock.perf_counter() - started
