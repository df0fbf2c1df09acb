# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds pytetwild's compiled module and the command that loads it in a child process, without importing anything."""

from __future__ import annotations

import importlib.util
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

from ..support.child_python import interpreter

CHILD = Path(__file__).resolve().with_name("tetwild_child.py")


def unavailable_reason() -> str | None:
    """Why fTetWild cannot run here, as a clause for a sentence; None if nothing speaks against it. Loads nothing."""
    if _wrapper() is None:
        return "pytetwild is not installed for this Python"
    if interpreter() is None:
        return "no Python interpreter to run it was found"
    return None


def load_command() -> list[str]:
    """The command that only loads fTetWild in a child process; its exit status is 0 if that works.

    Call it only if ``unavailable_reason()`` is None.
    """
    numpy = importlib.util.find_spec("numpy")
    assert numpy is not None
    assert numpy.origin is not None
    folder = Path(numpy.origin).resolve().parent.parent
    return [str(part) for part in (interpreter(), "-I", CHILD, _wrapper(), folder)]


def _wrapper() -> Path | None:
    """The file of pytetwild's compiled module, found without importing the package, which needs pyvista."""
    spec = importlib.util.find_spec("pytetwild")
    for location in (spec.submodule_search_locations or ()) if spec else ():
        for suffix in EXTENSION_SUFFIXES:
            candidate = Path(location) / f"PyfTetWildWrapper{suffix}"
            if candidate.is_file():
                return candidate
    return None
