# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The record of a mesh's bakes, stored with its shape keys.

The record is a custom property of the shape keys' data block, so that it is saved, copied and undone with them. It says
which keys a bake made, which is never guessed from names, and which maps are stored. Files come from anywhere, so the
types and ranges of everything that is read are checked before it is used.
"""

from __future__ import annotations

import hashlib
import json
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from typing import NamedTuple

import bpy

from ...solver.errors import InputError
from . import id_properties
from . import stored_values as stored
from .chain import Chain
from .renames import renamed

PROPERTY = "qc3d"
# Version of the format that is written. In records of version 1, and of no version, chains have ``intervals``, a number
# of even steps with hat functions, instead of places and corners.
VERSION = 2

_LONGEST_FINGERPRINT = 1000


class DamagedRecordError(InputError):
    """The record is damaged: no version of QC3D writes it like this."""


@dataclass(frozen=True)
class KeptMap:
    """The entry of a stored map: its pair of keys, and a fingerprint of what it was made from."""

    from_key: str
    to_key: str
    fingerprint: str

    @classmethod
    def from_json(cls, values: object) -> KeptMap:
        """What ``dataclasses.asdict`` makes of it; raises ValueError or TypeError for anything else."""
        found = stored.plain_dict(values)
        return cls(**{name: stored.text(value, _LONGEST_FINGERPRINT) for name, value in found.items()})

    @property
    def property_name(self) -> str:
        """Name of the ID property that holds the map's bytes."""
        pair = json.dumps([self.from_key, self.to_key])
        return f"{PROPERTY}_map_{hashlib.sha256(pair.encode()).hexdigest()[:16]}"


@dataclass
class Record:
    """The record of one mesh's shape keys: its chains and the entries of its stored maps."""

    chains: list[Chain] = field(default_factory=list)
    maps: list[KeptMap] = field(default_factory=list)

    @classmethod
    def read(cls, keys: bpy.types.Key) -> Record:
        """The record of ``keys``; empty if nothing has been baked yet.

        Raises
        ------
        InputError
            If the record is damaged (DamagedRecordError) or was written by a later version.
        """
        text = keys.get(PROPERTY)
        if text is None:
            return cls()
        record = cls._parsed(text, keys.name)
        record._follow(keys)
        return record

    @classmethod
    def _parsed(cls, text: object, owner: str) -> Record:
        try:
            values = stored.parse(text)
            if stored.whole(values.get("version", 0), 0, 2**63) > VERSION:
                raise InputError(
                    f"The record of earlier bakes on '{owner}' was written by a later version of QC3D; install that "
                    "version to work on these shape keys."
                )
            chains = [Chain.from_json(entry) for entry in stored.plain_list(values["chains"])]
            maps = [KeptMap.from_json(entry) for entry in stored.plain_list(values["maps"])]
            controls = [chain.on_key or (chain.through, chain.mode) for chain in chains]
            for of_each in ([chain.slider for chain in chains], controls):
                if len(set(of_each)) < len(of_each):
                    raise ValueError("two chains with one slider, or through the same keys")
        except (ValueError, KeyError, TypeError) as error:
            raise DamagedRecordError(
                f"The record of earlier bakes on '{owner}' is damaged; press Forget Damaged Record under Baked "
                "In-Betweens, which keeps all shape keys and sliders, then bake again."
            ) from error
        return cls(chains, maps)

    def _follow(self, keys: bpy.types.Key) -> None:
        """Update the names of keys that were renamed; their maps will be computed again."""
        for chain in self.chains:
            names = renamed(keys, chain.through, chain.digests, chain.on_key, chain.keys.values())
            chain.through = tuple(names.get(name, name) for name in chain.through)
            chain.on_key = names.get(chain.on_key, chain.on_key)
            chain.muted = tuple(names.get(name, name) for name in chain.muted)

    def write(self, keys: bpy.types.Key, undo: ExitStack) -> None:
        """Store the record with ``keys``, without the maps of deleted keys; closing ``undo`` undoes that."""
        names = set(keys.key_blocks.keys())
        for kept in [kept for kept in self.maps if not {kept.from_key, kept.to_key} <= names]:
            self.maps.remove(kept)
            id_properties.remove(keys, kept.property_name, undo)
        text = json.dumps({"version": VERSION, **asdict(self)}, allow_nan=False)
        self._parsed(text, keys.name)  # what could not be read again is never written
        id_properties.put(keys, PROPERTY, text, undo)

    def chain(self, through: tuple[str, ...], mode: str = "") -> Chain | None:
        """The chain with a slider through these keys, in this mode or, by default, in any; None if not baked."""
        found = [chain for chain in self.chains if chain.through == through and not chain.on_key]
        return next((chain for chain in found if not mode or chain.mode in ("", mode)), None)

    def chain_on_key(self, name: str) -> Chain | None:
        """The chain that the value of a key plays; None if not baked."""
        return next((chain for chain in self.chains if chain.on_key == name), None)

    def chain_of_slider(self, slider: str) -> Chain | None:
        """The chain of a slider; the newest if the name is empty."""
        if not slider:
            return self.chains[-1] if self.chains else None
        return next((chain for chain in self.chains if chain.slider == slider), None)

    def kept_map(self, keys: bpy.types.Key, wanted: KeptMap) -> bytes | None:
        """The bytes of the stored map with exactly this entry, or None."""
        data = keys.get(wanted.property_name) if wanted in self.maps else None
        return data if isinstance(data, bytes) else None

    def keep_map(self, keys: bpy.types.Key, kept: KeptMap, data: bytes, undo: ExitStack) -> None:
        """Store a map, replacing an older one of the same pair; ``write`` must follow."""
        self.maps = [other for other in self.maps if (other.from_key, other.to_key) != (kept.from_key, kept.to_key)]
        self.maps.append(kept)
        id_properties.put(keys, kept.property_name, data, undo)


class State(NamedTuple):
    """The state of a record: the number of its chains, and what is wrong with it."""

    chains: int
    problem: str | None = None
    is_damaged: bool = False


def state(keys: bpy.types.Key) -> State:
    """The state of the record of ``keys``. Fast enough for every redraw of a button."""
    text = keys.get(PROPERTY)
    if text is None:
        return State(0)
    # Anything other than a string is damaged.
    return _state(text if isinstance(text, str) else "", keys.name)


@lru_cache(maxsize=64)
def _state(text: str, owner: str) -> State:
    try:
        return State(len(Record._parsed(text, owner).chains))
    except InputError as error:
        return State(0, str(error), isinstance(error, DamagedRecordError))
