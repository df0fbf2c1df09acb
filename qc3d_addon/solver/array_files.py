# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys and frames as .npz files: read without trusting them, written whole or not at all."""

from __future__ import annotations

import os
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from numpy.lib.npyio import NpzFile
from numpy.typing import NDArray

from .errors import InputError
from .keypair import KeyPair
from .tetmesh import Floats

# All that reading a damaged or hostile archive has been seen to raise: truncated, corrupt, encrypted, absurd shapes.
_UNREADABLE = (OSError, ValueError, EOFError, MemoryError, OverflowError, RuntimeError, zipfile.BadZipFile, zlib.error)


def read_pair(path: Path, first: str, second: str) -> KeyPair:
    """Read two shapes of one mesh.

    Parameters
    ----------
    path : Path
        An .npz file with ``faces`` (m, 3), ``shape_names`` (k,) and the shapes ``V0``, ``V1``, ... (n, 3) in the order
        of the names. Other arrays are not looked at; pickled objects are refused.
    first, second : str
        Names of the two shapes.

    Raises
    ------
    InputError
        If the file cannot be read, lacks an array or a shape of that name, or holds unusable keys.
    """
    if first == second:
        raise InputError(f"The first and the second key are both {first!r}; choose two different keys.")
    try:
        archive = np.load(path, allow_pickle=False)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {_reason(error)}.") from error
    except _UNREADABLE:
        archive = None
    if not isinstance(archive, NpzFile):
        raise InputError(f"{path} is not an .npz file of arrays; faces, shape_names and V0, V1, ... are needed.")
    with archive:
        names = _array(archive, "shape_names", path)
        if names.ndim != 1 or names.dtype.kind != "U":
            raise InputError(f"shape_names in {path} must be a list of texts.")
        known = names.tolist()
        for name in (first, second):
            if name not in known:
                raise InputError(f"{path} has no shape {name!r}; it has {', '.join(map(repr, known)) or 'none'}.")
        key0, key1 = (_array(archive, f"V{known.index(name)}", path) for name in (first, second))
        faces = _array(archive, "faces", path)
    for key, name in ((key0, first), (key1, second)):
        if key.dtype.kind not in "fiu":
            raise InputError(f"The shape {name!r} in {path} holds {key.dtype} values; coordinates must be numbers.")
    return KeyPair.checked(key0, key1, faces)


def write_frames(path: Path, pair: KeyPair, times: Floats, frames: Floats) -> None:
    """Write frames (k, n, 3) at ``times`` (k,) with the faces and both keys of the pair, compressed.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    with path.open("wb") as file:
        np.savez_compressed(file, faces=pair.faces, frames=frames, times=times, key0=pair.key0, key1=pair.key1)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give the absolute name of a new file beside ``path``, which takes its place when the block ends well.

    Entering tells at once whether the place can be written, before any work; leaving by an error removes the new file
    and keeps what was there.

    Raises
    ------
    InputError
        If ``path`` cannot be written.
    """
    if path.is_dir():
        raise InputError(f"{path} is a folder; give the name of a file.")
    target = path.resolve()
    new = target.with_name(f".{target.stem}.{os.getpid()}.part{target.suffix}")
    try:
        new.touch(exist_ok=False)
        new.unlink()  # Blender would keep even an empty file as a backup of the one it saves
    except OSError as error:
        raise InputError(f"{path} cannot be written: {_reason(error)}.") from error
    try:
        yield new
        new.replace(target)
    finally:
        with suppress(FileNotFoundError):
            new.unlink()


def _array(archive: NpzFile, name: str, path: Path) -> NDArray[np.generic]:
    try:
        array: NDArray[np.generic] = archive[name]
    except KeyError:
        raise InputError(f"{path} has no array {name}; it has {', '.join(archive.files) or 'none'}.") from None
    except _UNREADABLE as error:
        raise InputError(f"The array {name} in {path} cannot be read: {_reason(error)}.") from error
    return array


def _reason(error: BaseException) -> str:
    """What went wrong as a clause: the system's own words where there are some, on one line, without a full stop."""
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return " ".join(text.split()).rstrip(".") or type(error).__name__
