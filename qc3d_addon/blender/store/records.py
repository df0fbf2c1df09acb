# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What QC3D remembers about its own work, kept with the shape keys it belongs to.

The record is an ID property of the shape keys' data block, so it is saved, copied and undone with them: which keys a
bake made (never guessed from names), and the prepared map of each pair of keys.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field
from typing import Any

import bpy

from ...solver.errors import InputError

PROPERTY = "qc3d"


@dataclass
class Chain:
    """One baked pair or row of keys: its slider and the shape keys that the slider plays.

    Parameters
    ----------
    through
        Names of the user's own keys that the slider goes through, from the first to the last.
    slider
        Name of the custom property that plays the chain.
    intervals
        Number of steps from the first key to the last.
    keys
        Generated shape keys: their names by step, 0 (first key) to ``intervals`` (last key).
    keyframes
        First and last frame of the keyframes that a bake put on the slider, or None.
    request
        What the newest bake was asked for, as plain values; empty for those of older versions.
    result
        What the panel shows of the newest bake, as plain values.
    mirror_of
        Slider of the chain that this one is the mirror image of; empty where it was baked from keys of its own.
    """

    through: tuple[str, ...]
    slider: str
    intervals: int = 0
    keys: dict[int, str] = field(default_factory=dict)
    keyframes: tuple[int, int] | None = None
    request: dict[str, Any] = field(default_factory=dict)
    result: dict[str, Any] = field(default_factory=dict)
    mirror_of: str = ""


@dataclass(frozen=True)
class KeptMap:
    """Where the prepared map of a pair is kept, and what it was made from."""

    from_key: str
    to_key: str
    fingerprint: str

    @property
    def property_name(self) -> str:
        """Name of the ID property that holds the map's bytes."""
        pair = json.dumps([self.from_key, self.to_key])
        return f"{PROPERTY}_map_{hashlib.sha256(pair.encode()).hexdigest()[:16]}"


@dataclass
class Record:
    """Everything remembered about one mesh's shape keys."""

    chains: list[Chain] = field(default_factory=list)
    maps: list[KeptMap] = field(default_factory=list)

    @classmethod
    def read(cls, keys: bpy.types.Key) -> Record:
        """The record of ``keys``; empty where nothing was baked yet.

        Raises
        ------
        InputError
            If the record is not what this module writes.
        """
        text = keys.get(PROPERTY)
        if text is None:
            return cls()
        try:
            stored = json.loads(text)
            return cls([_chain(entry) for entry in stored["chains"]], [KeptMap(**entry) for entry in stored["maps"]])
        except (TypeError, ValueError, KeyError, AttributeError) as error:
            raise InputError(
                f"The record of earlier bakes on '{keys.name}' is damaged; delete its custom property "
                f"'{PROPERTY}' and remove the keys of earlier bakes by hand."
            ) from error

    def write(self, keys: bpy.types.Key) -> None:
        """Keep the record with ``keys``, without the maps of keys that no longer exist."""
        names = keys.key_blocks.keys()
        for kept in [kept for kept in self.maps if not {kept.from_key, kept.to_key}.issubset(names)]:
            self.maps.remove(kept)
            keys.pop(kept.property_name, None)
        keys[PROPERTY] = json.dumps(asdict(self))

    def chain(self, through: tuple[str, ...]) -> Chain | None:
        """The chain through these keys, if it was baked before."""
        return next((chain for chain in self.chains if chain.through == through), None)

    def chain_of_slider(self, slider: str) -> Chain | None:
        """The chain that a slider plays; the newest where the name is empty."""
        if not slider:
            return self.chains[-1] if self.chains else None
        return next((chain for chain in self.chains if chain.slider == slider), None)

    def kept_map(self, keys: bpy.types.Key, wanted: KeptMap) -> bytes | None:
        """The bytes of the map that was made from exactly what ``wanted`` names, if it is kept."""
        data = keys.get(wanted.property_name) if wanted in self.maps else None
        return data if isinstance(data, bytes) else None

    def keep_map(self, keys: bpy.types.Key, kept: KeptMap, data: bytes) -> None:
        """Keep a map in place of an older one of the same pair; ``write`` must follow."""
        self.maps = [other for other in self.maps if (other.from_key, other.to_key) != (kept.from_key, kept.to_key)]
        self.maps.append(kept)
        # Blender cuts bytes at their first zero where they overwrite bytes; a new property keeps them whole.
        keys.pop(kept.property_name, None)
        keys[kept.property_name] = data


def _chain(entry: dict[str, object]) -> Chain:
    chain = Chain(**entry)  # type: ignore[arg-type]
    chain.through = tuple(str(name) for name in chain.through)
    chain.keys = {int(step): str(name) for step, name in dict(chain.keys).items()}
    chain.keyframes = None if chain.keyframes is None else (int(chain.keyframes[0]), int(chain.keyframes[1]))
    chain.request, chain.result = dict(chain.request), dict(chain.result)
    return chain
