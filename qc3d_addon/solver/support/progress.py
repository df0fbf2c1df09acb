# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress of long work.

Long work is a generator that yields ``Progress`` and returns its result. It can be dropped at any of its steps.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from typing import NamedTuple, TypeVar

T = TypeVar("T")
Step = TypeVar("Step")
Told = TypeVar("Told")


class Stage(NamedTuple):
    """A stage's label in the user interface, and its approximate share of the time of a one-pair bake, 0..1."""

    label: str
    share: float


# The stages of a fit are repeated for every pair of keys; those of the frames come once, at the end.
FIT_STAGES = {
    "mesh": Stage("Filling the volume", 0.45),
    "locate": Stage("Finding the surface in it", 0.02),
    "fit": Stage("Fitting the map", 0.28),
}
FRAME_STAGES = {
    "factor": Stage("Preparing the frames", 0.05),
    "frames": Stage("Making the frames", 0.2),
}
STAGES = FIT_STAGES | FRAME_STAGES


class Progress(NamedTuple):
    """How far the work is.

    Parameters
    ----------
    stage : str
        A key of ``STAGES``.
    fraction : float
        Finished share of that stage, 0..1.
    fit : int
        Index of the fit that the stage belongs to, from 0.
    fits : int
        Number of fits in all; the stages of the frames come after all of them.
    """

    stage: str
    fraction: float
    fit: int = 0
    fits: int = 1

    @property
    def overall(self) -> float:
        """Finished share of all the work, 0..1; it never decreases from one step to the next."""
        each = sum(stage.share for stage in FIT_STAGES.values())
        frames = sum(stage.share for stage in FRAME_STAGES.values())
        stages = FIT_STAGES if self.stage in FIT_STAGES else FRAME_STAGES
        before = (self.fit if stages is FIT_STAGES else self.fits) * each
        for name, stage in stages.items():
            if name == self.stage:
                return (before + stage.share * self.fraction) / (self.fits * each + frames)
            before += stage.share
        raise ValueError(f"{self.stage} is no stage")

    @property
    def label(self) -> str:
        """The stage's label, with the number of the fit if there are several."""
        label = STAGES[self.stage].label
        return f"{label} ({self.fit + 1} of {self.fits})" if self.fits > 1 and self.stage in FIT_STAGES else label


# What is told of progress; what it raises stops the work.
OnProgress = Callable[[Progress], object]


class Done(NamedTuple):
    """How far a run is.

    Parameters
    ----------
    ended, tasks : int
        Tasks that have ended, and all.
    overall : float
        Finished share of all the work, 0..1; it never decreases.
    """

    ended: int
    tasks: int
    overall: float

    @property
    def label(self) -> str:
        """What is being done, in words."""
        return f"{self.ended} of {self.tasks} keys done"


Steps = Generator[Progress, None, T]


def finish(steps: Generator[Step, None, T], on_progress: Callable[[Step], object] | None = None) -> T:
    """Run all steps and return their result; ``on_progress`` is called after each step.

    Examples
    --------
    >>> def work():
    ...     yield Progress("mesh", 0.5)
    ...     return "result"
    >>> finish(work(), lambda progress: print(progress.label))
    Filling the volume
    'result'
    """
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            result: T = stop.value
            return result
        if on_progress is not None:
            on_progress(progress)


def told(work: Generator[Step, None, T], progress: Callable[[Step], Told]) -> Generator[Told, None, T]:
    """The same work, with each of its steps translated by ``progress``."""
    while True:
        try:
            step = next(work)
        except StopIteration as stop:
            result: T = stop.value
            return result
        yield progress(step)


def staged(stage: str, work: Generator[float, None, T], share: tuple[int, int] = (0, 1)) -> Steps[T]:
    """Turn the fractions that ``work`` yields into progress of a stage.

    ``share`` = (index, count) says that the work is one of ``count`` equal pieces of the stage.
    """
    return told(work, lambda done: Progress(stage, (share[0] + done) / share[1]))


def numbered(steps: Steps[T], fit: int, fits: int) -> Steps[T]:
    """The same steps, with their fits numbered from ``fit`` on, out of ``fits`` in all."""
    return told(steps, lambda progress: progress._replace(fit=min(fit + progress.fit, fits), fits=fits))


@contextmanager
def timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Context manager that adds the time spent in its block to ``seconds[stage]``."""
    started = clock.perf_counter()
    yield
    seconds[stage] = seconds.get(stage, 0.0) + clock.perf_counter() - started
