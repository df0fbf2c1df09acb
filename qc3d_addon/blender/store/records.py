# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What QC3D remembers about its own work, kept with the shape keys it belongs to.

The record is an ID property of the shape keys' data block, so it is saved, copied and undone with them: which keys a
bake made (never guessed from names), and the prepared map of each pair of keys. A file comes from anywhere: whatever is
read is checked, types and ranges, before anything is done with it.
"""

from __future__ import annotations

import hashlib
import json
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy

from ...solver.errors import InputError
from . import id_properties
from . import stored_values as stored
from .names import LIMIT, MAX_STEPS
from .renames import renamed
from .summaries import Summary

if TYPE_CHECKING:
    from ...solver.frames.weights import Weights

PROPERTY = "qc3d"
# Of what is written. Records of version 1, and from before there was a number, have a number of even steps, with hats
# over them, in place of places and corners.
VERSION = 2

LEAST_DISTANCE = 1e-5  # between two places
_MOST_FRAME = 2**31  # from 0, either way
_LONGEST_KEY = 2 * LIMIT  # bytes: a mirror image goes through keys of names made up for it
_LONGEST_FINGERPRINT = 1000
_LONGEST_DIGEST = 64


class DamagedRecordError(InputError):
    """The record is not what any version writes."""


@dataclass
class Chain:
    """One baked pair or row of keys: its slider and the shape keys that the slider plays.

    Parameters
    ----------
    through
        Names of the user's own keys that the slider goes through, from the first to the last.
    slider
        Name of the custom property that plays the chain.
    places
        Positions of the control at which it shows one shape alone, from 0 (the first key, step 0) to 1 (the last key).
    corners
        Steps at which the path between the shapes turns: all inner ones where it goes straight from shape to shape.
    keys
        Generated shape keys: their names by step.
    keyframes
        First and last frame of the keyframes that a bake put on the slider, or None.
    request
        What the newest bake was asked for, as plain values; empty for those of older versions. Only
        ``BakeRequest.again`` looks into it.
    result
        What the panel shows of the newest bake, None for those of older versions.
    on_key
        Name of the user's key whose value plays the chain, the last of ``through``; empty where a slider of its own
        does. ``slider`` is then only what the chain is called.
    digests
        What tells the shapes of the keys ``through`` at the newest bake; empty for those of older versions.
    mirror_of
        Slider of the chain that this one is the mirror image of; empty where it was baked from keys of its own.
    """

    through: tuple[str, ...]
    slider: str
    places: tuple[float, ...] = (0.0, 1.0)
    corners: tuple[int, ...] = ()
    keys: dict[int, str] = field(default_factory=dict)
    keyframes: tuple[int, int] | None = None
    request: dict[str, Any] = field(default_factory=dict)
    result: Summary | None = None
    mirror_of: str = ""
    on_key: str = ""
    digests: tuple[str, ...] = ()

    @classmethod
    def from_json(cls, values: object) -> Chain:
        """What ``dataclasses.asdict`` makes of it; raises ValueError, KeyError or TypeError for anything else."""
        found = dict(stored.plain_dict(values))
        through = tuple(stored.name(name, _LONGEST_KEY) for name in stored.plain_list(found.pop("through")))
        places, corners = _places(found)
        by_text = stored.plain_dict(found.pop("keys"))
        steps = {str(step): step for step in range(len(places))}
        keys = {steps[text]: stored.name(name) for text, name in by_text.items()}
        if len(through) < 2 or any(name == following for name, following in pairwise(through)):
            raise ValueError("not a row of keys")
        if len(set(keys.values())) < len(keys):
            raise ValueError("one key for two steps")
        keyframes = found.pop("keyframes", None)
        if keyframes is not None:
            first, last = (stored.whole(frame, -_MOST_FRAME, _MOST_FRAME) for frame in stored.plain_list(keyframes))
            if first >= last:
                raise ValueError("keyframes without time between them")
            keyframes = (first, last)
        request, result = _request(found.pop("request", {})), Summary.from_json(found.pop("result", None))
        slider, mirror_of = stored.name(found.pop("slider")), stored.text(found.pop("mirror_of", ""), LIMIT)
        on_key = stored.text(found.pop("on_key", ""), LIMIT)
        digests = tuple(stored.text(one, _LONGEST_DIGEST) for one in stored.plain_list(found.pop("digests", [])))
        if on_key not in ("", through[-1]):
            raise ValueError("played by a key that is not its last")
        if found:
            raise ValueError("values that are not known")
        return cls(through, slider, places, corners, keys, keyframes, request, result, mirror_of, on_key, digests)

    @property
    def base(self) -> str:
        """Name of the key that the one which plays the chain is relative to; empty where there is a slider."""
        return self.through[0] if self.on_key else ""

    @property
    def mode(self) -> str:
        """The mode of the newest bake; empty where that is not known."""
        settings = self.request.get("settings")
        mode = settings.get("mode") if isinstance(settings, dict) else None
        return mode if isinstance(mode, str) else ""

    @property
    def intervals(self) -> int:
        """Number of steps from the first key to the last."""
        return len(self.places) - 1

    @property
    def weights(self) -> Weights:
        """What the control plays: how much of each step's shape at each of its positions."""
        from ...solver.frames.weights import Weights  # scipy would make Blender start slower

        return Weights.smooth(self.places, self.corners)


