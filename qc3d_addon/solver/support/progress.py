# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Long work as generators that say how far it is, can be dropped at any of their steps, and time their stages."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from typing import NamedTuple, TypeVar

T = TypeVar("T")
Step = TypeVar("Step")


class Stage(NamedTuple):
    """What a stage is called, and about how much of a bake of one pair of keys it takes, 0..1."""

    label: str
    share: float


# The stages of a fit, which come again for every pair of keys, and those of frames, which come once.
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
    """Where the work is.

    Parameters
    ----------
    stage
        One of ``STAGES``.
    fraction
        How much of that stage is done, 0..1.
    fit, fits
        Number of the fit that the stage belongs to, 0 the first, and how many there are in all; stages of frames come
        after all of them.
    """

    stage: str
    fraction: float
    fit: int = 0
    fits: int = 1

    @property
    def overall(self) -> float:
        """How much of all the work is done, 0..1; it never falls."""
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
        """The stage in words, with the number of the fit where there are several."""
        label = STAGES[self.stage].label
        return f"{label} ({self.fit + 1} of {self.fits})" if self.fits > 1 and self.stage in FIT_STAGES else label


Steps = Generator[Progress, None, T]


def finish(steps: Generator[Step, None, T], on_progress: Callable[[Step], object] | None = None) -> T:
    """Run steps to their end and return what they return."""
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            result: T = stop.value
            return result
        if on_progress is not None:
            on_progress(progress)


def told(work: Generator[Step, None, T], progress: Callable[[Step], Progress]) -> Steps[T]:
    """Run work to its end, telling each of its steps as ``progress`` puts it."""
    while True:
        try:
            step = next(work)
        except StopIteration as stop:
            result: T = stop.value
            return result
        yield progress(step)


def staged(stage: str, work: Generator[float, None, T], share: tuple[int, int] = (0, 1)) -> Steps[T]:
    """Name the progress of a piece of work, which is the part ``share`` = (number, of so many) of its stage."""
    return told(work, lambda done: Progress(stage, (share[0] + done) / share[1]))


def numbered(steps: Steps[T], fit: int, fits: int) -> Steps[T]:
    """The same steps as those of fits from number ``fit`` on, of so many in all."""
    return told(steps, lambda progress: progress._replace(fit=min(fit + progress.fit, fits), fits=fits))


@contextmanager
def timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Add the seconds of what is done meanwhile to those of the stage's name."""
    started = clock.perf_counter()
    yield
    seconds[stage] = seconds.get(stage, 0.0) + clock.perf_counter() - started
