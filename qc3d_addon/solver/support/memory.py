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
_MB_WITHOUT_MAPS, _KB_WITHOUT_MAPS = 80.0, 1.3  # of mode straight, where crossings are counted
_MB_OF_A_COMMAND, _KB_PER_TET = 150.0, 3.0  # analyze, reconstruct, compress and decompress
_KB_PER_FRAME, _BYTES_PER_COMPRESSED = 5.0, 220.0
_BYTES_OF_FACTORS = 600.0  # for each vertex to the power 4/3, as of the factors of a mesh in space
_KB_OF_MATRICES, _BLOCKS = 1.0, 6  # for each vertex; blocks of vectors that are held at once, with their directions
_SHARE_OF_MACHINE = 0.75


def estimated_mb(
    vertices: int, pairs: int, frames: int, quality: Quality, needs_maps: bool = True, triangles: int = 0
) -> float:
    """About the most megabytes that a bake holds at once.

    Parameters
    ----------
    vertices, pairs, frames
        Of the mesh, of keys that follow each other, and to be made.
    quality
        How fine the volume is.
    needs_maps
        Whether there is a map of the volume at all.
    triangles
        Of the mesh: where these are more than two for each vertex, they decide.
    """
    positions = vertices * frames * _BYTES_PER_POSITION / 1e6
    size = max(vertices, triangles / 2)
    if not needs_maps:
        return positions + _MB_WITHOUT_MAPS + size * _KB_WITHOUT_MAPS / 1e3
    return positions + pairs * (_MB_OF_QUALITY[quality] + size * _KB_PER_VERTEX / 1e3)


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


def require_memory_for_tets(points: int, tets: int, held: int) -> None:
    """Check that a mesh of tetrahedra, with arrays of ``held`` bytes, can be worked on, before it is read.

    Raises
    ------
    InputError
        If it is too large for this machine.
    """
    needed = _MB_OF_A_COMMAND + max(points, tets) * _KB_PER_TET / 1e3 + 2.0 * held / 1e6
    _require(needed, f"A mesh of {tets} tetrahedra and {points} vertices", "use a coarser mesh")


def require_memory_for_modes(vertices: int, modes: int, block: int) -> None:
    """Check that the modes of a mesh can be computed, before that begins.

    Parameters
    ----------
    vertices, modes
        Of the mesh, and how many are asked for.
    block
        Vectors that are worked on at once; 0 where the matrix is factored.

    Raises
    ------
    InputError
        If they are too many for this machine.
    """
    vectors = 2 * modes if block == 0 else modes + 2 * block * _BLOCKS
    needed = _MB_OF_A_COMMAND + vertices * (_KB_OF_MATRICES / 1e3 + 8.0 * vectors / 1e6)
    if block == 0:
        needed += _BYTES_OF_FACTORS * vertices ** (4 / 3) / 1e6
    _require(needed, f"Computing {modes} modes of {vertices} vertices", "use fewer modes or a coarser mesh")


def require_memory_for_frames(frames: int, vertices: int) -> None:
    """Check that frames can be compressed or restored, before they are read.

    Raises
    ------
    InputError
        If they are too many or too large for this machine.
    """
    needed = _MB_OF_A_COMMAND + frames * (_KB_PER_FRAME / 1e3 + vertices * _BYTES_PER_COMPRESSED / 1e6)
    _require(needed, f"Work on {frames} frames of {vertices} vertices", "use fewer frames or a coarser mesh")


def _require(needed_mb: float, what: str, remedy: str) -> None:
    limit = machine_limit_mb()
    if limit and needed_mb > limit:
        raise InputError(
            f"{what} needs about {needed_mb:.0f} MB of memory, and three quarters of the machine's are {limit} MB; "
            f"{remedy}."
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
