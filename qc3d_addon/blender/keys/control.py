# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The control of a chain: the number that the drivers of the chain's shape keys read.

It is either the value of one of the user's keys, whose own controls then play the arc, or a new slider.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import bpy

from ...solver.errors import InputError
from ..store import id_properties
from ..store.chain import Chain


class Control(NamedTuple):
    """The value of a shape key, or a custom property of an object.

    Parameters
    ----------
    owner
        The data block that has it: shape keys, or an object.
    name
        Name of the key or the custom property.
    """

    owner: bpy.types.Object | bpy.types.Key
    name: str

    @property
    def is_key(self) -> bool:
        """Whether it is the value of a shape key."""
        return isinstance(self.owner, bpy.types.Key)

    @property
    def path(self) -> str:
        """Its path from the owner."""
        return value_path(self.name) if self.is_key else slider_path(self.name)

    @property
    def id_type(self) -> Literal['KEY', 'OBJECT']:
        """The type of its owner, as drivers name it."""
        return 'KEY' if self.is_key else 'OBJECT'

    @property
    def is_there(self) -> bool:
        """Whether the owner still has that key or property."""
        if isinstance(self.owner, bpy.types.Key):
            return self.name in self.owner.key_blocks
        return id_properties.has(self.owner, self.name)

    @property
    def value(self) -> float:
        """Its present value; the control must have no ``problem``."""
        if isinstance(self.owner, bpy.types.Key):
            return float(self.owner.key_blocks[self.name].value)
        return float(self.owner[self.name])

    @property
    def shown(self) -> tuple[bpy.types.bpy_struct, str]:
        """The struct and the name of the property in it, for a panel to draw."""
        if isinstance(self.owner, bpy.types.Key):
            return self.owner.key_blocks[self.name], "value"
        return self.owner, self.path

    @property
    def problem(self) -> str | None:
        """Why it cannot play anything, or None. Fast enough to call on every redraw of a panel."""
        owner, name = self.owner, self.name
        if not self.is_there:
            if self.is_key:
                return f"Shape key '{name}', which plays these in-betweens, was deleted; remove them."
            return f"The slider '{name}' was deleted; re-bake it first."
        if not self.is_number:
            return (
                f"The slider '{name}' of '{owner.name}' is no longer a number; delete that custom property, then "
                "re-bake to have it again."
            )
        if math.isnan(self.value):
            return f"The slider '{name}' of '{owner.name}' has no value (NaN); set one, or repair what drives it."
        return None

    @property
    def is_number(self) -> bool:
        """Whether its type is numeric: the user may change the type of a custom property."""
        return self.is_key or isinstance(self.owner[self.name], (bool, int, float))

    def require(self) -> None:
        """Raise InputError if it cannot play anything."""
        problem = self.problem
        if problem is not None:
            raise InputError(problem)

    def put(self, value: float) -> str | None:
        """Set its value; a sentence if it stays as it is."""
        if isinstance(self.owner, bpy.types.Key):
            animation = self.owner.animation_data
            if animation is not None and animation.drivers.find(self.path) is not None:
                return f"Key '{self.name}' is driven and stays where it is."
            self.owner.key_blocks[self.name].value = value
        elif isinstance(self.owner[self.name], float):
            self.owner[self.name] = value
        else:
            return f"The slider '{self.name}' takes whole numbers only and stays where it is."
        self.owner.update_tag()
        return None

    def of(self, owner: bpy.types.Object | bpy.types.Key) -> Control:
        """The same control of another data block, such as a copy."""
        return self._replace(owner=owner)


def path_of(chain: Chain) -> str:
    """RNA path of the control of a chain, from the data block that owns it."""
    return value_path(chain.on_key) if chain.on_key else slider_path(chain.slider)


def slider_path(name: str) -> str:
    """RNA path of a custom property, from its object."""
    return f'["{bpy.utils.escape_identifier(name)}"]'


def value_path(key_name: str) -> str:
    """RNA path of a shape key's value, from its data block."""
    return f"{key_path(key_name)}value"


def mute_path(key_name: str) -> str:
    """RNA path of a shape key's mute flag, from its data block."""
    return f"{key_path(key_name)}mute"


def key_path(key_name: str) -> str:
    """Common start of the RNA paths of all properties of a shape key."""
    return f'key_blocks["{bpy.utils.escape_identifier(key_name)}"].'
