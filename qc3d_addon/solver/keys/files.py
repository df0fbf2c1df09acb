# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading keys from .npz files."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files.npz import Archive, Header, open_archive
from ..settings import Mirror, Quality
from ..support.memory import estimated_mb, machine_limit_mb, require_memory
from ..triangles.polygons import labels_by_sides
from .keypair import Ends, KeyPair, consecutive_pairs

NEEDED = "faces, shape_names and V0, V1, ... are needed"


def read_pairs(
    path: Path,
    names: Sequence[str],
    *,
    frames: int = 0,
    quality: Quality = "normal",
    needs_fits: bool = True,
    mirror: Mirror = "none",
) -> dict[Ends, KeyPair]:
    """Read the pairs of consecutive shapes of one mesh, by the names of their two ends.

    Parameters
    ----------
    path : Path
        An .npz file with ``faces`` (m, 3), ``shape_names`` (k,) and the shapes ``V0``, ``V1``, ... (n, 3) in the order
        of the names; and, if it has them, ``polygons``: for each triangle the number of its polygon (m,), or the
        corners of the polygons (p, c), short ones filled up with -1. Other arrays are not
        looked at; pickled objects are refused.
    names : sequence of str
        Names of two or more shapes, no name twice in a row.
    frames : int
        Number of frames that will be computed from the pairs.
    quality : Quality
        Resolution of the volume that will be used.
    needs_fits : bool
        Whether the pairs will be fitted. These three decide how much memory is needed, which is checked before the
        arrays are read.
    mirror : Mirror or sequence of MirrorPlane
        Whether the mesh is one half; see ``consecutive_pairs``.

    Raises
    ------
    InputError
        If the file cannot be read, lacks an array or a shape of that name, or holds unusable keys; or if the machine
        does not have enough memory.
    """
    pairs = len(set(pairwise(names)))
    shapes, faces, polygons = read_shapes(
        path, names, pairs=pairs, frames=frames, quality=quality, needs_fits=needs_fits
    )
    return consecutive_pairs(shapes, faces, None, names, polygons, mirror)


def read_shapes(
    path: Path,
    names: Sequence[str],
    *,
    pairs: int = 0,
    frames: int = 0,
    quality: Quality = "normal",
    needs_fits: bool = True,
) -> tuple[dict[str, NDArray[Any]], NDArray[Any], NDArray[Any] | None]:
    """Shapes (n, 3) of one mesh by their names, its triangles (m, 3), and their polygons (m,) where the file has them.

    See ``read_pairs``; memory is checked for so many ``pairs``.
    """
    with open_archive(path, NEEDED) as archive:
        return shapes_in(
            archive, path, names, pairs=pairs, frames=frames, quality=quality, needs_fits=needs_fits
        )


def shapes_in(
    archive: Archive,
    path: Path,
    names: Sequence[str],
    *,
    pairs: int = 0,
    frames: int = 0,
    quality: Quality = "normal",
    needs_fits: bool = True,
) -> tuple[dict[str, NDArray[Any]], NDArray[Any], NDArray[Any] | None]:
    """What ``read_shapes`` reads, from an archive that is open; ``path`` is for error messages."""
    known = _shape_names(archive, path)
    for name in names:
        if name not in known:
            raise InputError(f"{path} has no shape {name!r}; it has {', '.join(map(repr, known)) or 'none'}.")
    arrays = {name: f"V{known.index(name)}" for name in names}
    polygons = ["polygons"] if "polygons" in archive else []
    headers = archive.headers(["faces", *polygons, *dict.fromkeys(arrays.values())])
    for name, array in arrays.items():
        _require_coordinates(headers[array], name, path)
    vertices, triangles = (max(headers[name].rows for name in group) for group in (arrays.values(), ["faces"]))
    needed = estimated_mb(vertices, pairs, frames, quality, needs_fits, triangles)
    if limit := machine_limit_mb():
        require_memory(needed, limit, vertices)
    found = archive.read(headers)
    labels = polygon_labels(found["polygons"], found["faces"]) if polygons else None
    return {name: found[array] for name, array in arrays.items()}, found["faces"], labels


def read_pair(path: Path, first: str, second: str, quality: Quality = "normal") -> KeyPair:
    """Read the pair of two shapes by their names; see ``read_pairs``."""
    return read_pairs(path, (first, second), quality=quality)[first, second]


def polygon_labels(polygons: NDArray[Any], faces: NDArray[Any]) -> NDArray[Any]:
    """(m,) the polygon of each triangle (m, 3), from that or from the corners of all polygons (p, c), in any order.

    Raises
    ------
    InputError
        If a triangle is part of none of the polygons.
    """
    if polygons.ndim != 2:
        return polygons
    problem = "The polygons are not those that the triangles are parts of; give the polygon of each triangle instead."
    if polygons.dtype.kind not in "iu" or faces.dtype.kind not in "iu" or faces.ndim != 2 or faces.shape[1] != 3:
        raise InputError(problem)
    labels = labels_by_sides(faces.astype(np.int64), polygons.astype(np.int64))
    inside = (faces[:, :, None] == polygons[labels][:, None, :]).any(axis=2).all(axis=1)
    if not (inside & (labels >= 0)).all():
        raise InputError(problem)
    return labels


def _shape_names(archive: Archive, path: Path) -> list[str]:
    header = archive.headers(["shape_names"])["shape_names"]
    if len(header.shape) != 1 or header.dtype.kind != "U":
        raise InputError(f"shape_names in {path} must be a list of texts, a name for each shape.")
    if header.rows > len(archive.names):
        raise InputError(
            f"shape_names in {path} names {header.rows} shapes, and the file holds {len(archive.names)} arrays; "
            "export it again."
        )
    known: list[str] = archive.read(["shape_names"])["shape_names"].tolist()
    return known


def _require_coordinates(header: Header, name: str, path: Path) -> None:
    if header.dtype.kind not in "fiu":
        raise InputError(f"The shape {name!r} in {path} holds {header.dtype} values; coordinates must be numbers.")
    if len(header.shape) != 2 or header.shape[1] != 3:
        raise InputError(f"The shape {name!r} in {path} has the shape {header.shape}; positions must be (n, 3).")
