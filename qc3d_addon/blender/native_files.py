# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that Blender itself reads and writes: names that it can hold, and what it says where it fails."""

from __future__ import annotations

import os
from pathlib import Path

from ..solver.errors import InputError

_LONGEST_PATH = 1023  # bytes; what Blender is given beyond that it cuts off, without a word


def require_short(path: Path, shown: Path) -> None:
    """Refuse a name that Blender would cut off, and so write or read another file; the error calls it ``shown``."""
    if len(os.fsencode(path)) > _LONGEST_PATH:
        raise InputError(f"{shown} is too long a name for Blender; choose a folder with a shorter one.")


def words(error: RuntimeError, new: Path, shown: Path) -> str:
    """What an operator of Blender said as a clause; the file that it calls ``new`` is called ``shown``."""
    text = str(error).removeprefix("Error: ").replace(str(new), str(shown))
    return " ".join(text.split()).rstrip(".")
