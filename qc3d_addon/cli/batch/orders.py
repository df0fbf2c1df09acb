# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a child process is told and tells, as JSON files in its folder."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from .job import Job
from .records import State

ORDER, NEEDS, WAITS, ENDED = "order.json", "needs.json", "waits", "ended.json"

HowEnded = Literal["done", "resumed", "failed", "stopped"]


@dataclass(frozen=True)
class Order:
    """A job for a child process.

    Parameters
    ----------
    job : Job
    state : State
        Where its record is written.
    batch : str
        The batch that it belongs to, by a name that no other has.
    threads : int
        Number of threads that it may work with.
    limit_mb : int
        Megabytes that all jobs on the machine may use together; 0 for no limit.
    """

    job: Job
    state: State
    batch: str
    threads: int
    limit_mb: int

    def as_json(self) -> dict[str, Any]:
        """The order as plain values, which ``of_json`` reads."""
        state = {**asdict(self.state), "folder": str(self.state.folder), "base": str(self.state.base)}
        return {**asdict(self), "job": self.job.as_json(), "state": state}

    @classmethod
    def of_json(cls, values: Mapping[str, Any]) -> Order:
        """The order of the plain values of ``as_json``."""
        state = values["state"]
        told = State(Path(state["folder"]), Path(state["base"]), state["version"])
        return cls(**{**values, "job": Job.of_json(values["job"]), "state": told})


@dataclass(frozen=True)
class Ended:
    """How a job ended.

    Parameters
    ----------
    how : str
        ``done``; ``resumed``: an earlier run had done it, and nothing has changed since; ``failed``; ``stopped``:
        the batch was interrupted before.
    error : tuple of (str, str) or None
        The type of the error and its sentence, of a job that failed.
    seconds : float
        How long it took; of a resumed one, in the run that did it.
    peak_memory_mb : float or None
        Peak memory of its process.
    notes : tuple of str
        What the command said.
    """

    how: HowEnded
    error: tuple[str, str] | None = None
    seconds: float = 0.0
    peak_memory_mb: float | None = None
    notes: tuple[str, ...] = ()

    @classmethod
    def failed(cls, error: BaseException) -> Ended:
        """A failure that the job itself could not tell."""
        return cls("failed", (type(error).__name__, str(error)))

    def as_json(self) -> dict[str, Any]:
        """As plain values, which ``of_json`` reads."""
        return asdict(self)

    @classmethod
    def of_json(cls, values: Mapping[str, Any]) -> Ended:
        """Of the plain values of ``as_json``."""
        error = values["error"]
        return cls(**{**values, "error": None if error is None else tuple(error), "notes": tuple(values["notes"])})


def write_json(path: Path, values: Mapping[str, Any]) -> None:
    """Write a file that another process reads at any time: complete or not at all."""
    new = path.with_suffix(".new")
    new.write_text(json.dumps(values), encoding="utf-8")
    new.replace(path)


def read_json(path: Path) -> Any:  # noqa: ANN401 - what JSON holds
    """The values of such a file, or None if there is none."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
