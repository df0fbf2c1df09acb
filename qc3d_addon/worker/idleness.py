# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a child process still does anything: one that waits for what never comes takes no processor's time."""

from __future__ import annotations

import time as clock
from pathlib import Path

# Even a machine with far too much to do gives a process its turn in this time.
LONGEST_IDLE = 120.0
_PAUSE = 10.0  # between looks, each of which takes some milliseconds


class Idleness:
    """Watches a child process and what it started, where the system tells (Linux).

    A thread that gets no memory as it starts leaves the others waiting for it, forever.

    Parameters
    ----------
    group
        Number of the process group that they belong to.
    """

    def __init__(self, group: int) -> None:
        self._group = group
        self._spent = -1
        self._changed = self._looked = clock.monotonic()

    @property
    def lasts_too_long(self) -> bool:
        """Whether none of them has done anything for ``LONGEST_IDLE`` seconds."""
        now = clock.monotonic()
        if now - self._looked >= _PAUSE:
            self._looked = now
            spent = _processor_time(self._group)
            if spent != self._spent:
                self._spent, self._changed = spent, now
        return self._spent > 0 and now - self._changed > LONGEST_IDLE


def _processor_time(group: int) -> int:
    """Ticks of processor's time that the processes of a group have had; 0 where the system does not tell."""
    total = 0
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = file.read_text().rpartition(")")[2].split()
        except OSError:
            continue  # it has just ended
        if int(fields[2]) == group:
            total += sum(map(int, fields[11:15]))
    return total
