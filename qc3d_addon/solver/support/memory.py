# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How much memory a bake will need, how much the machine has, and the most that this process has held."""

from __future__ import annotations

import os
import sys

from ..errors import InputError
from ..settings import Quality

# Measured by benchmarks/large.py, with a margin; docs/limits.md has the figures.
_MB_OF_QUALITY: dict[Quality, float] = {"normal": 140.0, "fine": 160.0, "finest": 200.0}
_KB_PER_VERTEX = 4.3  # of every pair: the surface's factors and the frames that are worked on at once
_BYTES_PER_POSITION = 110.0  # of every vertex in every frame: positions, measures, and what makes them
_SHARE_OF_MACHINE = 0.75


def estimated_mb(vertices: int, pairs: int, frames: int, quality: Quality, needs_maps: bool = True) -> float:
    """About the most megabytes that a bake holds at once.

    Parameters
    ----------
    vertices, pairs, frames
        Of the mesh, of keys that follow each other, and to be made.
    quality
        How fine the volume is.
    needs_maps
        Whether there is a map of the volume at all.
    """
    positions = vertices * frames * _BYTES_PER_POSITION / 1e6
    if not needs_maps:
        return positions + _MB_OF_QUALITY["normal"]
    return positions + pairs * (_MB_OF_QUALITY[quality] + vertices * _KB_PER_VERTEX / 1e3)


def require_memory(needed_mb: float, limit_mb: float, vertices: int) -> None:
    """Check that a bake fits into memory, before it starts.

    Raises
    ------
    InputError
        If the estimate is above the limit.
    """
    if needed_mb > limit_mb:
        raise InputError(
            f"The bake of {vertices} vertices needs about {needed_mb:.0f} MB of memory, and its limit is "
            f"{limit_mb:.0f} MB. Allow it more, take fewer in-betweens or keys, or bake a coarser mesh and carry the "
            "in-betweens over with a Surface Deform modifier."
        )


def machine_limit_mb() -> int:
    """Megabytes that a bake may use where nobody says otherwise: three quarters of the memory, 0 where not known."""
    try:
        total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # not known on this system
        return 0
    return int(_SHARE_OF_MACHINE * total / 2**20)


def peak_memory_mb() -> float | None:
    """Peak resident memory of this process in megabytes, None where the system does not tell (Windows)."""
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    # macOS counts bytes, the others kilobytes.
    return peak / 2**20 if sys.platform == "darwin" else peak / 2**10
