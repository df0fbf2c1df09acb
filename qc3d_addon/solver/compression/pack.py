# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps and frames as the smallest file of an error, or the nearest of a size; and back."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from ..arrays import Floats, Ints
from ..errors import InputError
from ..maps.mapping import Mapping
from ..maps.unfolding import unfolded
from ..support.progress import told
from ..tets.mesh import TetMesh
from .compact import Boundary, Packed, from_bytes, space_of, to_bytes
from .fields import Space
from .files import Source, plain_bytes
from .smallest import Wanted, exact_size, largest_step, plain_size, smallest

ChosenBoundary = Literal["auto", "sliding", "fixed", "exact"]

_MOST_ERROR, _LEAST_ERROR = 1.0, 1e-9
_TRIALS_OF_SIZE = 9
_FULL = 0.98  # of the size is near enough
_TRIALS_WITHOUT_FOLDS, _NEARER = 12, 0.7
_TRIES_TO_UNFOLD, _NEARER_TO_UNFOLD = 3, 0.97


@dataclass(frozen=True, eq=False)
class Small:
    """A file and what comes back from it.

    Parameters
    ----------
    data : bytes
        The file.
    way : str
        How it holds the displacements: ``plain``, ``levels``, ``modes`` or ``remade``.
    restored : (F, n, 3)
        What ``unpacked`` finds in it.
    errors : (F,)
        Root mean square distance of what comes back, over the diagonal of the mesh's bounding box.
    folds : tuple of int
        Folded tetrahedra of each map; empty for frames.
    is_unfolded : bool
        Whether the reader has to unfold maps.
    """

    data: bytes
    way: str
    restored: Floats
    errors: Floats
    folds: tuple[int, ...] = ()
    is_unfolded: bool = False

    @property
    def error(self) -> float:
        """The largest of the errors."""
        return float(self.errors.max())


Work = Generator[float, None, Small]
# The smallest file of an error.
OfError = Callable[[float], Work]


def small_maps(mesh: TetMesh, targets: Floats, error: float, boundary: ChosenBoundary = "auto") -> Work:
    """The smallest file of maps (F, N, 3) of a mesh; yields the finished share of the work.

    Parameters
    ----------
    error : float
        Largest root mean square error of each map, over the diagonal of the mesh's bounding box.
    boundary
        ``sliding``: vertices on the faces of the unit cube stay in them exactly; ``fixed``: the boundary is as near as
        all else; ``exact``: its places are stored bit for bit; ``auto``: ``sliding`` where the maps allow that.

    Raises
    ------
    InputError
        If maps leave a boundary that is to slide, or the mesh has no size.
    """
    source = Source("maps", mesh.points, mesh.tets)
    stays = bool((targets == mesh.points)[:, mesh.on_cube_face].all())
    if boundary == "sliding" and not stays:
        raise InputError("A map moves the cube's faces out of themselves; choose a fixed boundary, or an exact one.")
    chosen: Boundary = boundary if boundary != "auto" else "sliding" if stays else "fixed"
    space, unit = space_of(source, chosen), diagonal_of(mesh.points)
    exact = np.array(targets[:, source.boundary]) if chosen == "exact" else None
    moved, asked = (targets - mesh.points) * space.free, error
    # What was folded before is not to be unfolded.
    tries = 1 if any(Mapping(mesh, values).folds for values in targets) else _TRIES_TO_UNFOLD
    found: list[Small] = []
    for number in range(tries):
        start = 1.0 - 0.5**number  # each further try takes as long, and is less likely
        field = yield from told(
            smallest(Wanted(space, moved, unit, asked)), partial(_between, start, 0.5 * (1.0 + start))
        )
        if number and exact_size(space, field) > plain_size(Wanted(space, moved, unit, error)):
            break  # nothing is paid for being without folds that makes a file larger than simple ones
        packed = Packed("maps", chosen, len(targets), field, exact)
        data = to_bytes(source, space, packed)
        restored = unpacked(data, source)
        found.append(_small_of(data, packed, mesh, restored, targets))
        if any(found[-1].folds) and tries > 1:
            packed = replace(packed, is_unfolded=True)
            restored = _unfolded(source, space, restored)
            found.append(_small_of(to_bytes(source, space, packed), packed, mesh, restored, targets))
        if any(found[-1].folds):
            break  # it cannot be unfolded
        if not found[-1].is_unfolded or found[-1].error <= error:
            yield 1.0
            return found[-1]
        # Unfolding has led farther away than was asked; it starts nearer now.
        asked *= _NEARER_TO_UNFOLD * error / found[-1].error
    yield 1.0
    return found[0]


def _between(start: float, end: float, share: float) -> float:
    return start + share * (end - start)


