# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Standard output and error of the command. If they break, the work goes on."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TextIO

_unheard: OSError | None = None
_kept: list[str] | None = None


def open_streams() -> None:
    """Open standard input, output and error if they are closed, so that none of our files gets their descriptors.

    Otherwise, what native code writes to standard output or error would end up in that file.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            # The system uses the lowest free descriptor, which is this one: those below it are open.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
        if getattr(sys, name) is None:
            mode = "r" if name == "stdin" else "w"
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115 - as long as the process lives


def say(text: str) -> None:
    """Write a line to standard output."""
    if _kept is not None:
        _kept.append(text)
        return
    with _listening():
        print(text, flush=True)


def note(text: str) -> None:
    """Write a sentence to standard error."""
    if _kept is not None:
        _kept.append(text)
        return
    try:
        print(f"qc3d: {text}", file=sys.stderr, flush=True)
    except OSError:
        _silence(sys.stderr)


@contextmanager
def kept() -> Iterator[list[str]]:
    """Context manager that keeps what is said and noted in a list, which it gives, in place of writing it."""
    global _kept
    earlier, _kept = _kept, []
    try:
        yield _kept
    finally:
        _kept = earlier


def flush() -> None:
    """Flush standard output, including what others wrote to it."""
    with _listening():
        sys.stdout.flush()


def take_unheard() -> OSError | None:
    """The error if something could not be written to standard output, or None; resets it."""
    global _unheard
    error, _unheard = _unheard, None
    return error


@contextmanager
def _listening() -> Iterator[None]:
    global _unheard
    try:
        yield
    except OSError as error:
        _unheard = _unheard or error
        _silence(sys.stdout)


def _silence(stream: TextIO) -> None:
    """Redirect a broken stream to nowhere, so that it does not raise the same error again when Python ends."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
