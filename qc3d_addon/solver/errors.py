# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Typed errors: one sentence each, which says what is wrong and what to do about it."""

from __future__ import annotations

import errno
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

_LONGEST = 1000  # characters that a message may have

# Remedies for errors of the operating system, by their names; not every system has all of them.
_REMEDIES_OF_LIMITS = {
    "EMFILE": "close some files or programs, or raise the limit on open files (ulimit -n)",
    "ENFILE": "close some files or programs, or raise the limit on open files (ulimit -n)",
    "EAGAIN": "close some programs, or raise the limit on processes (ulimit -u)",
    "ENOMEM": "close some programs, or use fewer frames, a lower quality or a smaller mesh",
}
_REMEDIES_OF_PLACES = {
    "ENOSPC": "make room on that disk, or choose another one",
    "EDQUOT": "make room within your quota, or choose another disk",
    "EFBIG": "raise the limit on the size of files (ulimit -f), or choose another disk",
    "ENOENT": "make that folder first, or choose another one",
    "ENAMETOOLONG": "choose a shorter name",
    "EACCES": "choose another place, or ask for access to this one",
    "EPERM": "choose another place, or ask for access to this one",
    "EROFS": "choose another place",
}


class QC3DError(Exception):
    """Base class of all errors that QC3D raises deliberately; their text is one line, meant for the user."""

    def __init__(self, sentence: str) -> None:
        super().__init__(on_one_line(sentence))


class InputError(QC3DError):
    """The keys, the mesh or the settings cannot be used as they are."""


class MeshingError(QC3DError):
    """The cube could not be filled with tetrahedra."""


class CanceledError(QC3DError):
    """The user stopped the work before it came to this."""


class WorkerError(QC3DError):
    """The background process ended without a result."""


class ReconstructionError(QC3DError):
    """A map cannot be reconstructed from its representation and boundary conditions."""


def on_one_line(text: str) -> str:
    """Text made safe for a terminal or Blender, since it may contain names from files.

    Characters that cannot be printed are escaped as in Python, such as ``\\n``; the middle of a very long text is left
    out.
    """
    shown = "".join(mark if mark.isprintable() else mark.encode("unicode_escape").decode() for mark in text)
    return shown if len(shown) <= _LONGEST else f"{shown[: _LONGEST // 2]} … {shown[-_LONGEST // 2 :]}"


@contextmanager
def naming_pair(first: str, second: str, chain: Sequence[str]) -> Iterator[None]:
    """Context manager that names the pair of keys in front of an error's text, if the chain has several pairs."""
    try:
        yield
    except QC3DError as error:
        if len(chain) == 2:
            raise
        raise type(error)(f"From '{first}' to '{second}': {error}") from error


def reason(error: BaseException) -> str:
    """The cause of an error as a clause without a final period: the system's own words if there are any."""
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return " ".join(text.split()).rstrip(".") or type(error).__name__


def remedy_of_limit(error: BaseException) -> str | None:
    """A remedy as a clause, if a limit of the system was reached; None for any other cause."""
    return _remedy(error, _REMEDIES_OF_LIMITS)


def with_remedy(error: OSError) -> str:
    """As ``reason``, followed by a remedy if there is one; for errors while writing files or starting processes."""
    remedy = _remedy(error, _REMEDIES_OF_LIMITS | _REMEDIES_OF_PLACES)
    return reason(error) if remedy is None else f"{reason(error)}; {remedy}"


def _remedy(error: BaseException, remedies: dict[str, str]) -> str | None:
    number = getattr(error, "errno", None)
    found = (text for name, text in remedies.items() if number is not None and getattr(errno, name, None) == number)
    return next(found, None)
