# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The record of combinations of shape keys, stored with the keys and never guessed from names."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace

import bpy

from ...solver.errors import InputError
from . import id_properties
from . import stored_values as stored
from .renames import digest

PROPERTY = "qc3d_combinations"
_MOST_KEYS = 4
_LONGEST_DIGEST = 64


@dataclass(frozen=True)
class Combined:
    """A combination of keys.

    Parameters
    ----------
    keys : tuple of str
        Names of the keys, the outermost first.
    made : tuple of (str, tuple of float)
        Names of the correction keys, each with the values of the combined keys at which it is fully on.
    digests : tuple of str
        Of the shapes of the base and the keys when they were combined; empty if an earlier version did that.
    """

    keys: tuple[str, ...]
    made: tuple[tuple[str, tuple[float, ...]], ...]
    digests: tuple[str, ...] = ()

    @classmethod
    def from_json(cls, values: object) -> Combined:
        """What ``dataclasses.asdict`` makes of it; raises ValueError, KeyError or TypeError for anything else."""
        found = stored.plain_dict(values)
        keys = tuple(stored.name(name) for name in stored.plain_list(found["keys"]))
        made = []
        for entry in stored.plain_list(found["made"]):
            name, places = stored.plain_list(entry)
            made.append((stored.name(name), tuple(stored.number(one, 0.0, 1.0) for one in stored.plain_list(places))))
        if not 2 <= len(set(keys)) == len(keys) <= _MOST_KEYS or any(len(places) != len(keys) for _, places in made):
            raise ValueError("not keys that are on at once")
        digests = tuple(stored.text(one, _LONGEST_DIGEST) for one in stored.plain_list(found.get("digests", [])))
        return cls(keys, tuple(made), digests)

    @property
    def label(self) -> str:
        """Name of the combination for the user."""
        return " + ".join(self.keys)


def read(keys: bpy.types.Key) -> list[Combined]:
    """The combinations whose keys still exist.

    Raises
    ------
    InputError
        If the record is damaged.
    """
    text = keys.get(PROPERTY)
    if text is None:
        return []
    try:
        every = [Combined.from_json(entry) for entry in stored.plain_list(stored.parse(text)["combinations"])]
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"The record of combinations on '{keys.name}' is damaged; delete the custom property '{PROPERTY}' "
            "of the shape keys, whose keys then are yours."
        ) from error
    there = [replace(one, made=tuple(made for made in one.made if is_driven(keys, made[0]))) for one in every]
    return [one for one in there if one.made]


def digests_of(keys: bpy.types.Key, names: Sequence[str]) -> tuple[str, ...]:
    """Digests of the shapes of the base of these keys and of the keys, in the order of their names."""
    base = keys.key_blocks[names[0]].relative_key
    return digest(base), *(digest(keys.key_blocks[name]) for name in sorted(names))


def is_outdated(keys: bpy.types.Key, one: Combined) -> bool:
    """Whether the base or a key has another shape than when the keys were combined, or a key is missing."""
    if not all(name in keys.key_blocks for name in one.keys):
        return True
    return bool(one.digests) and digests_of(keys, one.keys) != one.digests


def write(keys: bpy.types.Key, combinations: list[Combined], undo: ExitStack) -> None:
    """Replace the record; closing ``undo`` restores the previous one."""
    if combinations:
        text = json.dumps({"version": 1, "combinations": [asdict(one) for one in combinations]}, allow_nan=False)
        id_properties.put(keys, PROPERTY, text, undo)
    else:
        id_properties.remove(keys, PROPERTY, undo)


def names_made(keys: bpy.types.Key) -> set[str]:
    """Names of all correction keys."""
    return {name for one in read(keys) for name, _ in one.made}


def is_driven(keys: bpy.types.Key, name: str) -> bool:
    """Whether there is a key of that name with a driven value."""
    if name not in keys.key_blocks or keys.animation_data is None:
        return False
    path = f'key_blocks["{bpy.utils.escape_identifier(name)}"].value'
    return keys.animation_data.drivers.find(path) is not None
