# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in threads: results in order, nothing started far ahead, errors in their turn."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count, islice
from threading import Event

import pytest

from qc3d_addon.solver.support.threads import ahead, alone, batches, beside, in_threads, thread_count


def test_results_come_in_the_order_of_the_items() -> None:
    for amount in (0, 1, 2, 50):
        assert list(in_threads(lambda number: number**2, range(amount))) == [number**2 for number in range(amount)]


def test_nothing_is_begun_far_ahead_and_dropping_ends_it() -> None:
    begun: list[int] = []

    def work(number: int) -> int:
        begun.append(number)
        return number

    results = in_threads(work, count())
    assert list(islice(results, 3)) == [0, 1, 2]
    assert isinstance(results, Iterator)
    results.close()  # type: ignore[attr-defined]
    assert len(begun) <= 3 + thread_count() + 1


def test_an_error_is_raised_in_its_turn() -> None:
    def work(number: int) -> float:
        return 1.0 / (2 - number)

    results = in_threads(work, range(5))
    assert next(results) == 0.5
    assert next(results) == 1.0
    with pytest.raises(ZeroDivisionError):
        next(results)


def test_batches_hold_everything_in_order_and_keep_all_threads_busy() -> None:
    for amount in range(20):
        parts = batches(range(amount), 4)
        assert [item for part in parts for item in part] == list(range(amount))
        assert max(map(len, parts), default=0) <= 4
        assert len(parts) >= min(amount, thread_count())


def test_what_goes_on_beside_ends_with_its_result_or_its_error() -> None:
    with beside(lambda: 3) as job:
        pass
    assert job.done()
    assert job.result() == 3
    with beside(lambda: 1 / 0) as job:
        pass
    with pytest.raises(ZeroDivisionError):
        job.result()


def test_after_an_error_nobody_waits_for_what_goes_on_beside() -> None:
    never = Event()
    with pytest.raises(KeyError), beside(never.wait):
        raise KeyError
    never.set()


def test_what_can_wait_is_not_done_ahead_where_threads_would_not_help() -> None:
    done: list[int] = []
    with alone(), ahead(lambda: done.append(1)) as job:
        assert job is None
    assert not done
    with ahead(lambda: 3) as job:
        pass
    assert job is None if thread_count() == 1 else job is not None and job.result() == 3
