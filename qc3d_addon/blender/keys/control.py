# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What plays a chain: a number somewhere in the file that the drivers of the chain's shape keys read."""

from __future__ import annotations

import math
from typing import NamedTuple

import bpy

from ...solver.errors import InputError


class Control(NamedTuple):
    """A custom property of an object, the slider of a chain of its own.

    Parameters
    ----------
    owner
        The data block that has it.
    name
        What it is called there.
    """

    owner: bpy.types.ID
    name: str

    @property
    def path(self) -> str:
        """Its path from the owner."""
        return slider_path(self.name)

    @property
    def id_type(self) -> str:
        """The type of its owner, as drivers name it."""
        return 'OBJECT'

    @property
    def value(self) -> float:
        """Where it is; the control must have no ``problem``."""
        return float(self.owner[self.name])

    @property
    def problem(self) -> str | None:
        """Why it cannot play anything, or None. Quick enough for a panel."""
        owner, name = self.owner, self.name
        if name not in owner:
            return f"The slider '{name}' was deleted; re-bake it first."
        if not self.is_number:
            return (
                f"The slider '{name}' of '{owner.name}' is not a number any more; delete that custom property, then "
                "re-bake to have it again."
            )
        if math.isnan(owner[name]):
            return f"The slider '{name}' of '{owner.name}' has no value (NaN); give it one, or mend what drives it."
        return None

    @property
    def is_number(self) -> bool:
        """Whether it has a type that can play anything: the user may give it any other."""
        return isinstance(self.owner[self.name], (bool, int, float))

    def require(self) -> None:
        """Raise InputError where it cannot play anything."""
        problem = self.problem
        if problem is not None:
            raise InputError(problem)

    def of(self, owner: bpy.types.ID) -> Control:
        """The same control of another data block, such as a copy."""
        return self._replace(owner=owner)


def slider_path(name: str) -> str:
    """The path of a custom property from its object."""
    return f'["{bpy.utils.escape_identifier(name)}"]'


def value_path(key_name: str) -> str:
    """The path of a shape key's value from its data block."""
    return f'key_blocks["{bpy.utils.escape_identifier(key_name)}"].value'
