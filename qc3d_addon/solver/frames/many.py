# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Carries out many tasks in one run: what keys of one base have in common is made once, and keys run on all cores."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..collision.crossings import CrossingSearch
from ..errors import QC3DError
from ..fit.volume import Volume
from ..keys.checks import require_sizes
from ..keys.embedding import Cube, Embedding
from ..keys.keypair import Ends, KeyPair
from ..settings import FitOptions
from ..support.memory import announce, give_back
from ..support.progress import Done
from ..support.threads import alone, thread_count
from .task import Outcome, Task, carry_out

# Larger meshes keep all cores busy by themselves, and two of them at once would take twice the memory.
_SMALL = 50_000  # vertices
_OF_BASE = ("key0", "faces", "edges", "polygons")
_MORE_OF_EACH = 0.5  # memory of each further task that runs at once, beside that of one
_SHARE_OF_BASE = 0.5  # time of what is made once for a base, beside that of a key


class Ended(NamedTuple):
    """A task has ended.

    Parameters
    ----------
    number : int
        Its number, from 0.
    outcome : Outcome or Exception
        The outcome, or why there is none.
    """

    number: int
    outcome: Outcome | Exception


@dataclass(frozen=True, eq=False)
class _Base:
    """A first key that several pairs have in common."""

    pair: KeyPair
    options: FitOptions

    def is_of(self, pair: KeyPair, options: FitOptions) -> bool:
        return (
            self.options == options
            and self.pair.planes == pair.planes
            and all(_equal(getattr(self.pair, name), getattr(pair, name)) for name in _OF_BASE)
        )

    def volume(self) -> Volume | None:
        """The volume around it; None if that cannot be made."""
        try:
            require_sizes(self.pair.key0, self.pair.key1)
            cube = Cube.around(self.pair)
            volume = Volume.filled(Embedding.of(self.pair, cube), self.options, cube)
            resting = replace(self.pair, key1=self.pair.key0)
            volume = replace(volume, search=CrossingSearch(resting.welded_faces, [volume.key0]))
        except QC3DError:
            return None  # each of the keys says why
        # All of it now: later, two threads might make the same.
        _ = volume.fitter, volume.system, volume.around_landmarks
        return volume


class _Bases:
    """The bases of the pairs that have to be fitted, as far as several tasks share them."""

    def __init__(self, tasks: Sequence[Task]) -> None:
        found: list[list[_Base]] = []
        for task in tasks:
            # The quality exact fills the cube around both keys.
            shares = task.needs_fits and task.fit_options.quality != "exact"
            for ends, pair in task.pairs.items() if shares else ():
                if ends in task.kept:
                    continue
                known = next((same for same in found if same[0].is_of(pair, task.fit_options)), None)
                if known is None:
                    found.append([])
                (found[-1] if known is None else known).append(_Base(pair, task.fit_options))
        self.shared = [same[0] for same in found if len(same) > 1]
        self._volumes: list[Volume | None] = []

    def make_next(self) -> None:
        """Make the volume around the next base."""
        self._volumes.append(self.shared[len(self._volumes)].volume())

    def around(self, pair: KeyPair, options: FitOptions) -> Volume | None:
        """The volume around the first key of a pair, if there is one."""
        found = (made for base, made in zip(self.shared, self._volumes, strict=True) if base.is_of(pair, options))
        return next(found, None)

    def sharing(self, pair: KeyPair, options: FitOptions) -> KeyPair:
        """A pair of its own, whose results are dropped with it, except for those that it shares with others."""
        base = next((base for base in self.shared if base.is_of(pair, options)), None)
        return replace(pair) if base is None else pair.sharing(base.pair)


