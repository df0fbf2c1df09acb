# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is done: a record of each result, with the contents of the files that it was made from and of its own."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, BinaryIO

from ...solver.errors import InputError, with_remedy
from ...solver.files.locks import lock
from .job import Job

_LARGEST = 10_000_000  # characters


@dataclass(frozen=True)
class Record:
    """What a result was made from.

    Parameters
    ----------
    version : str
        The version of QC3D.
    settings : dict
        Those of the job.
    inputs, outputs : dict
        The SHA-256 of each file that was read and written, by its path from the folder of the jobs.
    seconds : float
    peak_memory_mb : float or None
    """

    version: str
    settings: dict[str, Any]
    inputs: dict[str, str]
    outputs: dict[str, str]
    seconds: float
    peak_memory_mb: float | None


@dataclass(frozen=True)
class State:
    """The folder of the records.

    Parameters
    ----------
    folder : Path
        Where they are.
    base : Path
        The folder of the jobs, from which paths are told, so that the records hold on every machine.
    version : str
        The version of QC3D.
    """

    folder: Path
    base: Path
    version: str

    def record(self, job: Job) -> Record | None:
        """The record of a job whose result is there and was made from the same files with the same settings."""
        found = self._read(job)
        if found is None or (found.version, found.settings) != (self.version, job.settings):
            return None
        if set(found.outputs) != {self.told(path) for path in job.outputs} or self.told(job.file) not in found.inputs:
            return None
        # A file that was replaced by its result is that now.
        files = found.inputs | found.outputs
        is_whole = all(_digest_or_none(self.base / path) == digest for path, digest in files.items())
        return found if is_whole else None

    def write(self, job: Job, record: Record) -> None:
        """Write the record of a job; raises InputError if it cannot be written."""
        path = self._path(job, "json")
        new = path.with_suffix(".new")
        try:
            with new.open("w", encoding="utf-8") as file:
                json.dump(asdict(record), file, indent=1)
                file.flush()
                os.fsync(file.fileno())
            new.replace(path)
        except OSError as error:
            raise InputError(f"{path} cannot be written: {with_remedy(error)}.") from error

    @contextmanager
    def alone(self, job: Job, on_waiting: Callable[[], object]) -> Iterator[None]:
        """Context manager that keeps other processes from working on the same job.

        While another one does, ``on_waiting`` is called again and again. Where the file system has no locks, nobody
        waits.

        Raises
        ------
        InputError
            If the folder cannot be written.
        """
        path = self._path(job, "lock")
        try:
            file = path.open("ab")
        except OSError as error:
            raise InputError(f"{path} cannot be written: {with_remedy(error)}.") from error
        with file:
            while not _is_ours(file):
                on_waiting()
            yield

    def make_folder(self) -> None:
        """Make the folder; raises InputError if that fails."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{self.folder} cannot be made a folder: {with_remedy(error)}.") from error

    def told(self, path: Path) -> str:
        """A path as the records tell it."""
        try:
            return Path(os.path.relpath(path, self.base)).as_posix()
        except ValueError:  # another drive
            return path.as_posix()

    def digests(self, files: Iterable[Path]) -> dict[str, str]:
        """The digests of files, by their paths as told; raises OSError if one cannot be read."""
        return {self.told(path): digest(path) for path in files}

    def _read(self, job: Job) -> Record | None:
        try:
            with self._path(job, "json").open(encoding="utf-8") as file:
                return Record(**json.loads(file.read(_LARGEST)))
        except (OSError, ValueError, TypeError):
            return None

    def _path(self, job: Job, kind: str) -> Path:
        key = hashlib.sha256(self.told(job.output).encode()).hexdigest()[:16]
        return self.folder / f"{job.output.stem[:40]}-{key}.{kind}"


def digest(path: Path) -> str:
    """The SHA-256 of a file; raises OSError if it cannot be read."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _is_ours(file: BinaryIO) -> bool:
    try:
        return lock(file)
    except OSError:  # there are no locks
        return True


def _digest_or_none(path: Path) -> str | None:
    try:
        return digest(path)
    except (OSError, ValueError):
        return None
