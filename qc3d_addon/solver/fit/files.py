# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of the fitted maps of a chain, so that another copy of the same mesh need not be fitted again.

A file consists of a magic number, a version, a JSON header, and the maps as ``storage.to_bytes`` makes them. It
contains no file names and nothing that is executed.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files.atomic import replacing
from ..files.npz import require_file, unreadable
from ..settings import FitOptions

_FIXED = struct.Struct("<8sHI")  # magic, version, bytes of the header
_MAGIC, _VERSION = b"QC3DMAPS", 1
_MOST_HEADER = 2**20
_OPTIONS = ("stretch", "extra_turns", "engine", "quality", "seed")
_LATER_OPTIONS = ("sampling", "threshold", "sparsity")  # which earlier versions did not write


@dataclass(frozen=True, eq=False)
class KeptMaps:
    """The fitted maps of a chain.

    Parameters
    ----------
    through : tuple of str
        Names of the keys from the first to the last.
    options : FitOptions
        The options that the maps were fitted with.
    maps : dict
        The stored map of each pair of consecutive keys, by the names of the two keys.
    """

    through: tuple[str, ...]
    options: FitOptions
    maps: dict[tuple[str, str], bytes]


def write_maps(path: Path, kept: KeptMaps) -> None:
    """Write the maps to a file, completely or not at all; raises InputError if it cannot be written."""
    ends = list(dict.fromkeys(pairwise(kept.through)))
    header = {
        "through": kept.through,
        "settings": {name: getattr(kept.options, name) for name in _OPTIONS + _LATER_OPTIONS},
        "sizes": [len(kept.maps[pair]) for pair in ends],
    }
    text = json.dumps(header).encode()
    with replacing(path) as unfinished:
        unfinished.write_bytes(
            b"".join([_FIXED.pack(_MAGIC, _VERSION, len(text)), text, *(kept.maps[pair] for pair in ends)])
        )


def read_maps(path: Path) -> KeptMaps:
    """Read a file that ``write_maps`` wrote; the maps themselves are checked by ``storage.from_bytes``.

    Raises
    ------
    InputError
        If the file cannot be read, is damaged, has another version, or is not a file of maps.
    """
    require_file(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise unreadable(path, error) from error
    if len(data) < _FIXED.size or data[: len(_MAGIC)] != _MAGIC:
        raise InputError(f"{path} is not a file of maps between shape keys; name one that Save Map wrote.")
    _, version, length = _FIXED.unpack_from(data)
    if version != _VERSION:
        raise InputError(f"{path} has version {version}; this program reads version {_VERSION}; save the map again.")
    if length > min(_MOST_HEADER, len(data) - _FIXED.size):
        raise InputError(f"{path} is damaged: it ends too early; save the map again.")
    body = data[_FIXED.size + length :]
    through, options, sizes = _header(data[_FIXED.size : _FIXED.size + length], path)
    ends = list(dict.fromkeys(pairwise(through)))
    if len(sizes) != len(ends) or min(sizes) < 0 or sum(sizes) != len(body):
        raise InputError(f"{path} is damaged: the sizes of its maps do not fit; save the map again.")
    maps, start = {}, 0
    for pair, size in zip(ends, sizes, strict=True):
        maps[pair] = body[start : start + size]
        start += size
    return KeptMaps(through, options, maps)


def _header(text: bytes, path: Path) -> tuple[tuple[str, ...], FitOptions, list[int]]:
    try:
        header: dict[str, Any] = json.loads(text)
        through, sizes, chosen = header["through"], header["sizes"], header["settings"]
        known = [*_OPTIONS, *(name for name in _LATER_OPTIONS if name in chosen)]
        options = FitOptions(**{name: chosen[name] for name in known})
    except (ValueError, KeyError, TypeError, RecursionError, InputError) as error:
        raise InputError(f"{path} is damaged: its header cannot be read; save the map again.") from error
    sound = (
        isinstance(through, list)
        and len(through) >= 2
        and all(isinstance(name, str) for name in through)
        and isinstance(sizes, list)
        and all(type(number) is int for number in sizes)
        and options.seed < 2**31
    )
    if not sound:
        raise InputError(f"{path} is damaged: its header makes no sense; save the map again.")
    return tuple(through), options, sizes
