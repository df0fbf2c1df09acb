# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted maps as bytes: versioned, without pickles, and validated when they are read."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints
from ..errors import InputError
from ..files.npz import Archive
from ..keys.embedding import Cube
from ..keys.keypair import KeyPair
from ..numerics.rotations import determinants
from ..settings import FitOptions
from ..tets.mesh import TetMesh
from .continuation import turns_along
from .fitted_map import FittedMap
from .kept_arrays import arrays_of, mesh_and_maps

FORMAT_VERSION = 5  # up to 4, all arrays were stored as they are; up to 3, every pair had a cube of its own
_OLDEST, _LAST_PLAIN = 3, 4
_SEAL_LENGTH = 32
_NOT_ORTHONORMAL = 1e-9
_ARRAYS = ("header", "points", "maps", "turns", "tets")
_CUBE = ("axes", "center", "scale")
_DAMAGED = "The stored map is damaged; fit the keys again."
_UNREADABLE = (ValueError, KeyError, TypeError, OverflowError, RecursionError, MemoryError)


def fingerprint(pair: KeyPair) -> str:
    """Hash of the keys, faces and edges; a stored map belongs to the keys with the same hash."""
    digest = hashlib.sha256()
    arrays = [pair.key0, pair.key1, pair.faces, pair.edges]
    polygons = np.unique(pair.polygons, return_index=True, return_inverse=True)
    # Of triangles alone, as before there were polygons; their numbers do not matter, but which are the same.
    if len(polygons[0]) < len(pair.faces):
        arrays.append(polygons[1][polygons[2].ravel()])
    for array in arrays:
        digest.update(np.int64(len(array)).tobytes())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _seal(content: bytes) -> bytes:
    return hashlib.sha256(content).digest()


def to_bytes(fitted: FittedMap) -> bytes:
    """Store a fitted map without loss, preceded by a checksum. Of the keys only the hash is stored."""
    cube, mesh = fitted.volume.cube, fitted.mesh
    header = {
        "version": FORMAT_VERSION,
        "fingerprint": fingerprint(fitted.pair),
        "options": asdict(fitted.options),
        "engine": fitted.engine,
        "notes": list(fitted.notes),
        "counts": [len(mesh.points), len(mesh.tets), len(fitted.maps)],
        "cube": None if cube is None else {name: np.asarray(getattr(cube, name)).tolist() for name in _CUBE},
    }
    buffer = io.BytesIO()
    arrays: dict[str, Any] = dict(arrays_of(mesh, fitted.maps, fitted.turns))
    np.savez_compressed(buffer, header=np.frombuffer(json.dumps(header).encode(), dtype=np.uint8), **arrays)
    return _seal(buffer.getvalue()) + buffer.getvalue()


def _is_whole(data: bytes) -> bool:
    return data[:_SEAL_LENGTH] == _seal(data[_SEAL_LENGTH:])


def _opened(data: bytes) -> Archive:
    return Archive(io.BytesIO(data[_SEAL_LENGTH:]), "the stored map", "a mesh and maps are needed")


def why_unusable(data: bytes) -> str | None:
    """Why ``from_bytes`` would refuse bytes that were stored for the same keys, without unpacking them; or None.

    Returns
    -------
    The end of a sentence about the stored map: "is damaged", or which version made it.
    """
    if not _is_whole(data):
        return "is damaged"
    try:
        version = json.loads(bytes(_opened(data).read(["header"])["header"]))["version"]
    except (InputError, *_UNREADABLE):
        return "is damaged"
    if not isinstance(version, int):
        return "is damaged"
    if _OLDEST <= version <= FORMAT_VERSION:
        return None
    return f"was made by {'an earlier' if version < FORMAT_VERSION else 'a later'} version of QC3D"