@dataclass(frozen=True, eq=False)
class Run:
    """Tasks to carry out in one run; each ends with its own outcome or error.

    Parameters
    ----------
    tasks : tuple of Task
    memory_mb : float
        Memory that the run may take; 0 for no limit.
    """

    tasks: tuple[Task, ...]
    memory_mb: float = 0.0

    @classmethod
    def of(cls, tasks: Sequence[Task], memory_mb: float = 0.0) -> Run:
        """A run of these tasks, with arrays that are equal to those of the first held only once."""
        if not tasks:
            return cls((), memory_mb)
        like = next(iter(tasks[0].pairs.values()))
        return cls(tuple(replace(task, pairs=_sharing(task.pairs, like)) for task in tasks), memory_mb)

    def require_memory(self, limit_mb: float) -> None:
        """Raise InputError if a task needs more than ``limit_mb`` megabytes; 0 means no limit."""
        for task in self.tasks:
            task.require_memory(limit_mb)

    @property
    def at_once(self) -> int:
        """Number of tasks that run at once: small meshes keep only one core busy each."""
        vertices = max((len(pair.key0) for task in self.tasks for pair in task.pairs.values()), default=0)
        most = 1 if vertices > _SMALL else max(1, min(thread_count(), len(self.tasks)))
        while most > 1 and self.memory_mb and self._estimated_mb(most) > self.memory_mb:
            most -= 1
        return most

    @property
    def estimated_mb(self) -> float:
        """Estimated peak memory of the run, in megabytes."""
        return self._estimated_mb(self.at_once)

    def _estimated_mb(self, at_once: int) -> float:
        needed = max((task.estimated_mb for task in self.tasks), default=0.0)
        return needed * (1.0 + _MORE_OF_EACH * (at_once - 1))

    def carried_out(self, failures: tuple[type[Exception], ...] = (QC3DError,)) -> Generator[Done | Ended, None, None]:
        """Carry out the tasks; yield how far they are, and each outcome as soon as it is there.

        A task that fails ends with its error, and the others go on. Dropping the generator stops them all.

        Parameters
        ----------
        failures : tuple of exception types
            Errors that end only their task; others end the run.

        Notes
        -----
        Pairs with the same first key share a volume if their second key fits into its cube, which is larger than the
        first key by a quarter. Its tetrahedra are as fine as those of a single bake, but others, and so the frames are
        those of a single bake up to rounding; docs/science/speed.md has the differences.
        """
        bases = _Bases(self.tasks)
        count, units = len(self.tasks), len(self.tasks) + _SHARE_OF_BASE * len(bases.shared)
        for number in range(len(bases.shared)):
            yield Done(0, count, _SHARE_OF_BASE * number / units)
            bases.make_next()
        begun = units - count
        yield Done(0, count, begun / max(units, 1))
        parts, ended = np.zeros(count), 0
        for number, found in _beside_each_other(self.tasks, bases, self.at_once, failures):
            if isinstance(found, float):
                parts[number] = found
            else:
                parts[number] = 1.0
                ended += 1
                yield Ended(number, found)
            yield Done(ended, count, min(1.0, float(begun + parts.sum()) / units))

    def outcomes(self, on_progress: Callable[[Done], object] | None = None) -> list[Outcome | QC3DError]:
        """Carry out the tasks; the outcome of each, in their order, or why there is none."""
        found: dict[int, Outcome | QC3DError] = {}
        announce(self.estimated_mb)
        for step in self.carried_out():
            if isinstance(step, Done):
                if on_progress is not None:
                    on_progress(step)
            else:
                assert isinstance(step.outcome, (Outcome, QC3DError))
                found[step.number] = step.outcome
        return [found[number] for number in range(len(self.tasks))]


def _beside_each_other(
    tasks: Sequence[Task], bases: _Bases, at_once: int, failures: tuple[type[Exception], ...]
) -> Iterator[tuple[int, float | Outcome | Exception]]:
    """Carry out tasks in threads; yield the number of a task with its finished share, 0..1, or how it ended."""
    news: queue.SimpleQueue[tuple[int, float | Outcome | Exception] | BaseException] = queue.SimpleQueue()
    stop = threading.Event()

    def work(number: int) -> None:
        options = tasks[number].fit_options
        pairs = {ends: bases.sharing(pair, options) for ends, pair in tasks[number].pairs.items()}
        task = replace(tasks[number], pairs=pairs)
        try:
            with alone() if at_once > 1 else nullcontext():
                steps = carry_out(task, lambda pair: bases.around(pair, task.fit_options))
                while not stop.is_set():
                    try:
                        news.put((number, next(steps).overall))
                    except StopIteration as end:
                        news.put((number, end.value))
                        return
        except failures as error:
            news.put((number, error))
        except BaseException as error:  # raised again where the run was started
            news.put(error)

    def work_and_tidy_up(number: int) -> None:
        work(number)
        give_back()

    with ThreadPoolExecutor(at_once) as pool:
        for number in range(len(tasks)):
            pool.submit(work_and_tidy_up, number)
        try:
            ended = 0
            while ended < len(tasks):
                found = news.get()
                if isinstance(found, BaseException):
                    raise found
                ended += not isinstance(found[1], float)
                yield found
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)


def _sharing(pairs: dict[Ends, KeyPair], like: KeyPair) -> dict[Ends, KeyPair]:
    """The pairs, with arrays that are equal to those of another pair replaced by these."""
    found = {}
    for ends, pair in pairs.items():
        same = {name: getattr(like, name) for name in _OF_BASE if _equal(getattr(pair, name), getattr(like, name))}
        found[ends] = replace(pair, **same)
    return found


def _equal(first: NDArray[Any], second: NDArray[Any]) -> bool:
    return first is second or np.array_equal(first, second)
