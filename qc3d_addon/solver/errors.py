# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Typed errors: what is wrong, and what to do about it, in one sentence a person can act on."""

from __future__ import annotations

import errno
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

_LONGEST = 1000

# What to do where the system refuses, by the name of its error; not every system has every one.
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
    """Base of every error that QC3D raises on purpose; its text is meant for the user, on one line."""

    def __init__(self, sentence: str) -> None:
        super().__init__(on_one_line(sentence))


class InputError(QC3DError):
    """The keys, the mesh or the settings cannot be used as they are."""


class MeshingError(QC3DError):
    """The cube could not be filled with tetrahedra."""


class WorkerError(QC3DError):
    """The process that does the work ended without a result."""


class ReconstructionError(QC3DError):
    """A map cannot be rebuilt from its representation and boundary conditions."""


def on_one_line(text: str) -> str:
    """Text that may hold names from files, as a terminal or Blender can show it: nothing that controls them.

    What cannot be printed is written as Python writes it, such as ``\\n``; the middle of a very long text is left out.
    """
    shown = "".join(mark if mark.isprintable() else mark.encode("unicode_escape").decode() for mark in text)
    return shown if len(shown) <= _LONGEST else f"{shown[: _LONGEST // 2]} … {shown[-_LONGEST // 2 :]}"


@contextmanager
def naming_pair(first: str, second: str, chain: Sequence[str]) -> Iterator[None]:
    """Put in front of an error's sentence which two keys of a chain of more it is about."""
    try:
        yield
    except QC3DError as error:
        if len(chain) == 2:
            raise
        raise type(error)(f"From '{first}' to '{second}': {error}") from error


def reason(error: BaseException) -> str:
    """What went wrong as a clause: the system's own words where there are some, on one line, without a full stop."""
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return " ".join(text.split()).rstrip(".") or type(error).__name__


def remedy_of_limit(error: BaseException) -> str | None:
    """What to do, as a clause, where a limit of the system was reached; None where the reason is another one."""
    return _remedy(error, _REMEDIES_OF_LIMITS)


def with_remedy(error: OSError) -> str:
    """As ``reason``, and what to do about it, where something was to be written or started."""
    remedy = _remedy(error, _REMEDIES_OF_LIMITS | _REMEDIES_OF_PLACES)
    return reason(error) if remedy is None else f"{reason(error)}; {remedy}"


def _remedy(error: BaseException, remedies: dict[str, str]) -> str | None:
    number = getattr(error, "errno", None)
    found = (text for name, text in remedies.items() if number is not None and getattr(errno, name, None) == number)
    return next(found, None)
