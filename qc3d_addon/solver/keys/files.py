# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading keys from .npz files."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from ..errors import InputError
from ..files.npz import Archive, Header, open_archive
from ..settings import Quality
from ..support.memory import estimated_mb, machine_limit_mb, require_memory
from .keypair import Ends, KeyPair, consecutive_pairs


def read_pairs(
    path: Path, names: Sequence[str], *, frames: int = 0, quality: Quality = "normal", needs_fits: bool = True
) -> dict[Ends, KeyPair]:
    """Read the pairs of consecutive shapes of one mesh, by the names of their two ends.

    Parameters
    ----------
    path : Path
        An .npz file with ``faces`` (m, 3), ``shape_names`` (k,) and the shapes ``V0``, ``V1``, ... (n, 3) in the order
        of the names. Other arrays are ignored; pickled objects are refused.
    names : sequence of str
        Names of two or more shapes, no name twice in a row.
    frames : int
        Number of frames that will be computed from the pairs.
    quality : Quality
        Resolution of the volume that will be used.
    needs_fits : bool
        Whether the pairs will be fitted. These three decide how much memory is needed, which is checked before the
        arrays are read.

    Raises
    ------
    InputError
        If the file cannot be read, lacks an array or a shape of that name, or holds unusable keys; or if the machine
        does not have enough memory.
    """
    with open_archive(path, "faces, shape_names and V0, V1, ... are needed") as archive:
        known = _shape_names(archive, path)
        for name in names:
            if name not in known:
                raise InputError(f"{path} has no shape {name!r}; it has {', '.join(map(repr, known)) or 'none'}.")
        arrays = {name: f"V{known.index(name)}" for name in names}
        headers = archive.headers(["faces", *dict.fromkeys(arrays.values())])
        for name, array in arrays.items():
            _require_coordinates(headers[array], name, path)
        vertices, triangles = (max(headers[name].rows for name in group) for group in (arrays.values(), ["faces"]))
        pairs = len(set(pairwise(names)))
        needed = estimated_mb(vertices, pairs, frames, quality, needs_fits, triangles)
        if limit := machine_limit_mb():
            require_memory(needed, limit, vertices)
        found = archive.read(headers)
    return consecutive_pairs({name: found[array] for name, array in arrays.items()}, found["faces"], None, names)


def read_pair(path: Path, first: str, second: str, quality: Quality = "normal") -> KeyPair:
    """Read the pair of two shapes by their names; see ``read_pairs``."""
    return read_pairs(path, (first, second), quality=quality)[first, second]


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
