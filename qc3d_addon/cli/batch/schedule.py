# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The order in which jobs run, and how each one ended."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import suppress

from ...solver.errors import InputError
from .job import Job
from .orders import Ended, HowEnded, Order
from .pools import Pool, lost
from .records import State

_TURN_SECONDS = 1.0  # some systems see Ctrl-C only between two waits


class Schedule:
    """Jobs of a batch on their way.

    Parameters
    ----------
    jobs : sequence of Job
        Those to do; a job that reads the result of another one begins when that has ended.
    state : State
        Tells what is done already.
    pool : Pool
    order : callable
        Returns the order for a job.
    on_end : callable
        Called with each job and how it ended.
    """

    def __init__(
        self,
        jobs: Sequence[Job],
        state: State,
        pool: Pool,
        order: Callable[[Job], Order],
        on_end: Callable[[Job, Ended], object],
    ) -> None:
        self.ended: dict[int, Ended] = {}
        self._jobs = jobs
        self._state = state
        self._pool = pool
        self._order = order
        self._on_end = on_end
        self._running: dict[Future[Ended], Job] = {}

    def run(self) -> None:
        """Carry out all jobs; a KeyboardInterrupt leaves those that have not ended to ``stop``."""
        numbers = {job.number for job in self._jobs}
        for job in self._jobs:
            if job.after not in numbers:
                self._begin(job)
        while self._running:
            done, _ = wait(self._running, _TURN_SECONDS, FIRST_COMPLETED)
            for future in done:
                job = self._running.pop(future)
                self._end(job, self._result(future, job))
            if not done and not self._pool.is_there():
                gone = list(self._running.values())
                self._running.clear()
                for job in gone:
                    self._end(job, self._given_up(job, ConnectionError("the scheduler is gone")))

    def stop(self, batch: str) -> None:
        """End the jobs that run; those that ended meanwhile count as that, also if only their records tell."""
        self._pool.stop(batch)
        for future, job in self._running.items():
            if future.done() and not future.cancelled():
                with suppress(Exception):  # it was stopped
                    self._end(job, future.result(), goes_on=False)
        begun = {job.number for job in self._running.values()}
        for job in self._jobs:
            if job.number not in self.ended:
                told = self._known(job, "done") if job.number in begun else None
                self._end(job, told or Ended("stopped"), goes_on=False)

    def _begin(self, job: Job) -> None:
        known = self._known(job, "resumed")
        if known is None:
            self._running[self._pool.submit(self._order(job))] = job
        else:
            self._end(job, known)

    def _result(self, future: Future[Ended], job: Job) -> Ended:
        try:
            return future.result()
        except Exception as error:  # whatever a cluster raises when it gives a job up
            return self._given_up(job, error)

    def _given_up(self, job: Job, error: Exception) -> Ended:
        """How a job ended of which its place says no more: its record tells whether it was done before."""
        return self._known(job, "done") or Ended.failed(lost(error))

    def _known(self, job: Job, how: HowEnded) -> Ended | None:
        """The end of a job by its record, as one of that kind; None if it has none."""
        known = self._state.record(job)
        return None if known is None else Ended(how, None, known.seconds, known.peak_memory_mb)

    def _end(self, job: Job, ended: Ended, goes_on: bool = True) -> None:
        self.ended[job.number] = ended
        self._on_end(job, ended)
        for following in self._following(job) if goes_on else ():
            if ended.how in ("done", "resumed"):
                self._begin(following)
            else:
                self._end(
                    following,
                    Ended.failed(InputError(f"Its file is made by {job.name!r}, which failed; see there.")),
                )

    def _following(self, job: Job) -> Iterator[Job]:
        return (other for other in self._jobs if other.after == job.number)
