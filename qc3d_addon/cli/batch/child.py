# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In the child process: one job is carried out, and how it ended is written down.

Started by :mod:`.children` as ``qc3d batch-job FOLDER``. The folder has the order in ``order.json``. Before each work
that needs much memory, ``needs.json`` says how much, and the process waits for a line on standard input; while another
process works on the same job, there is a file ``waits``. At the end, ``ended.json`` says how the job ended. When
standard input closes, the parent is gone, and this process ends.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import threading
import time as clock
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

from ...solver.errors import InputError, QC3DError, on_one_line, reason
from ...solver.files.atomic import before_replacing, making_folder
from ...solver.files.private_folders import remove
from ...solver.support.guarded_program import share_group
from ...solver.support.memory import peak_memory_mb, shared_memory
from ...solver.support.threads import use_at_most
from ...worker.parent import listen
from .. import speech
from ..failures import FAILURES, told
from ..version import version
from .orders import ENDED, NEEDS, ORDER, WAITS, Ended, Order, write_json
from .records import Record, digest

_PAUSE = 0.2  # seconds between looks at a lock


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command, which is for ``qc3d batch`` alone and not listed."""
    command = commands.add_parser("batch-job")
    command.add_argument("folder", type=Path)
    command.set_defaults(run=partial(_run, commands.choices))


def _run(parsers: Mapping[str, argparse.ArgumentParser], arguments: argparse.Namespace) -> NoReturn:
    folder = arguments.folder
    order = Order.of_json(json.loads((folder / ORDER).read_text(encoding="utf-8")))
    work = _Work(order, parsers[order.job.command], folder)
    listen(lambda _: work.granted.release(), partial(remove, folder))
    share_group()  # the parent ends all processes of this group
    use_at_most(order.threads)
    write_json(folder / ENDED, work.ended().as_json())
    os._exit(0)  # all is written; Blender's module has been seen to wait for itself while Python ends


class _Work:
    """The work on one job."""

    def __init__(self, order: Order, parser: argparse.ArgumentParser, folder: Path) -> None:
        self.granted = threading.Semaphore(0)
        self._order = order
        self._parser = parser
        self._folder = folder
        self._granted_mb = 0.0
        self._at_start_mb = peak_memory_mb() or 0.0
        self._recorded: set[str] = set()
        self._before: dict[str, str] = {}
        self._began = clock.monotonic()

    def ended(self) -> Ended:
        """Do it, and say how it ended."""
        order, error = self._order, None
        with speech.kept() as said:
            try:
                if order.state.version != version():
                    raise InputError(
                        f"This machine has QC3D {version()}, and the batch was started by {order.state.version}; "
                        "install the same version on all machines."
                    )
                with order.state.alone(order.job, self._wait):
                    done = order.state.record(order.job)
                    if done is not None:
                        return Ended("resumed", None, done.seconds, done.peak_memory_mb, ())
                    self._carry_out()
            except FAILURES as failure:
                error = told(failure)
        notes = tuple(map(on_one_line, said))
        return Ended("done" if error is None else "failed", _typed(error), self._seconds, peak_memory_mb(), notes)

    @property
    def _seconds(self) -> float:
        return clock.monotonic() - self._began

    def _wait(self) -> None:
        waits = self._folder / WAITS
        waits.touch()
        clock.sleep(_PAUSE)
        waits.unlink()

    def _carry_out(self) -> None:
        job, state = self._order.job, self._order.state
        self._began = clock.monotonic()
        try:
            self._stamp = _stamp(job.file)
            self._before = state.digests([job.file])
        except (OSError, ValueError) as error:
            raise InputError(f"{job.file} cannot be read: {reason(error)}; name another file.") from error
        with (
            making_folder(job.output.parent),
            making_folder((job.report or job.output).parent),
            shared_memory(self._order.limit_mb, self._ask),
            before_replacing(self._record),
        ):
            arguments = self._parser.parse_args(job.arguments)
            arguments.run(arguments)
        if self._recorded != set(map(state.told, job.outputs)):
            raise RuntimeError(f"{job.command_line} wrote other files than it was asked for")

    def _ask(self, needed_mb: float) -> None:
        """Wait until the parent grants the memory."""
        needed_mb += self._at_start_mb
        if needed_mb <= self._granted_mb:
            return
        self._granted_mb = needed_mb
        write_json(self._folder / NEEDS, {"mb": needed_mb})
        self.granted.acquire()

    def _record(self, files: dict[Path, Path]) -> None:
        """Write the record of the complete files before they take their places: what is in its place has a record."""
        job, state = self._order.job, self._order.state
        if _stamp(job.file) != self._stamp:
            raise InputError(f"{job.file} was changed while it was read; run the batch again.")
        outputs = {state.told(path): digest(files[Path(os.path.realpath(path))]) for path in job.outputs}
        inputs = self._before | state.digests(_libraries())
        state.write(job, Record(state.version, job.settings, inputs, outputs, self._seconds, peak_memory_mb()))
        self._recorded = set(outputs)


def _typed(error: QC3DError | None) -> tuple[str, str] | None:
    return None if error is None else (type(error).__name__, str(error))


def _stamp(path: Path) -> tuple[int, int]:
    found = path.stat()
    return found.st_size, found.st_mtime_ns


def _libraries() -> list[Path]:
    """The files that the open .blend file links."""
    bpy: Any = sys.modules.get("bpy")
    if bpy is None:
        return []
    paths = (Path(bpy.path.abspath(library.filepath, library=library.parent)) for library in bpy.data.libraries)
    return [path for path in paths if path.is_file()]
