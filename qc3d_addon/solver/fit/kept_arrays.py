# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The arrays of a fitted map as few bytes, without any loss.

Points and maps on a lattice (module ``lattice``) are told as whole numbers: how a map goes on from the two before it,
relative to what neighbors let expect. What is not on a lattice is told in double precision. Tetrahedra are not told
where they are the Delaunay tetrahedra of the points and no rounding can make that doubtful; rotations are not where
they follow from the maps.
"""

from __future__ import annotations

from collections.abc import Mapping
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints
from ..compression.integers import packed, planes_read, planes_shortened, unpacked
from ..compression.prediction import Predictor
from ..errors import InputError
from ..meshing.slivers import triangulate
from ..tets.mesh import TetMesh
from .continuation import turns_along
from .lattice import BITS, whole

Bytes = NDArray[np.uint8]
_DOUBLE = 0  # in place of the bits of a lattice
_MOST = 2**27  # numbers of an array
# By so much, in squares of the cube's edge, a sphere around a tetrahedron misses the vertex across each of its faces:
# a thousand times the rounding errors of the triangulation.
_SURE = 1e-11
_known: WeakKeyDictionary[TetMesh, bool] = WeakKeyDictionary()


def arrays_of(mesh: TetMesh, maps: Floats, turns: Floats) -> dict[str, Bytes | Floats]:
    """A mesh, the maps (K + 1, N, 3) along the way, and turns (M, 3), as arrays for ``mesh_and_maps``."""
    bits = next((bits for bits in BITS if all(whole(each, bits) is not None for each in (mesh.points, maps))), _DOUBLE)
    numbers = np.concatenate([_numbers(mesh.points, bits)[None], _numbers(maps, bits)])
    predictor = Predictor(mesh.points) if bits else None
    found: dict[str, Bytes | Floats] = {
        "points": _bytes(bytes([bits]) + packed(numbers[:1], None, planes_shortened)),
        "maps": _bytes(packed(numbers[1:] - numbers[:1], predictor, planes_shortened)),
    }
    if not _is_surely_delaunay(mesh):
        changes = np.diff(mesh.tets, axis=0, prepend=np.zeros((1, 4), dtype=np.int64))
        found["tets"] = _bytes(packed(changes[None], None, planes_shortened))
    if not np.array_equal(turns_along(mesh, maps), turns):
        found["turns"] = turns
    return found


def mesh_and_maps(stored: Mapping[str, NDArray[np.generic]], counts: tuple[int, int, int]) -> tuple[TetMesh, Floats]:
    """The mesh and the maps that ``arrays_of`` was given, from its arrays except ``turns``.

    Parameters
    ----------
    stored : mapping
    counts : tuple of int
        Numbers of points, of tetrahedra, and of maps.

    Raises
    ------
    InputError
        If the arrays are damaged, or this machine finds other tetrahedra.
    """
    points, tets, maps = counts
    if min(points, tets, maps - 1) < 1 or max(3 * points * (maps + 1), 4 * tets) > _MOST:
        raise InputError("The counts of the stored map make no sense.")
    content = _content(stored["points"])
    bits = content[0] if content else -1
    if bits not in (_DOUBLE, *BITS):
        raise InputError("The stored map has a lattice that this version does not know.")
    first = unpacked(content[1:], (1, points, 3), None, planes_read)
    places = _values(first[0], bits)
    if not np.isfinite(places).all():
        raise InputError("The stored map has points that are not finite.")
    predictor = Predictor(places) if bits else None
    rows = unpacked(_content(stored["maps"]), (maps, points, 3), predictor, planes_read)
    if "tets" in stored:
        corners = np.cumsum(unpacked(_content(stored["tets"]), (1, tets, 4), None, planes_read)[0], axis=0)
    else:
        corners = triangulate(places)
        if len(corners) != tets:
            raise InputError("The points of the stored map have other tetrahedra on this machine.")
    return TetMesh(places, corners), _values(rows + first, bits)


def _is_surely_delaunay(mesh: TetMesh) -> bool:
    """Whether ``triangulate`` finds these tetrahedra in this order, on any machine; looked at once for each mesh."""
    found = _known.get(mesh)
    if found is None:
        found = _known[mesh] = _looks_surely_delaunay(mesh)
    return found


def _looks_surely_delaunay(mesh: TetMesh) -> bool:
    found = triangulate(mesh.points)
    if not np.array_equal(found, mesh.tets):
        return False
    # The sphere through the corners: its center relative to the first corner solves 2 E^T c = |edges|^2.
    edges = mesh.edge_matrices.transpose(0, 2, 1)
    centers = np.linalg.solve(2.0 * edges, (edges**2).sum(axis=2)[:, :, None])[:, :, 0]
    squares = (centers**2).sum(axis=1)
    centers = centers + mesh.points[mesh.tets[:, 0]]
    across = mesh.neighbors
    for face in range(4):
        inside = np.flatnonzero(across[:, face] >= 0)
        other = mesh.tets[across[inside, face]]
        # Of the neighbor's corners, three lie on the sphere.
        outside = ((mesh.points[other] - centers[inside, None]) ** 2).sum(axis=2) - squares[inside, None]
        strange = ~(other[:, :, None] == mesh.tets[inside][:, None]).any(axis=2)
        if not (outside[strange] > _SURE).all():
            return False
    return True


def _numbers(values: Floats, bits: int) -> Ints:
    """Values as whole numbers: of the lattice, or the bits of their double precision."""
    found = whole(values, bits) if bits else np.ascontiguousarray(values, dtype="<f8").view("<i8").astype(np.int64)
    assert found is not None
    return found


def _values(numbers: Ints, bits: int) -> Floats:
    if bits:
        return np.asarray(np.ldexp(numbers.astype(np.float64), -bits))
    return np.asarray(np.ascontiguousarray(numbers, dtype="<i8").view("<f8").astype(np.float64))


def _bytes(data: bytes) -> Bytes:
    return np.frombuffer(data, dtype=np.uint8)


def _content(array: NDArray[np.generic]) -> bytes:
    if array.dtype != np.uint8 or array.ndim != 1:
        raise InputError("The stored map holds an array of another kind.")
    return array.tobytes()
