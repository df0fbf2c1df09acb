# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The work of a child process: what a folder asks for is carried out, and the outcome written into it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..solver.errors import QC3DError, with_remedy
from ..solver.frames.many import Ended
from . import exchange
from .messages import Ending, Message, as_json

# Parts of the messages of threads, SuperLU and Qhull when they run out of memory.
_WORDS_OF_TOO_LITTLE_MEMORY = ("start new thread", "malloc", "memory")
_KNOWN = (QC3DError, MemoryError, OSError, RuntimeError)


def messages(folder: Path) -> Iterator[dict[str, Any]]:
    """Do the work and yield its messages, the last of which says how it ended.

    An error that is a bug is raised: it ends the process, whose parent says so.
    """
    try:
        work = _run if exchange.is_run(folder) else _corrections if exchange.is_of_corrections(folder) else _task
        for message in work(folder):
            yield as_json(message)
    except _KNOWN as error:
        yield as_json(Ending(None, _told(error)))
    else:
        yield as_json(Ending(None, None))


def _task(folder: Path) -> Iterator[Message]:
    outcome = yield from exchange.read_task(folder).carried_out()
    exchange.write_outcome(folder, outcome)


def _corrections(folder: Path) -> Iterator[Message]:
    made = yield from exchange.read_corrections(folder).carried_out()
    exchange.write_corrected(folder, made)


def _run(folder: Path) -> Iterator[Message]:
    for step in exchange.read_run(folder).carried_out(_KNOWN):
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
