# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In-betweens that the user has sculpted or locked since they were baked. A new bake keeps them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import bpy
import numpy as np

from ...solver.errors import InputError
from ..kinds import keys_of, mesh_of
from ..store import kept_shapes
from ..store.chain import Chain
from ..store.chain_values import LEAST_DISTANCE
from ..store.kept_shapes import Shape, Shapes
from ..store.mesh_data import key_coordinates
from .chain_keys import base_key, owned_keys

T = TypeVar("T")
_ROUNDING = 4e-7  # relative rounding error of single precision after Blender moved a shape along with another one


class Held(NamedTuple):
    """One in-between that a new bake keeps."""

    name: str
    current: Shape
    correction: Shape
    is_locked: bool


@dataclass(frozen=True)
class Sculpted:
    """The in-betweens of a chain that a new bake keeps.

    Parameters
    ----------
    held
        By place.
    before
        Shapes that the previous bake wrote, by place; empty if they are unknown.
    note
        A sentence if what was sculpted cannot be told from what was made; otherwise empty.
    """

    held: dict[float, Held]
    before: Shapes
    note: str = ""

    @classmethod
    def of(cls, obj: bpy.types.Object, chain: Chain) -> Sculpted:
        """The sculpted or locked in-betweens of a chain; none if it was never baked."""
        keys = keys_of(obj)
        owned = owned_keys(keys, chain)
        kept = kept_shapes.read(keys, chain.slider, len(mesh_of(obj).vertices)) if owned else None
        base_before, before = kept or (np.empty((0, 3), np.float32), {})
        base = key_coordinates(obj, base_key(keys, chain).name)
        held = {}
        for step, key in owned.items():
            place, current = chain.places[step], key_coordinates(obj, key.name)
            written = _at(before, place)
            correction = np.zeros_like(current) if written is None else _moved(current, written, base, base_before)
            if key.lock_shape or correction.any():
                held[place] = Held(key.name, current, correction, key.lock_shape)
        count, known = len(base), kept_shapes.vertices_before(keys, chain.slider) if owned else None
        note = ""
        if known not in (None, count):
            note = (
                f"The mesh has {count} vertices, and had {known} at the earlier bake, so what was sculpted into the "
                "in-betweens could not be told apart. They were made anew, except locked ones."
            )
        return cls(held, before, note)

    @property
    def places(self) -> tuple[float, ...]:
        """Places between the ends at which the new bake needs an in-between."""
        return tuple(place for place in self.held if 0.0 < place < 1.0)

    def require_among(self, places: tuple[float, ...]) -> None:
        """Raise InputError if a new bake has no step at the place of one of them."""
        for place in self.places:
            if _at(dict.fromkeys(places, True), place) is None:
                raise InputError(
                    f"'{self.held[place].name}' was sculpted or locked during the bake; bake again to keep it."
                )

    def kept(self, places: tuple[float, ...], shapes: dict[int, Shape]) -> tuple[dict[int, Shape], Shapes, list[str]]:
        """The shapes to write, by step; those to remember, by place; and sentences about what was kept."""
        written, remembered, sentences = {}, {}, [self.note] if self.note else []
        for step, shape in shapes.items():
            held = _at(self.held, places[step])
            written[step], remembered[places[step]] = shape, shape
            if held is not None and held.is_locked:
                written[step] = held.current
                earlier = _at(self.before, places[step])
                remembered[places[step]] = held.current if earlier is None else earlier
                sentences.append(f"'{held.name}' is locked and was left as it is.")
            elif held is not None:
                written[step] = shape + held.correction
                sentences.append(f"'{held.name}' keeps what was sculpted into it; delete it to have it made again.")
        return written, remembered, sentences


def _at(found: dict[float, T], place: float) -> T | None:
    """The value at a place, within ``LEAST_DISTANCE``."""
    return next((value for other, value in found.items() if abs(other - place) < LEAST_DISTANCE), None)


def _moved(current: Shape, written: Shape, base: Shape, base_before: Shape) -> Shape:
    """(n, 3) offsets that were sculpted into a key, without those of the key that it is relative to.

    When a key is edited, Blender moves along the keys that are relative to it; scripts do not.
    """
    difference = (current - base) - (written - base_before)
    rounding = _ROUNDING * np.abs(current).max(initial=0.0)
    difference[(current == written) | (np.abs(difference) <= rounding)] = 0.0
    return np.asarray(difference, dtype=np.float32)
