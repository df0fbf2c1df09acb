# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The messages of a child process: JSON objects, of which nothing is believed that was not checked."""

from __future__ import annotations

import json
import queue
from typing import Any, NamedTuple

from ..solver.support.progress import STAGES, Done, Progress


class Ending(NamedTuple):
    """How the work, or a task of it, ended.

    Parameters
    ----------
    task : int or None
        Number of the task; None for all of the work.
    error : tuple of (str, str) or None
        The type of the error and its message; None after success.
    """

    task: int | None
    error: tuple[str, str] | None


Message = Progress | Done | Ending


class Inbox:
    """What a child has said about one job.

    Attributes
    ----------
    progress : Progress, Done or None
        The latest progress; None before the first report.
    ending : Ending or None
        How the job ended; None before.
    ended_tasks : queue of Ending
        How tasks of a run ended, which nobody has looked at yet.
    is_garbled : bool
        Whether something was not a message.
    """

    def __init__(self) -> None:
        self.progress: Progress | Done | None = None
        self.ending: Ending | None = None
        self.ended_tasks: queue.SimpleQueue[Ending] = queue.SimpleQueue()
        self.is_garbled = False

    def take(self, text: bytes) -> None:
        """Take a message in; nothing may follow the ending."""
        try:
            message = parsed(text)
        except (ValueError, TypeError, RecursionError):
            self.is_garbled = True
            return
        if self.ending is not None:
            self.is_garbled = True
        elif not isinstance(message, Ending):
            self.progress = message
        elif message.task is None:
            self.ending = message
        else:
            self.ended_tasks.put(message)


def as_json(message: Message) -> dict[str, Any]:
    """The message as the plain values that ``parsed`` reads."""
    if isinstance(message, Progress):
        return {"progress": list(message)}
    if isinstance(message, Done):
        return {"run": list(message)}
    if message.task is None:
        return {"done": True} if message.error is None else {"error": list(message.error)}
    return {"ended": [message.task, *(message.error or ())]}


def parsed(text: bytes) -> Message:
    """Parse a message of the child; raises ValueError or TypeError if it is none."""
    message = json.loads(text)
    if message == {"done": True}:
        return Ending(None, None)
    if set(message) == {"progress"}:
        stage, fraction, fit, fits = message["progress"]
        if stage in STAGES and 0.0 <= fraction <= 1.0 and type(fit) is type(fits) is int and 0 <= fit <= fits:
            return Progress(stage, float(fraction), fit, fits)
    elif set(message) == {"run"}:
        ended, tasks, overall = message["run"]
        if type(ended) is type(tasks) is int and 0 <= ended <= tasks and 0.0 <= overall <= 1.0:
            return Done(ended, tasks, float(overall))
    elif set(message) == {"error"}:
        return Ending(None, _error(message["error"]))
    elif set(message) == {"ended"}:
        task, *error = message["ended"]
        if type(task) is int and task >= 0:
            return Ending(task, _error(error) if error else None)
    raise ValueError("not a message")


def _error(values: list[object]) -> tuple[str, str]:
    kind, sentence = values
    if isinstance(kind, str) and isinstance(sentence, str):
        return kind, sentence
    raise ValueError("not an error")
