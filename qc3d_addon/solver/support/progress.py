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

STAGES = ("mesh", "locate", "fit", "factor", "frames")


class Progress(NamedTuple):
    """Where the work is: the stage's name, one of ``STAGES``, and how much of that stage is done, 0..1."""

    stage: str
    fraction: float


Steps = Generator[Progress, None, T]


def finish(steps: Generator[Step, None, T], on_progress: Callable[[Step], None] | None = None) -> T:
    """Run steps to their end and return what they return."""
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            result: T = stop.value
            return result
        if on_progress is not None:
            on_progress(progress)


def staged(stage: str, work: Generator[float, None, T], share: tuple[int, int] = (0, 1)) -> Steps[T]:
    """Name the progress of a piece of work, which is the part ``share`` = (number, of so many) of its stage."""
    while True:
        try:
            done = next(work)
        except StopIteration as stop:
            result: T = stop.value
            return result
        yield Progress(stage, (share[0] + done) / share[1])


@contextmanager
def timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Note the seconds of what is done meanwhile under the stage's name."""
    started = clock.perf_counter()
    yield
    seconds[stage] = clock.perf_counter() - started
