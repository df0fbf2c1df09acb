# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory: how much a job will need, how much the machine has, and the peak of this process."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from ..errors import InputError
from ..settings import Quality

# Measured by benchmarks/large.py; docs/guide/limits.md has the figures.
_MB_OF_QUALITY: dict[Quality, float] = {"normal": 105.0, "fine": 125.0, "finest": 165.0, "exact": 140.0}
# For each pair: of every vertex, and of every moving one the factors of the surface's matrix and the frames that are
# computed at once.
_KB_PER_VERTEX, _KB_PER_MOVING = 3.2, 2.1
_KB_PER_VERTEX_EXACT = 75.0  # of one fit at a time, whose tetrahedra are as fine as the surface
_BYTES_PER_POSITION = 110.0  # for each vertex in each frame: positions, measures, and temporary arrays
_MB_WITHOUT_MAPS, _KB_WITHOUT_MAPS = 80.0, 1.3  # for mode straight, which only counts crossings
_MB_OF_A_COMMAND, _KB_PER_TET = 150.0, 3.0  # for the commands analyze, reconstruct, compress and decompress
_KB_PER_FRAME, _BYTES_PER_COMPRESSED = 5.0, 220.0
_BYTES_OF_FACTORS = 600.0  # for each vertex to the power 4/3, as for the factors of a three-dimensional mesh
_BYTES_OF_SURFACE_FACTORS = 1600.0  # for each vertex of a surface, measured with 110,000
# With more vertices, the modes of a volume for compression come from a thirtieth of them. Measured with 110,000.
FACTORED_IN_VOLUME, _BYTES_OF_FEWER_FACTORS = 30_000, 7000.0
_KB_OF_MATRICES, _BLOCKS = 1.0, 6  # for each vertex; blocks of vectors and directions that are held at once
_KB_OF_NEIGHBORS, _VECTORS_PER_MODE = 1.0, 5  # for each vertex; of all three coordinates, and while they are computed
_SHARE_OF_MACHINE = 0.75  # leaves a quarter for Blender and the system

_own_limit_mb = 0
_hears_needs: Callable[[float], None] | None = None


def estimated_mb(
    vertices: int, pairs: int, frames: int, quality: Quality, needs_maps: bool = True, triangles: int = 0,
    moving: float = 1.0,
) -> float:
    """Estimated peak memory of a bake, in megabytes.

    Parameters
    ----------
    vertices : int
        Vertices of the mesh.
    pairs : int
        Pairs of consecutive keys.
    frames : int
        Frames to compute.
    quality : Quality
        Resolution of the volume.
    needs_maps : bool
        Whether the volume is mapped at all; mode straight needs no map.
    triangles : int
        Triangles of the mesh; they count where there are more than two for each vertex.
    moving : float
        Share of the vertices that the keys move, 0..1.
    """
    positions = vertices * frames * _BYTES_PER_POSITION / 1e6
    size = max(vertices, triangles / 2)
    if not needs_maps:
        return positions + _MB_WITHOUT_MAPS + size * _KB_WITHOUT_MAPS / 1e3
    fit = size * _KB_PER_VERTEX_EXACT / 1e3 if quality == "exact" else 0.0
    surface = size * (_KB_PER_VERTEX + moving * _KB_PER_MOVING) / 1e3
    return positions + fit + pairs * (_MB_OF_QUALITY[quality] + surface)


def require_memory(needed_mb: float, limit_mb: float, vertices: int) -> None:
    """Check, before a bake of ``vertices`` starts, that its estimated memory is within the limit.

    Raises
    ------
    InputError
        If it is not.
    """
    if needed_mb > limit_mb:
        raise InputError(
            f"The bake of {vertices} vertices needs about {needed_mb:.0f} MB of memory, and its limit is "
            f"{limit_mb:.0f} MB. Raise the limit, use fewer in-betweens or keys, or bake a coarser mesh and transfer "
            "the in-betweens with a Surface Deform modifier."
        )
    announce(needed_mb)


@contextlib.contextmanager
def shared_memory(limit_mb: int, hears_needs: Callable[[float], None]) -> Iterator[None]:
    """Context manager for a process that shares the machine's memory with others of its kind.

    Parameters
    ----------
    limit_mb : int
        Megabytes that all of them may use together, in place of three quarters of the machine's; 0 leaves these.
    hears_needs : callable
        Called with the estimated megabytes of each work before it begins; it may wait until there is room.
    """
    global _own_limit_mb, _hears_needs
    before = _own_limit_mb, _hears_needs
    _own_limit_mb, _hears_needs = limit_mb, hears_needs
    try:
        yield
    finally:
        _own_limit_mb, _hears_needs = before


