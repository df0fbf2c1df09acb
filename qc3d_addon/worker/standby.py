# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps a child process between jobs: the next one starts with its libraries loaded and what it remembers."""

from __future__ import annotations

import contextlib
import time as clock

from ..solver.errors import WorkerError
from .child import Child, code_now

STAY = 300.0  # seconds that a child waits for its next job before it ends
_LEAVING = 10.0  # seconds before that: it is not asked any more, because it may be about to end


class Standby:
    """At most one child process that waits for a job. Use it from one thread, and call ``close`` at the end.

    Parameters
    ----------
    stay : float
        Seconds that a child waits for its next job before it ends.
    """

    def __init__(self, stay: float = STAY) -> None:
        self.stay = stay
        self._child: Child | None = None

    def prepare(self) -> None:
        """Start a child ahead of its job, unless one waits already; the job says why if it cannot be started."""
        if self._child is None or not self._is_usable(self._child):
            self.close()
            with contextlib.suppress(OSError, WorkerError):
                self._child = Child(self.stay)

    def taken(self) -> Child | None:
        """The child that waits; None if there is none, or none that can be used for another job."""
        child, self._child = self._child, None
        if child is not None and not self._is_usable(child):
            child.close()
            return None
        return child

    def keep(self, child: Child) -> None:
        """Keep a child that has done its job, in place of the one before."""
        self.close()
        self._child = child

    def close(self) -> None:
        """End the child that waits, if there is one."""
        child, self._child = self._child, None
        if child is not None:
            child.close()

    def _is_usable(self, child: Child) -> bool:
        waited = clock.monotonic() - child.idle_since
        is_there = child.process.poll() is None and waited < self.stay - min(_LEAVING, 0.1 * self.stay)
        # A child from before an update would work with the code of before.
        return is_there and not child.inbox.is_garbled and child.code == code_now()
