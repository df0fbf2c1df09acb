# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where jobs run: in processes of this machine, or on a Dask cluster."""

from __future__ import annotations

import importlib
import math
from collections import Counter
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

from ...solver.errors import InputError, WorkerError, reason
from ...solver.support.threads import cores
from . import children
from .orders import Ended, Order

if TYPE_CHECKING:
    from types import ModuleType

_SECONDS_TO_CONNECT = 20


class Pool(Protocol):
    """A place where jobs run."""

    def submit(self, order: Order) -> Future[Ended]:
        """Let a job run as soon as there is room."""

    def is_there(self) -> bool:
        """Whether jobs can still come to an end there."""

    def stop(self, batch: str) -> None:
        """End all jobs of a batch."""

    def close(self) -> None:
        """Leave the place."""


class Processes:
    """Processes of this machine.

    Parameters
    ----------
    count : int
        Number of jobs that run at once.
    """

    def __init__(self, count: int) -> None:
        self._executor: Executor = ThreadPoolExecutor(count)

    def submit(self, order: Order) -> Future[Ended]:
        """Let a job run as soon as there is room."""
        return self._executor.submit(children.carry_out, order)

    def is_there(self) -> bool:
        """Whether jobs can still come to an end there."""
        return True

    def stop(self, batch: str) -> None:
        """End all jobs of a batch."""
        children.end_all(batch)
        self._executor.shutdown()

    def close(self) -> None:
        """Leave the place."""
        self._executor.shutdown(cancel_futures=True)


class Cluster:
    """The workers of a Dask cluster, each of which runs as many jobs at once as it has threads.

    A job whose worker is lost is carried out by another one, unless its result was there already. All machines must
    have this version of QC3D, and the files under the same paths.

    Parameters
    ----------
    address : str
        Of the scheduler, such as ``tcp://farm:8786``.

    Raises
    ------
    InputError
        If dask.distributed is not installed, or nobody answers.
    """

    def __init__(self, address: str) -> None:
        self._distributed = _distributed()
        try:
            self._client: Any = self._distributed.Client(address, timeout=_SECONDS_TO_CONNECT, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise InputError(f"No Dask scheduler answers at {address}: {reason(error)}; start one there.") from error
        workers = self._client.scheduler_info(n_workers=-1)["workers"].values()
        self._at_once = Counter[str]()
        for worker in workers:
            self._at_once[worker["host"]] += worker["nthreads"]
        if not self._at_once:
            self._client.close()
            raise InputError(f"The Dask scheduler at {address} has no workers; start some.")
        self._executor = self._client.get_executor(pure=False)

    @property
    def count(self) -> int:
        """Number of jobs that run at once."""
        return sum(self._at_once.values())

    def submit(self, order: Order) -> Future[Ended]:
        """Let a job run as soon as there is room."""
        future: Future[Ended] = self._executor.submit(_on_worker, order, dict(self._at_once))
        return future

    def is_there(self) -> bool:
        """Whether jobs can still come to an end there: the scheduler answers, or is being looked for."""
        return self._client.status not in ("closing", "closed")

    def stop(self, batch: str) -> None:
        """End all jobs of a batch."""
        self._executor.shutdown(wait=False)  # those that wait are canceled
        self._client.run(children.end_all, batch, on_error="ignore")

    def close(self) -> None:
        """Leave the place."""
        self._client.close()


def _distributed() -> ModuleType:
    try:
        return importlib.import_module("distributed")
    except ImportError as error:
        raise InputError(
            "The option --dask needs dask.distributed, which is not installed for this Python; install it by "
            'pip install "qc3d[dask]".'
        ) from error


def _on_worker(order: Order, at_once: dict[str, int]) -> Ended:
    """Carry out a job on a worker, with its share of the machine's cores, and within the worker's memory."""
    worker = _distributed().get_worker()
    host = worker.address.rpartition("//")[2].rpartition(":")[0]
    threads = max(1, cores() // max(1, at_once.get(host, worker.state.nthreads)))
    limit = worker.memory_manager.memory_limit
    limit_mb = math.floor(limit / 2**20) if limit else order.limit_mb
    return children.carry_out(replace(order, threads=threads, limit_mb=limit_mb))


def lost(error: BaseException) -> WorkerError:
    """The error of a job that its place did not bring to an end."""
    return WorkerError(f"The cluster lost the job: {reason(error)}; run the batch again.")
