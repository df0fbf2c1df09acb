# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys read from .npz files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError
from ..files.npz import open_archive, read_array
from .keypair import Ends, KeyPair, consecutive_pairs


def read_pairs(path: Path, names: Sequence[str]) -> dict[Ends, KeyPair]:
    """Read shapes of one mesh: the pair of every two of ``names`` that follow each other, by their names.

    Parameters
    ----------
    path : Path
        An .npz file with ``faces`` (m, 3), ``shape_names`` (k,) and the shapes ``V0``, ``V1``, ... (n, 3) in the order
        of the names. Other arrays are not looked at; pickled objects are refused.
    names : sequence of str
        Names of two shapes or more, no name twice in a row.

    Raises
    ------
    InputError
        If the file cannot be read, lacks an array or a shape of that name, or holds unusable keys.
    """
    with open_archive(path, "faces, shape_names and V0, V1, ... are needed") as archive:
        shape_names = read_array(archive, "shape_names", path)
        if shape_names.ndim != 1 or shape_names.dtype.kind != "U":
            raise InputError(f"shape_names in {path} must be a list of texts, a name for each shape.")
        known = shape_names.tolist()
        for name in names:
            if name not in known:
                raise InputError(f"{path} has no shape {name!r}; it has {', '.join(map(repr, known)) or 'none'}.")
        keys = {name: read_array(archive, f"V{known.index(name)}", path) for name in names}
        faces = read_array(archive, "faces", path)
    for name, key in keys.items():
        if key.dtype.kind not in "fiu":
            raise InputError(f"The shape {name!r} in {path} holds {key.dtype} values; coordinates must be numbers.")
    return consecutive_pairs(keys, faces, None, names)


def read_pair(path: Path, first: str, second: str) -> KeyPair:
    """Two shapes of one mesh by their names; see ``read_pairs``."""
    return read_pairs(path, (first, second))[first, second]
