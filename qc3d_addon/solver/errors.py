# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Typed errors: what is wrong, and what to do about it, in one sentence a person can act on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

_LONGEST = 1000


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
