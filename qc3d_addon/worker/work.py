# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The work of a child process: what a folder asks for is carried out, and the outcome written into it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..solver.combinations.corrections import Corrections
from ..solver.errors import QC3DError, with_remedy
from ..solver.fit.recent import RecentFits
from ..solver.frames.many import Ended, Run
from ..solver.frames.task import Task
from . import exchange
from .messages import Ending, Message, as_json

# Parts of the messages of threads, SuperLU and Qhull when they run out of memory.
_WORDS_OF_TOO_LITTLE_MEMORY = ("start new thread", "malloc", "memory")
_KNOWN = (QC3DError, MemoryError, OSError, RuntimeError)


def messages(folder: Path, recent: RecentFits) -> Iterator[dict[str, Any]]:
    """Do the work in a folder and yield its messages, the last of which says how it ended.

    ``recent`` are the maps of earlier jobs. An error that is a bug is raised: it ends the process, and its parent says
    so.
    """
    try:
        job = exchange.read_job(folder)
        for message in _run(folder, job) if isinstance(job, Run) else _alone(folder, job, recent):
            yield as_json(message)
    except _KNOWN as error:
        yield as_json(Ending(None, _told(error)))
    else:
        yield as_json(Ending(None, None))


def _alone(folder: Path, job: Task | Corrections, recent: RecentFits) -> Iterator[Message]:
    if isinstance(job, Corrections):
        exchange.write_corrected(folder, (yield from job.carried_out()))
    else:
        exchange.write_outcome(folder, (yield from job.carried_out(recent)))


def _run(folder: Path, run: Run) -> Iterator[Message]:
    for step in run.carried_out(_KNOWN):
        if not isinstance(step, Ended):
            yield step
        elif isinstance(step.outcome, Exception):
            yield Ending(step.number, _told(step.outcome))
        else:
            exchange.write_outcome(exchange.folder_of(folder, step.number), step.outcome)
            yield Ending(step.number, None)


def _told(error: Exception) -> tuple[str, str]:
    """The type and the message of an error, as they are sent; raises it again if it is a bug."""
    if isinstance(error, QC3DError):
        return type(error).__name__, str(error)
    if isinstance(error, MemoryError):
        return "MemoryError", ""
    if isinstance(error, OSError):
        where = f" ({error.filename})" if error.filename else ""
        return "WorkerError", f"The background process cannot go on: {with_remedy(error)}{where}."
    if not any(word in str(error).lower() for word in _WORDS_OF_TOO_LITTLE_MEMORY):
        raise error
    return "MemoryError", ""
