# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Independent pieces of work in threads: numpy and scipy release the GIL while they compute."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from itertools import chain, islice
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

# Beyond four threads, the GIL and the memory bandwidth leave nothing to gain.
_MOST_THREADS = 4
_most_threads = _MOST_THREADS
_this_thread = threading.local()


def thread_count() -> int:
    """Number of pieces of work that run at once: the cores available to this process, at most four.

    It is 1 in a thread that is ``alone``, and may be fewer after ``use_at_most``.
    """
    if getattr(_this_thread, "is_alone", False):
        return 1
    return min(cores(), _most_threads)


def cores() -> int:
    """Number of cores available to this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def use_at_most(threads: int) -> None:
    """Let this process work with at most so many threads, because other processes use the other cores."""
    global _most_threads
    _most_threads = max(1, min(threads, _MOST_THREADS))


@contextmanager
def alone() -> Iterator[None]:
    """Context manager that lets this thread work by itself, because others beside it keep the cores busy."""
    _this_thread.is_alone = True
    try:
        yield
    finally:
        _this_thread.is_alone = False


@contextmanager
def beside(work: Callable[[], Result]) -> Iterator[Future[Result]]:
    """Context manager that runs ``work`` in another thread during its block, and gives its future.

    Leaving the block waits for the work, unless it is left by an exception. Where threads would not help, the work is
    done first.
    """
    if thread_count() == 1:
        done: Future[Result] = Future()
        done.set_result(work())
        yield done
        return
    pool = ThreadPoolExecutor(1)
    try:
        yield pool.submit(work)
    except BaseException:
        pool.shutdown(wait=False)
        raise
    pool.shutdown()


@contextmanager
def ahead(work: Callable[[], Result]) -> Iterator[Future[Result] | None]:
    """Context manager like ``beside`` for work that can be done later; None where threads would not help."""
    if thread_count() == 1:
        yield None
        return
    with beside(work) as done:
        yield done


def batches(items: Sequence[Item], most: int) -> list[Sequence[Item]]:
    """Items in batches of at most ``most``, and small enough that every thread gets one."""
    size = max(1, min(most, -(-len(items) // thread_count())))
    return [items[start : start + size] for start in range(0, len(items), size)]


def in_threads(work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Yield the results of ``work`` for all items, in their order; only a few are started ahead of their turn.

    Dropping the iterator finishes the pieces that have started and drops the others. An exception of a piece is raised
    when its turn comes.

    Examples
    --------
    >>> list(in_threads(abs, [-1, 2, -3]))
    [1, 2, 3]
    """
    threads, remaining = thread_count(), iter(items)
    first = list(islice(remaining, 2))
    if len(first) < 2 or threads == 1:  # threads would only cost time
        yield from map(work, chain(first, remaining))
        return
    with ThreadPoolExecutor(threads) as pool:
        running: deque[Future[Result]] = deque()
        try:
            for item in chain(first, remaining):
                running.append(pool.submit(work, item))
                if len(running) > threads:
                    yield running.popleft().result()
            while running:
                yield running.popleft().result()
        finally:
            for future in running:
                future.cancel()
