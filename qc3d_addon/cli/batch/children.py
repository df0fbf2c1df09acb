# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Child processes that carry out jobs, and the memory that they share on one machine."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
import time as clock
from pathlib import Path
from typing import Any

from ...solver.errors import WorkerError, with_remedy
from ...solver.files.private_folders import PrivateFolder, remove_abandoned, temporary_place
from ...solver.support.child_python import interpreter
from ...worker.idleness import LONGEST_IDLE, Idleness
from ...worker.processes import how_it_ended, kill
from .orders import ENDED, NEEDS, ORDER, WAITS, Ended, Order, read_json, write_json

_POLL_SECONDS = 0.05  # short beside any job, and long enough to take no processor time
_MB_AT_START = 300.0  # of a process with Blender's module and a small file, until it says what it needs
# Imports this very package, wherever it is, and runs the command.
_START = """
import sys
from importlib import util
package = sys.argv.pop(1)
spec = util.spec_from_file_location("qc3d_addon", package + "/__init__.py", submodule_search_locations=[package])
sys.modules[spec.name] = module = util.module_from_spec(spec)
spec.loader.exec_module(module)
from qc3d_addon.start import main
sys.exit(main())
"""


class Budget:
    """The memory of one machine, shared by the jobs that run there.

    Parameters
    ----------
    limit_mb : int
        Megabytes; 0 for no limit.
    """

    def __init__(self, limit_mb: int) -> None:
        self.limit_mb = limit_mb
        self._held: dict[object, float] = {}
        self._waiting: set[object] = set()
        self._lock = threading.Lock()

    def takes(self, job: object, needed_mb: float) -> bool:
        """Whether a job may have so many megabytes now; call it again later if not.

        A job that needs more than there is may run when all others wait, so that they do not wait for each other.
        """
        with self._lock:
            others = {other: held for other, held in self._held.items() if other is not job}
            is_alone = not others.keys() - self._waiting
            has_room = not self.limit_mb or sum(others.values()) + needed_mb <= self.limit_mb
            if has_room or is_alone:
                self._held[job] = needed_mb
                self._waiting.discard(job)
                return True
            if job in self._held:
                self._waiting.add(job)
            return False

    def give_back(self, job: object) -> None:
        """The job has ended."""
        with self._lock:
            self._held.pop(job, None)
            self._waiting.discard(job)


class Child:
    """A child process for one job.

    Parameters
    ----------
    order : Order
    budget : Budget
    slot : object
        What holds the memory of this job in the budget.

    Raises
    ------
    WorkerError
        If it cannot be started.
    """

    def __init__(self, order: Order, budget: Budget, slot: object) -> None:
        self._order = order
        self._budget = budget
        self._slot = slot
        try:
            self._folder = PrivateFolder()
            try:
                self._errors = self._folder.path / "errors.txt"
                write_json(self._folder.path / ORDER, order.as_json())
                self._process = self._start()
            except BaseException:
                self._folder.close()
                raise
        except OSError as error:
            raise WorkerError(
                f"No process can be started with temporary files in {temporary_place()}: {with_remedy(error)}."
            ) from error
        self._granted_mb = 0.0
        self._idleness = Idleness(self._process.pid)

    def poll(self) -> Ended | None:
        """How the job ended, or None while it runs."""
        if self._process.poll() is None:
            needs = read_json(self._folder.path / NEEDS)
            if needs is not None and needs["mb"] > self._granted_mb:
                self._idleness = Idleness(self._process.pid)
                if self._budget.takes(self._slot, needs["mb"]):
                    self._granted_mb = needs["mb"]
                    self._say_go()
            elif (self._folder.path / WAITS).exists():
                self._idleness = Idleness(self._process.pid)
            elif self._idleness.lasts_too_long:
                return Ended.failed(WorkerError(f"The job has done nothing for {LONGEST_IDLE:g} s and was stopped."))
            return None
        ended = read_json(self._folder.path / ENDED)
        if ended is None:
            return Ended.failed(WorkerError(how_it_ended(self._process.returncode, self._errors)))
        return Ended.of_json(ended)

    def end(self) -> None:
        """End the process, if it still runs, with all that it started; ``close`` tidies up."""
        kill(self._process)

    def close(self) -> None:
        """End the process and remove what it left."""
        kill(self._process)
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        self._folder.close()
        for path in self._order.job.outputs:
            remove_abandoned(path.parent)

    def _say_go(self) -> None:
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):  # it has ended, which the next poll tells
            self._process.stdin.write(b"\n")
            self._process.stdin.flush()

    def _start(self) -> subprocess.Popen[bytes]:
        flags = 0
        if sys.platform == "win32":
            flags = subprocess.CREATE_NO_WINDOW | subprocess.CREATE_NEW_PROCESS_GROUP
        # What it would leave in the place for temporary files is removed with its folder.
        temporary = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(self._folder.path))
        with self._errors.open("wb") as errors:
            return subprocess.Popen(
                [*_own_command(), "batch-job", str(self._folder.path)],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=errors,
                env=os.environ | temporary,
                creationflags=flags,
                start_new_session=sys.platform != "win32",  # Ctrl-C reaches the parent alone, which ends it
            )


def _own_command() -> list[str]:
    """The command ``qc3d`` as another process: of this Blender, or of this Python."""
    bpy: Any = sys.modules.get("bpy")
    if bpy is not None and bpy.app.binary_path:
        return [bpy.app.binary_path, "--command", "qc3d"]
    python = interpreter()
    if python is None:
        raise WorkerError("No Python interpreter was found for the jobs; install QC3D with one of its own.")
    return [str(python), "-P", "-c", _START, str(Path(__file__).resolve().parents[2])]


_running: dict[Child, str] = {}
_ended_batches: set[str] = set()
_budgets: dict[str, Budget] = {}
_changing = threading.Lock()


def carry_out(order: Order) -> Ended:
    """Carry out one job in a child process, and wait for its end.

    Call it in a thread for each job that is to run at once; those of a batch share the memory that the order allows.
    """
    with _changing:
        budget = _budgets.setdefault(order.batch, Budget(order.limit_mb))
    slot = object()
    child = None
    try:
        while not budget.takes(slot, _MB_AT_START):
            if order.batch in _ended_batches:
                return Ended("stopped")
            clock.sleep(_POLL_SECONDS)
        with _changing:
            if order.batch in _ended_batches:
                return Ended("stopped")
            child = Child(order, budget, slot)
            _running[child] = order.batch
        while (ended := child.poll()) is None:
            clock.sleep(_POLL_SECONDS)
        return Ended("stopped") if order.batch in _ended_batches and ended.how == "failed" else ended
    except WorkerError as error:
        return Ended.failed(error)
    finally:
        if child is not None:
            with _changing:
                del _running[child]
            child.close()
        budget.give_back(slot)


def end_all(batch: str) -> None:
    """End all jobs of a batch in this process; none of them starts again."""
    with _changing:
        _ended_batches.add(batch)
        for child, other in _running.items():
            if other == batch:
                child.end()