def from_bytes(data: bytes, pair: KeyPair) -> FittedMap:
    """Restore a map that ``to_bytes`` stored.

    Raises
    ------
    InputError
        If the bytes are damaged, have another version, or belong to other keys.
    """
    # Unpacking damaged data can fail in many ways, or not at all.
    if not _is_whole(data):
        raise InputError(_DAMAGED)
    try:
        archive = _opened(data)
        stored = archive.read(name for name in _ARRAYS if name in archive)
        header = json.loads(bytes(stored["header"]))
        version, owner = header["version"], header["fingerprint"]
    except (InputError, *_UNREADABLE) as error:
        raise InputError(_DAMAGED) from error
    if version not in range(_OLDEST, FORMAT_VERSION + 1):
        raise InputError(
            f"The stored map has format {version!r}, this version reads {FORMAT_VERSION}; fit the keys again."
        )
    try:
        options, engine = FitOptions(**header["options"]), str(header["engine"])
        notes = tuple(str(note) for note in header["notes"])
        cube = _cube(header.get("cube"))
        points, tets, maps, turns = (_plain_arrays if version <= _LAST_PLAIN else _arrays)(stored, header)
    except (InputError, *_UNREADABLE) as error:
        raise InputError(_DAMAGED) from error
    if owner != fingerprint(pair):
        raise InputError("The stored map belongs to other keys or another mesh; fit the keys again.")
    if points.ndim != 2 or points.shape[1] != 3 or maps.ndim != 3 or maps.shape[1:] != points.shape or len(maps) < 2:
        raise InputError(_DAMAGED)
    if tets.ndim != 2 or tets.shape[1] != 4 or not len(tets) or tets.min() < 0 or tets.max() >= len(points):
        raise InputError(_DAMAGED)
    if not np.isfinite(points).all() or not np.isfinite(maps).all():
        raise InputError(_DAMAGED)
    mesh = TetMesh(points, tets)
    # Jacobians exist only if no volume is zero.
    if not mesh.volumes.min() > 0.0 or not all(determinants(mesh.jacobians(values)).min() > 0.0 for values in maps):
        raise InputError(_DAMAGED)
    if turns is None:
        turns = turns_along(mesh, maps)
    elif turns.shape != (len(tets), 3) or not np.isfinite(turns).all():
        raise InputError(_DAMAGED)
    fitted = FittedMap.restored(pair, mesh, maps, turns, options, engine, notes, cube)
    if cube is not None and not cube.holds(fitted.embedding):
        raise InputError(_DAMAGED)
    return fitted


def _arrays(stored: Mapping[str, NDArray[Any]], header: dict[str, Any]) -> tuple[Floats, Ints, Floats, Floats | None]:
    """Points, tetrahedra, maps, and turns where they do not follow from the maps; raises as what reads damaged data."""
    points, tets, maps = (int(count) for count in header["counts"])
    mesh, values = mesh_and_maps(stored, (points, tets, maps))
    return mesh.points, mesh.tets, values, np.asarray(stored["turns"], np.float64) if "turns" in stored else None


def _plain_arrays(stored: Mapping[str, NDArray[Any]], header: dict[str, Any]) -> tuple[Floats, Ints, Floats, Floats]:
    """The same from earlier versions."""
    points, maps, turns = (np.asarray(stored[name], dtype=np.float64) for name in ("points", "maps", "turns"))
    return points, np.asarray(stored["tets"], dtype=np.int64), maps, turns


def _cube(values: dict[str, Any] | None) -> Cube | None:
    """The cube that ``to_bytes`` wrote; raises ValueError, KeyError or TypeError if it is none."""
    if values is None:
        return None
    axes, center, scale = (np.asarray(values[name], dtype=np.float64) for name in _CUBE)
    shapes = (axes.shape, center.shape, scale.shape)
    if shapes != ((3, 3), (3,), ()) or not all(np.isfinite(part).all() for part in (axes, center, scale)):
        raise ValueError("not a cube")
    if np.abs(axes @ axes.T - np.eye(3)).max() > _NOT_ORTHONORMAL or not scale > 0.0:
        raise ValueError("not a cube")
    return Cube(axes, center, float(scale))