def announce(needed_mb: float) -> None:
    """Say that work begins that needs so many megabytes; waits where ``shared_memory`` says so."""
    if _hears_needs is not None:
        _hears_needs(needed_mb)


def require_memory_for_tets(points: int, tets: int, held: int) -> None:
    """Check, before a tetrahedral mesh with arrays of ``held`` bytes is read, that the machine can process it.

    Raises
    ------
    InputError
        If three quarters of the machine's memory would not be enough.
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
    """Check, before frames are read, that the machine can compress or decompress them.

    Raises
    ------
    InputError
        If three quarters of the machine's memory would not be enough.
    """
    needed = _MB_OF_A_COMMAND + frames * (_KB_PER_FRAME / 1e3 + vertices * _BYTES_PER_COMPRESSED / 1e6)
    _require(needed, f"Work on {frames} frames of {vertices} vertices", "use fewer frames or a coarser mesh")


def compression_mb(vertices: int, frames: int, modes: int, is_surface: bool = False) -> float:
    """Estimated peak memory, in megabytes, of the search for the smallest file.

    Parameters
    ----------
    vertices, frames
        Of what is compressed.
    modes
        How many modes of the mesh are tried.
    is_surface
        Whether the mesh is a surface, whose factored matrix is small.
    """
    needed = _MB_OF_A_COMMAND + frames * (_KB_PER_FRAME / 1e3 + vertices * _BYTES_PER_COMPRESSED / 1e6)
    needed += vertices * (_KB_OF_NEIGHBORS / 1e3 + 8.0 * _VECTORS_PER_MODE * modes / 1e6)
    factors = _BYTES_OF_FACTORS * vertices ** (4 / 3)
    if is_surface or vertices > FACTORED_IN_VOLUME:
        factors = vertices * (_BYTES_OF_SURFACE_FACTORS if is_surface else _BYTES_OF_FEWER_FACTORS)
    return needed + (factors / 1e6 if modes else 0.0)


def require_memory_for_compression(vertices: int, frames: int, modes: int, is_surface: bool = False) -> None:
    """Raise InputError, before the search starts, if three quarters of the machine's memory would not be enough."""
    needed = compression_mb(vertices, frames, modes, is_surface)
    _require(needed, f"Compressing {frames} times {vertices} vertices", "use fewer frames or a coarser mesh")


def _require(needed_mb: float, what: str, remedy: str) -> None:
    limit = machine_limit_mb()
    if limit and needed_mb > limit:
        raise InputError(
            f"{what} needs about {needed_mb:.0f} MB of memory, and three quarters of the machine's are {limit} MB; "
            f"{remedy}."
        )


def machine_limit_mb() -> int:
    """Default memory limit of a bake in megabytes: three quarters of the machine's memory, or 0 if that is unknown.

    Within ``shared_memory``, its limit.
    """
    if _own_limit_mb:
        return _own_limit_mb
    try:
        total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # this system does not tell
        return 0
    return int(_SHARE_OF_MACHINE * total / 2**20)


def give_back() -> None:
    """Give memory that was freed back to the system, where its C library can do that (glibc).

    The library keeps it for later, but in pieces of the wrong sizes: after each of many tasks it would hold more.
    """
    with contextlib.suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


_forgotten = 0.0  # a peak before the present work, where the system goes on telling it


def forget_peak() -> None:
    """Let ``peak_memory_mb`` tell the peak from now on, in a process that does one piece of work after the other."""
    global _forgotten
    try:
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # Linux
    except OSError:
        _forgotten = peak_memory_mb() or _forgotten


def peak_memory_mb() -> float | None:
    """Peak resident memory of this process in megabytes; None where the system does not tell, as on Windows."""
    found = _told_peak_mb()
    return found if found is None or found > _forgotten else None


def _told_peak_mb() -> float | None:
    try:  # Linux counts in ``ru_maxrss`` what the process was forked from, such as a large Blender
        lines = Path("/proc/self/status").read_text(encoding="ascii", errors="replace").splitlines()
        return float(next(line.split()[1] for line in lines if line.startswith("VmHWM:"))) / 2**10
    except (OSError, StopIteration, ValueError, IndexError):
        pass
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    # macOS reports bytes, other systems kilobytes.
    return peak / 2**20 if sys.platform == "darwin" else peak / 2**10
