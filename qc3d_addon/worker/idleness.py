# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Detects a child process that hangs: one that waits forever uses no processor time."""

from __future__ import annotations

import time as clock
from pathlib import Path

LONGEST_IDLE = 120.0  # seconds; even an overloaded machine gives every process a turn within this time
_PAUSE = 10.0  # seconds between checks, each of which takes some milliseconds


class Idleness:
    """Watches the processor time of a child process and of all that it started. Works on Linux only.

    A child can hang, for example, when a new thread gets no memory and the others wait for it forever.

    Parameters
    ----------
    group : int
        The process group that they belong to.
    """

    def __init__(self, group: int) -> None:
        self._group = group
        self._spent = -1
        self._changed = self._looked = clock.monotonic()

    @property
    def lasts_too_long(self) -> bool:
        """Whether the group has used no processor time for ``LONGEST_IDLE`` seconds."""
        now = clock.monotonic()
        if now - self._looked >= _PAUSE:
            self._looked = now
            spent = _processor_time(self._group)
            if spent != self._spent:
                self._spent, self._changed = spent, now
        return self._spent > 0 and now - self._changed > LONGEST_IDLE


def _processor_time(group: int) -> int:
    """Processor time used by a process group, in clock ticks; 0 where the system does not tell."""
    total = 0
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = file.read_text().rpartition(")")[2].split()
        except OSError:
            continue  # it has just ended
        if int(fields[2]) == group:
            total += sum(map(int, fields[11:15]))
    return total
