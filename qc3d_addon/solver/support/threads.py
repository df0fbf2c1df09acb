# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Independent pieces of work on all cores at once: numpy and scipy let go of the interpreter while they compute."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from itertools import chain, islice
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

# Beyond this the interpreter's lock and the memory's bandwidth leave nothing to gain.
_MOST_THREADS = 4


def thread_count() -> int:
    """How many pieces of work run at once: the cores that this process may use, at most four."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(cores, _MOST_THREADS)


@contextmanager
def beside(work: Callable[[], Result]) -> Iterator[Future[Result]]:
    """Begin ``work`` in a thread of its own, to go on with something else; after an error it is not waited for."""
    pool = ThreadPoolExecutor(1)
    try:
        yield pool.submit(work)
    except BaseException:
        pool.shutdown(wait=False)
        raise
    pool.shutdown()


def batches(items: Sequence[Item], most: int) -> list[Sequence[Item]]:
    """Items a few at a time, ``most`` at most, but no fewer batches than threads."""
    size = max(1, min(most, -(-len(items) // thread_count())))
    return [items[start : start + size] for start in range(0, len(items), size)]


def in_threads(work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """The results of ``work`` for each item, in the order of the items; only a few are begun ahead of their turn.

    Dropping the iterator ends the work after the pieces that have begun. What a piece raises is raised in its turn.
    """
    threads, remaining = thread_count(), iter(items)
    first = list(islice(remaining, 2))
    if len(first) < 2 or threads == 1:  # a thread would cost time and gain none
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
