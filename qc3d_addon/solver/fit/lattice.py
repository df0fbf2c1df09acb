# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted maps on a lattice of the cube: a millionth of the cube apart, far below what frames show.

A map is rounded when it is made, not when it is stored: what is kept then gives the same frames bit for bit, in a
fraction of the bytes that double precision takes.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..numerics.rotations import determinants
from ..tets.mesh import TetMesh
from .continuation import FollowedPath, turns_along

# Bits of a coordinate, the coarsest first; finer ones are for tetrahedra that coarser ones would change too much.
BITS = (20, 24, 28)
_CHANGE = 0.01  # of a tetrahedron's volume


def whole(values: Floats, bits: int) -> Ints | None:
    """Values as whole numbers of a lattice with so many bits; None where they are not on it."""
    scaled = np.ldexp(values, bits)
    numbers = np.round(scaled)
    return numbers.astype(np.int64) if np.array_equal(numbers, scaled) else None


def mesh_on_lattice(mesh: TetMesh) -> TetMesh:
    """The mesh with its points on the coarsest lattice that spares its tetrahedra; as it was where none does."""
    for bits in BITS:
        rounded = TetMesh(_rounded(mesh.points, bits), mesh.tets)
        if _spared(mesh.volumes, rounded.volumes):
            return rounded
    return mesh


def way_on_lattice(mesh: TetMesh, followed: FollowedPath) -> FollowedPath:
    """The same for the maps of a way, and the rotations that follow from them."""
    before = [determinants(mesh.jacobians(values)) for values in followed.maps]
    for bits in BITS:
        maps = _rounded(followed.maps, bits)
        after = (determinants(mesh.jacobians(values)) for values in maps)
        if all(_spared(one, other) for one, other in zip(before, after, strict=True)):
            maps[0] = mesh.points
            return FollowedPath(maps, turns_along(mesh, maps))
    return followed


def _rounded(values: Floats, bits: int) -> Floats:
    return np.asarray(np.ldexp(np.round(np.ldexp(values, bits)), -bits))


def _spared(before: Floats, after: Floats) -> bool:
    """Whether no volume changes by more than a hundredth."""
    return bool((np.abs(after - before) <= _CHANGE * np.abs(before)).all())
