# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A job of a batch."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

COMMANDS = ("bake", "interpolate", "combine", "export")


@dataclass(frozen=True)
class Job:
    """One command of a batch.

    Parameters
    ----------
    number : int
        Its number in the file, from 1.
    name : str
        Its name, which no other job has.
    command : str
        One of ``COMMANDS``.
    words : tuple of str
        Its options on the command line, except for files.
    file, output : Path
        What it reads and writes.
    report : Path or None
        The report that it writes, too.
    after : int or None
        Number of the job that writes its file.
    settings : dict
        The value of each option that decides about the result, for comparison.
    """

    number: int
    name: str
    command: str
    words: tuple[str, ...]
    file: Path
    output: Path
    report: Path | None
    after: int | None
    settings: dict[str, Any]

    @property
    def outputs(self) -> tuple[Path, ...]:
        """All files that it writes."""
        return (self.output,) if self.report is None else (self.output, self.report)

    @property
    def arguments(self) -> tuple[str, ...]:
        """Its command line, without ``qc3d`` and the command's name."""
        report = () if self.report is None else (f"--report={self.report}",)
        return (*self.words, f"--output={self.output}", *report, "--", str(self.file))

    @property
    def command_line(self) -> str:
        """Its command line, as one would type it."""
        return shlex.join(("qc3d", self.command, *self.arguments))

    def as_json(self) -> dict[str, Any]:
        """The job as plain values, which ``of_json`` reads."""
        paths = {"file": str(self.file), "output": str(self.output), "report": self.report and str(self.report)}
        return asdict(self) | paths

    @classmethod
    def of_json(cls, values: Mapping[str, Any]) -> Job:
        """The job of the plain values of ``as_json``."""
        paths = {name: Path(values[name]) for name in ("file", "output")}
        report = None if values["report"] is None else Path(values["report"])
        return cls(**{**values, **paths, "report": report, "words": tuple(values["words"])})
