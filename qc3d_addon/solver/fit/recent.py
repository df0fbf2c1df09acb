# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Remembers the last fitted maps with all that was computed from them, for a process that bakes again and again."""

from __future__ import annotations

import copy
import hashlib
from collections import OrderedDict

from ..keys.keypair import KeyPair
from .fitted_map import FittedMap
from .storage import fingerprint, from_bytes

# Factors, trees and tetrahedra of a map take some 30 MB, and 5 kB for each vertex: at most some 600 MB in all.
_MOST_MAPS = 4
_MOST_VERTICES = 100_000


class RecentFits:
    """The last fitted maps, by their stored form and their keys. Used from one thread at a time.

    What is remembered is never changed, so frames are the same with it and without it.
    """

    def __init__(self) -> None:
        self._fits: OrderedDict[bytes, FittedMap] = OrderedDict()

    def keep(self, data: bytes, fitted: FittedMap) -> None:
        """Remember a map that is stored as ``data``; those that were not used for longest are forgotten for it."""
        if len(fitted.pair.key0) > _MOST_VERTICES:
            return
        # The time that it took once is not that of the next bake.
        known = copy.copy(fitted)
        object.__setattr__(known, "seconds", {})
        key = _key(data, fitted.pair)
        self._fits[key] = known
        self._fits.move_to_end(key)
        while len(self._fits) > _MOST_MAPS or self._vertices > _MOST_VERTICES:
            self._fits.popitem(last=False)

    def restored(self, data: bytes, pair: KeyPair) -> FittedMap:
        """The map of a pair that is stored as ``data``, as ``storage.from_bytes`` restores it.

        Raises
        ------
        InputError
            As ``storage.from_bytes``.
        """
        found = self._fits.get(_key(data, pair))
        if found is None:
            found = from_bytes(data, pair)
        self.keep(data, found)
        return found

    @property
    def _vertices(self) -> int:
        return sum(len(fitted.pair.key0) for fitted in self._fits.values())


def _key(data: bytes, pair: KeyPair) -> bytes:
    """What tells a stored map of a pair from all others."""
    return hashlib.sha256(data).digest() + f"{fingerprint(pair)} {pair.planes}".encode()