@dataclass(frozen=True)
class KeptMap:
    """Where the prepared map of a pair is kept, and what it was made from."""

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
    """Everything remembered about one mesh's shape keys."""

    chains: list[Chain] = field(default_factory=list)
    maps: list[KeptMap] = field(default_factory=list)

    @classmethod
    def read(cls, keys: bpy.types.Key) -> Record:
        """The record of ``keys``; empty where nothing was baked yet.

        Raises
        ------
        InputError
            If the record is damaged (DamagedRecordError), or a later version wrote it.
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
                "In-Betweens, which keeps all shape keys and sliders, then bake anew."
            ) from error
        return cls(chains, maps)

    def _follow(self, keys: bpy.types.Key) -> None:
        """Take the names that keys of chains have now where they were renamed; their maps are made again."""
        for chain in self.chains:
            names = renamed(keys, chain.through, chain.digests, chain.on_key, chain.keys.values())
            chain.through = tuple(names.get(name, name) for name in chain.through)
            chain.on_key = names.get(chain.on_key, chain.on_key)

    def write(self, keys: bpy.types.Key, undo: ExitStack) -> None:
        """Keep the record with ``keys``, without the maps of keys that no longer exist; ``undo`` can take it back."""
        names = set(keys.key_blocks.keys())
        for kept in [kept for kept in self.maps if not {kept.from_key, kept.to_key} <= names]:
            self.maps.remove(kept)
            id_properties.remove(keys, kept.property_name, undo)
        text = json.dumps({"version": VERSION, **asdict(self)}, allow_nan=False)
        self._parsed(text, keys.name)  # what could not be read again is never written
        id_properties.put(keys, PROPERTY, text, undo)

    def chain(self, through: tuple[str, ...], mode: str = "") -> Chain | None:
        """The chain through these keys on a slider of its own, in this mode or any, if it was baked before."""
        found = [chain for chain in self.chains if chain.through == through and not chain.on_key]
        return next((chain for chain in found if not mode or chain.mode in ("", mode)), None)

    def chain_on_key(self, name: str) -> Chain | None:
        """The chain that the value of a key plays, if it was baked before."""
        return next((chain for chain in self.chains if chain.on_key == name), None)

    def chain_of_slider(self, slider: str) -> Chain | None:
        """The chain that a slider plays; the newest where the name is empty."""
        if not slider:
            return self.chains[-1] if self.chains else None
        return next((chain for chain in self.chains if chain.slider == slider), None)

    def kept_map(self, keys: bpy.types.Key, wanted: KeptMap) -> bytes | None:
        """The bytes of the map that was made from exactly what ``wanted`` names, if it is kept."""
        data = keys.get(wanted.property_name) if wanted in self.maps else None
        return data if isinstance(data, bytes) else None

    def keep_map(self, keys: bpy.types.Key, kept: KeptMap, data: bytes, undo: ExitStack) -> None:
        """Keep a map in place of an older one of the same pair; ``write`` must follow."""
        self.maps = [other for other in self.maps if (other.from_key, other.to_key) != (kept.from_key, kept.to_key)]
        self.maps.append(kept)
        id_properties.put(keys, kept.property_name, data, undo)


class State(NamedTuple):
    """What there is to do with a record: the number of its chains, and what is wrong with it."""

    chains: int
    problem: str | None = None
    is_damaged: bool = False


def state(keys: bpy.types.Key) -> State:
    """Examine the record of ``keys``; quick enough for buttons that are drawn all the time."""
    text = keys.get(PROPERTY)
    if text is None:
        return State(0)
    # Anything but a text is damaged, whatever it says.
    return _state(text if isinstance(text, str) else "", keys.name)


@lru_cache(maxsize=64)
def _state(text: str, owner: str) -> State:
    try:
        return State(len(Record._parsed(text, owner).chains))
    except InputError as error:
        return State(0, str(error), isinstance(error, DamagedRecordError))


def _places(found: dict[str, Any]) -> tuple[tuple[float, ...], tuple[int, ...]]:
    """The places and corners among a chain's values, which are taken out of them."""
    if "intervals" in found:
        intervals = stored.whole(found.pop("intervals"), 1, MAX_STEPS)
        return tuple(step / intervals for step in range(intervals + 1)), tuple(range(1, intervals))
    places = tuple(stored.number(place, 0.0, 1.0) for place in stored.plain_list(found.pop("places")))
    corners = tuple(stored.whole(step, 1, len(places) - 2) for step in stored.plain_list(found.pop("corners")))
    if not 2 <= len(places) <= MAX_STEPS + 1 or (places[0], places[-1]) != (0.0, 1.0):
        raise ValueError("not places from 0 to 1")
    if any(later - place < LEAST_DISTANCE for place, later in pairwise(places)):
        raise ValueError("places that are not in order")
    if any(later <= step for step, later in pairwise(corners)):
        raise ValueError("corners that are not in order")
    return places, corners


def _request(values: object) -> dict[str, Any]:
    """What a bake was asked for, as it is: plain values, and dictionaries and lists of plain values."""
    found = stored.plain_dict(values)
    for value in found.values():
        for inner in value.values() if isinstance(value, dict) else value if isinstance(value, list) else (value,):
            if isinstance(inner, (dict, list)):
                raise ValueError("nested too deep")
    return found
