# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The messages of a child process: JSON objects, of which nothing is believed that was not checked."""

from __future__ import annotations

import json
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
