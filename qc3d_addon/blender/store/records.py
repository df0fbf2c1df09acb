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
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

import bpy

from ...solver.errors import InputError
from ...solver.settings import Easing
from . import id_properties
from . import stored_values as stored
from .chain_values import keyframe_values, keyframes_of, places_of, request_of
from .names import LIMIT
from .renames import renamed
from .summaries import Summary

if TYPE_CHECKING:
    from ...solver.frames.weights import Weights

PROPERTY = "qc3d"
# Version of the format that is written. In records of version 1, and of no version, chains have ``intervals``, a number
# of even steps with hat functions, instead of places and corners.
VERSION = 2

_LONGEST_KEY = 2 * LIMIT  # bytes; a mirror image may have invented key names, longer than Blender's limit
_LONGEST_FINGERPRINT = 1000
_LONGEST_DIGEST = 64


class DamagedRecordError(InputError):
    """The record is damaged: no version of QC3D writes it like this."""


@dataclass
class Chain:
    """A baked sequence of keys: its control and the shape keys that the control plays.

    Parameters
    ----------
    through
        Names of the user's own keys that the motion goes through, from the first to the last.
    slider
        Name of the custom property that plays the chain, and name of the chain.
    places
        Values of the control at which it shows a single shape, from 0 (step 0, the first key) to 1 (the last key).
    corners
        Steps at which the path through the shapes is not smooth: all inner ones if it is piecewise linear.
    keys
        Names of the generated shape keys, by step.
    keyframes
        Frames of the keyframes that a bake put on the control, at the first and the last key or at each; None if it put
        none.
    request
        The request of the newest bake, as plain values; empty for bakes of older versions. Only ``BakeRequest.again``
        reads it.
    result
        The results of the newest bake that the panel shows; None for bakes of older versions.
    on_key
        Name of the user's key whose value plays the chain, the last of ``through``; empty if a slider does. If it is
        not empty, ``slider`` is only the name of the chain.
    digests
        Hashes of the shapes of the keys ``through`` at the newest bake; empty for bakes of older versions.
    mirror_of
        Slider of the chain that this one is the mirror image of; empty if it was baked from its own keys.
    muted
        Names of the keys ``through`` whose own keyframes a bake muted, because they would add to what a slider shows.
    """

    through: tuple[str, ...]
    slider: str
    places: tuple[float, ...] = (0.0, 1.0)
    corners: tuple[int, ...] = ()
    keys: dict[int, str] = field(default_factory=dict)
    keyframes: tuple[int, ...] | None = None
    request: dict[str, Any] = field(default_factory=dict)
    result: Summary | None = None
    mirror_of: str = ""
    on_key: str = ""
    digests: tuple[str, ...] = ()
    muted: tuple[str, ...] = ()

    @classmethod
    def from_json(cls, values: object) -> Chain:
        """What ``dataclasses.asdict`` makes of it; raises ValueError, KeyError or TypeError for anything else."""
        found = dict(stored.plain_dict(values))
        through = tuple(stored.name(name, _LONGEST_KEY) for name in stored.plain_list(found.pop("through")))
        places, corners = places_of(found)
        by_text = stored.plain_dict(found.pop("keys"))
        steps = {str(step): step for step in range(len(places))}
        keys = {steps[text]: stored.name(name) for text, name in by_text.items()}
        if len(through) < 2 or any(name == following for name, following in pairwise(through)):
            raise ValueError("not a row of keys")
        if len(set(keys.values())) < len(keys):
            raise ValueError("one key for two steps")
        keyframes = found.pop("keyframes", None)
        if keyframes is not None:
            keyframes = keyframes_of(keyframes, len(through))
        request, result = request_of(found.pop("request", {})), Summary.from_json(found.pop("result", None))
        slider, mirror_of = stored.name(found.pop("slider")), stored.text(found.pop("mirror_of", ""), LIMIT)
        on_key = stored.text(found.pop("on_key", ""), LIMIT)
        digests = tuple(stored.text(one, _LONGEST_DIGEST) for one in stored.plain_list(found.pop("digests", [])))
        muted = tuple(stored.name(name, _LONGEST_KEY) for name in stored.plain_list(found.pop("muted", [])))
        if on_key not in ("", through[-1]):
            raise ValueError("played by a key that is not its last")
        if found:
            raise ValueError("values that are not known")
        row = (through, slider, places, corners, keys, keyframes)
        return cls(*row, request, result, mirror_of, on_key, digests, muted)

    @property
    def base(self) -> str:
        """Name of the key that the playing key is relative to; empty if a slider plays the chain."""
        return self.through[0] if self.on_key else ""

    @property
    def mode(self) -> str:
        """The mode of the newest bake; empty if unknown."""
        return self._setting("mode")

    @property
    def easing(self) -> Easing:
        """The easing of the newest bake; linear if unknown."""
        return next((known for known in get_args(Easing) if known == self._setting("easing")), "linear")

    @property
    def keyframe_values(self) -> list[tuple[float, float]]:
        """Frames and values of the keyframes that a bake put on the control."""
        return keyframe_values(self.keyframes or (), self.via_at)

    @property
    def via_at(self) -> tuple[float, ...]:
        """Places of the inner keys, where the newest bake was told them; otherwise empty: they are evenly spaced."""
        values = self.request.get("via_at")
        if not isinstance(values, list) or not all(isinstance(value, float) for value in values):
            return ()
        return tuple(values)

    def _setting(self, name: str) -> str:
        settings = self.request.get("settings")
        value = settings.get(name) if isinstance(settings, dict) else None
        return value if isinstance(value, str) else ""

    @property
    def intervals(self) -> int:
        """Number of intervals between the steps."""
        return len(self.places) - 1

    @property
    def weights(self) -> Weights:
        """The weights of the steps' shapes as functions of the control."""
        from ...solver.frames.weights import Weights  # scipy would make Blender start slower

        return Weights.smooth(self.places, self.corners)


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