def _small_of(data: bytes, packed: Packed, mesh: TetMesh, restored: Floats, targets: Floats) -> Small:
    folds = tuple(Mapping(mesh, values).folds for values in restored)
    errors = errors_of(restored, targets, diagonal_of(mesh.points))
    return Small(data, packed.field.part.kind, restored, errors, folds, packed.is_unfolded)


def small_frames(frames: Floats, faces: Ints, error: float) -> Work:
    """The smallest file of frames (F, n, 3) of a surface, the first of which is not stored; as ``small_maps``.

    Raises
    ------
    InputError
        If there is no frame after the first, or that has no size.
    """
    source, first = Source("frames", frames[0], faces), frames[0]
    if len(frames) < 2:
        raise InputError("There is nothing to store: the first frame is the source, and it has no frame after it.")
    space, unit = space_of(source, "fixed"), diagonal_of(first)
    field = yield from smallest(Wanted(space, frames[1:] - first, unit, error))
    data = to_bytes(source, space, Packed("frames", "sliding", len(frames) - 1, field))
    restored = unpacked(data, source)
    return Small(data, field.part.kind, restored, errors_of(restored, frames[1:], unit))


def unpacked(data: bytes, source: Source) -> Floats:
    """(F, n, 3) the maps, or the frames after the first, of a file; raises InputError as ``compact.from_bytes``."""
    packed, space = from_bytes(data, source)
    if packed.remaking is not None:
        raise InputError("These frames have to be made again; see frames.remade.")
    restored = source.points + packed.field.displacements(space)
    if packed.exact is not None:
        restored[:, source.boundary] = packed.exact
    return _unfolded(source, space, restored) if packed.is_unfolded else np.asarray(restored)


def _unfolded(source: Source, space: Space, restored: Floats) -> Floats:
    return np.stack([unfolded(source.mesh, values, space.free) for values in restored])


def of_size(pack: OfError, size: int) -> Work:
    """The nearest file of at most ``size`` bytes, found by halving among errors; raises InputError where none is."""
    low, high = np.log(_LEAST_ERROR), np.log(_MOST_ERROR)
    best: Small | None = None
    smallest_size = np.inf
    for trial in range(_TRIALS_OF_SIZE):
        # Most of the errors that anybody wants are among the larger ones.
        middle = 0.5 * (low + high) if trial else np.log(1e-3)
        found = yield from _shared(pack(float(np.exp(middle))), trial, _TRIALS_OF_SIZE)
        smallest_size = min(smallest_size, len(found.data))
        if len(found.data) <= size:
            best, high = found if best is None or found.error < best.error else best, middle
            if len(found.data) >= _FULL * size:
                break
        else:
            low = middle
    if best is None:
        raise InputError(f"{size} bytes are too few; the smallest file has {smallest_size:.0f}.")
    return best


def without_folds(pack: OfError, error: float) -> Work:
    """The smallest file of at most that error whose maps come back without folds: nearer, as far as that needs.

    Raises
    ------
    InputError
        If there is none with a hundredth of the error.
    """
    for trial in range(_TRIALS_WITHOUT_FOLDS):
        found = yield from _shared(pack(error * _NEARER**trial), trial, _TRIALS_WITHOUT_FOLDS)
        if not any(found.folds):
            return found
    raise InputError(
        f"The maps fold {sum(found.folds)} tetrahedra even with an error of {found.error:.1g}; compress them with "
        "that error and folds, or by the scheme fitted."
    )


def diagonal_of(points: Floats) -> float:
    """The unit of errors: the diagonal of the bounding box; raises InputError where that is 0."""
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    if not diagonal > 0.0:
        raise InputError("All vertices of the mesh are in one place; there is nothing to store.")
    return diagonal


def quantized_size(displacements: Floats, unit: float, error: float) -> int:
    """Bytes of displacements (F, n, 3) that are rounded, with the same error, and deflated: what is compared with."""
    cells = np.empty((0, 3), dtype=np.int64)
    step = largest_step(Wanted(Space(displacements[0], cells), displacements, unit, error))
    return len(plain_bytes(np.round(displacements / step).astype(np.int64))) if step else 0


def errors_of(restored: Floats, wanted: Floats, unit: float) -> Floats:
    """(F,) root mean square distances of displacements or places (F, n, 3), in a unit."""
    return np.asarray(np.sqrt(((restored - wanted) ** 2).sum(axis=2).mean(axis=1)) / unit)


def _shared(work: Work, number: int, count: int) -> Work:
    """The same work as one of ``count`` equal shares."""
    while True:
        try:
            share = next(work)
        except StopIteration as stop:
            found: Small = stop.value
            return found
        yield (number + share) / count
