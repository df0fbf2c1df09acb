# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python interpreter that child processes run in."""

from __future__ import annotations

import os
import sys
import sysconfig
from pathlib import Path


def interpreter() -> Path | None:
    """Path of an interpreter of the same version as the running one, or None if none was found.

    ``sys.executable`` is not enough: where Python is embedded, it may be the application, such as Blender.
    """
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    suffix = sysconfig.get_config_var("EXE") or ""
    candidates = [Path(sys.executable)] if sys.executable else []
    for folder in (Path(sys.prefix), Path(sys.base_prefix)):
        for name in (f"python{version}", "python3", "python"):
            candidates += [folder / "bin" / f"{name}{suffix}", folder / f"{name}{suffix}"]
    for candidate in candidates:
        if "python" in candidate.name.lower() and candidate.is_file() and os.access(candidate, os.X_OK):
            return candidate
    return None
