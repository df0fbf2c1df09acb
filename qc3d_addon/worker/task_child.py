# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The child process that carries out jobs, started by :mod:`qc3d_addon.worker.child`::

    python -I -S task_child.py PACKAGE FOLDER STAY LIBRARIES...

PACKAGE is the folder of this package, under whatever name; FOLDER is the child's own, in whose subfolder ``job`` each
job comes and its outcome goes; STAY is the number of seconds that it waits for another job, 0 to end after the first;
LIBRARIES are the folders that contain numpy, scipy and pytetwild.

A line on standard input, such as ``{"memory": 0}``, asks for the job in the folder; ``memory`` is the number of bytes
that the work may allocate, 0 for no limit. Messages go to standard output, each a JSON object of
:mod:`qc3d_addon.worker.messages` followed by a zero byte: ``{"progress": [stage, fraction, fit, fits]}`` during the
work, and at the end ``{"done": true}`` or ``{"error": [type, message]}``. Of a run of several tasks: ``{"run": [ended,
tasks, share]}`` during the work, and ``{"ended": [number]}`` or ``{"ended": [number, type, message]}`` when a task has
ended. When standard input closes, the parent is gone, and this process ends.
"""

from __future__ import annotations

import importlib
import importlib.util
import json
import os
import queue
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

_NICE = 5  # lower priority than the window in which the user works
Requests = queue.SimpleQueue[dict[str, int]]


def main(arguments: list[str]) -> None:
    package, folder, stay, libraries = Path(arguments[0]), Path(arguments[1]), float(arguments[2]), arguments[3:]
    # Native code may write to standard output; its text must not get between the messages.
    messages = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    name = _load(package)
    importlib.import_module(f"{name}.solver.support.guarded_program").share_group()
    private_folders = importlib.import_module(f"{name}.solver.files.private_folders")
    parent = importlib.import_module(f"{name}.worker.parent")
    clear_up = partial(private_folders.remove, folder)
    requests: Requests = queue.SimpleQueue()
    parent.listen(lambda line: requests.put(json.loads(line)), clear_up)
    if hasattr(os, "nice"):
        os.nice(_NICE)
    sys.path += [library for library in libraries if library not in sys.path]
    importlib.import_module(f"{name}.start").one_thread_each()
    work = importlib.import_module(f"{name}.worker.work")
    memory = importlib.import_module(f"{name}.solver.support.memory")
    job = folder / "job"
    tempfile.tempdir = str(job)  # so that fTetWild's files are removed with it, whatever happens
    recent = work.RecentFits()
    while True:
        try:
            request = requests.get(timeout=stay or None)
        except queue.Empty:
            parent.leave(clear_up)
        memory.forget_peak()
        _limit_memory(request["memory"])  # after loading the libraries: OpenBLAS waits forever if it gets no memory
        for message in work.messages(job, recent):
            _send(messages, message)
        if not stay:
            return
        memory.give_back()


def _load(package: Path) -> str:
    """Import the package from its folder; return the name under which it was imported."""
    name = "qc3d_child"
    spec = importlib.util.spec_from_file_location(
        name, package / "__init__.py", submodule_search_locations=[str(package)]
    )
    if spec is None or spec.loader is None:
        raise ImportError(f"{package} is not a package")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return name


def _send(messages: BinaryIO, message: dict[str, Any]) -> None:
    messages.write(json.dumps(message).encode() + b"\0")
    messages.flush()


def _limit_memory(limit: int) -> None:
    """Make allocations fail beyond ``limit`` more bytes than are allocated now; only Linux can do that."""
    if sys.platform != "linux":
        return
    import resource

    hardest = resource.getrlimit(resource.RLIMIT_DATA)[1]
    if limit <= 0:
        resource.setrlimit(resource.RLIMIT_DATA, (hardest, hardest))
        return

    import numpy as np
    from scipy.linalg import blas

    # Both copies of OpenBLAS allocate buffers at their first product, and end the process if they get none.
    square = np.ones((256, 256))
    blas.dgemm(1.0, square, square @ np.linalg.inv(square + 256.0 * np.eye(256)))
    held = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmData:"))
    most = int(held.split()[1]) * 1024 + limit
    resource.setrlimit(resource.RLIMIT_DATA, (most if hardest < 0 else min(most, hardest), hardest))


if __name__ == "__main__":
    main(sys.argv[1:])
