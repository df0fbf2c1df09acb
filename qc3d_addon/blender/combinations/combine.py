# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes correction keys for shape keys that are on at once, over the whole range of their values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...solver.arrays import Floats
from ...solver.errors import InputError
from .. import compat
from ..keys import shape_keys
from ..keys.control import mute_path, value_path
from ..kinds import keys_of, present
from ..store import checks, combined_keys, names
from ..store.combined_keys import Combined
from ..store.mesh_data import key_coordinates, set_key_coordinates
from .halves import MirroredShapes
from .probe import probed

if TYPE_CHECKING:
    from ...solver.settings import FitOptions

# A correction is close to the product of the values: parabolas through these follow it, and need a key for each pair.
PLACES = (0.5, 1.0)
_MOST_KEYS = 3
# Of the size: what is less than this of a difference between the sum and what the keys show is rounding.
_ROUNDING = 1e-5


@dataclass(frozen=True)
class Made:
    """The result of combining keys.

    Parameters
    ----------
    combined : Combined
    is_sculpted : bool
        Whether the user had sculpted a key for the combination, which stays as it is.
    crossings : int
        Largest number of pairs of triangles that cross in a corrected shape but in none of the keys.
    off : float
        Largest distance of the plain sum from the corrected shape, over the size.
    """

    combined: Combined
    is_sculpted: bool
    crossings: int
    off: float

    @property
    def text(self) -> str:
        """One sentence."""
        crosses = f", {self.crossings} pairs of triangles cross" if self.crossings else ""
        own = "; your own shape for all of them stays" if self.is_sculpted else ""
        return (
            f"{self.combined.label}: {len(self.combined.made)} keys correct the sum, which was off by {self.off:.1%} "
            f"of the size{crosses}{own}."
        )


def combine(
    obj: bpy.types.Object | None,
    chosen: Sequence[str],
    find_order: bool = True,
    options: FitOptions | None = None,
) -> Iterator[float | Made]:
    """Make the correction keys for some keys of an object, in steps that can be stopped.

    The keys themselves, their in-betweens, and a key that the user has sculpted for their combination stay as they are.
    If there is such a key, the corrections lead to it.

    Parameters
    ----------
    obj
    chosen
        Names of two or three keys with the same base.
    find_order
        Whether to find the outer key; otherwise the keys are named from the outermost to the innermost.
    options
        Options of the fit that keeps shapes from crossing themselves.

    Yields
    ------
    The part that is done, and at last what was made. Nothing is written before that.

    Raises
    ------
    InputError
        If the keys cannot be combined, or one that would be written is locked.
    """
    # Imported where it is used: scipy would make Blender start slower.
    from ...solver.combinations.base import KeysOnBase
    from ...solver.combinations.combine import together
    from ...solver.combinations.composer import Composer
    from ...solver.combinations.order import outermost_first
    from ...solver.settings import FitOptions
    from ...solver.support.progress import finish

    obj = checks.require_object(obj)
    keys = keys_of(obj)
    _require(obj, chosen)
    known = combined_keys.read(keys)
    made = {name for one in known for name, _ in one.made}
    earlier = next((one for one in known if set(one.keys) == set(chosen)), None)
    own = {name for name, _ in earlier.made} if earlier is not None else set()
    _require_unlocked(keys, own)
    grid = list(product(PLACES, repeat=len(chosen)))
    with probed(obj, chosen, made) as shown:
        asked = {
            (number, place): shown([place * (number == other) for other in range(len(chosen))])
            for number in range(len(chosen))
            for place in PLACES
        }
        ends = shown([0.0] * len(chosen)), shown([1.0] * len(chosen))
    with probed(obj, chosen, own) as shown:
        present = {places: shown(places) for places in grid}
    mesh = MirroredShapes(obj, [*ends, *asked.values()])
    base, sculpted, *others = mesh.shapes
    alone = dict(zip(asked, others, strict=True))
    together_keys = KeysOnBase(base, [alone[number, 1.0] for number in range(len(chosen))], mesh.faces, mesh.edges)
    order = outermost_first(together_keys) if find_order else tuple(range(len(chosen)))
    composer = Composer(together_keys)
    size = together_keys.diagonal
    whole = [alone[number, 1.0] for number in order]
    total = base + sum(shape - base for shape in whole)
    is_sculpted = bool(np.linalg.norm(sculpted - total, axis=1).max() > _ROUNDING * size)
    yield 0.0
    wanted, crossings = {}, 0
    beside, turned = None, None
    if is_sculpted:
        beside, turned = sculpted - composer.composed(whole), composer.turns(whole)
    for number, places in enumerate(grid):
        on = [alone[key, places[key]] for key in order]
        if beside is None or turned is None:
            wanted[places], crossed = finish(together(together_keys, on, options or FitOptions(), composer))
            crossings = max(crossings, crossed or 0)
        elif min(places) == 1.0:
            wanted[places] = sculpted
        else:
            # What the user sculpted beside the computed shape, as far as the keys are on, turned with what it is on.
            turn = composer.turns(on) @ turned.transpose(0, 2, 1)
            wanted[places] = composer.composed(on) + np.prod(places) * np.einsum("nij,nj->ni", turn, beside)
        yield (number + 1) / len(grid)
    named = tuple(chosen[number] for number in order)
    corrections = {
        tuple(places[number] for number in order): mesh.own(wanted[places]) - present[places]
        for places in grid
        if not (is_sculpted and min(places) == 1.0)
    }
    corrections = dict(sorted(corrections.items()))
    off = float(np.linalg.norm(wanted[grid[-1]] - total, axis=1).max()) / size
    combined = _write(obj, named, corrections, earlier, known)
    yield Made(combined, is_sculpted, crossings, off)


def finished(steps: Iterator[float | Made]) -> Made:
    """Run ``combine`` to its end."""
    *_, made = steps
    assert isinstance(made, Made)
    return made


def remove(obj: bpy.types.Object, combined: Combined) -> list[str]:
    """Remove the correction keys of a combination; sentences about those that stay because drivers read them."""
    keys = keys_of(obj)
    _require_unlocked(keys, [name for name, _ in combined.made])
    left = [one for one in combined_keys.read(keys) if one.keys != combined.keys]
    notes = shape_keys.remove_keys(obj, [keys.key_blocks[name] for name, _ in combined.made])
    with ExitStack() as undo:
        combined_keys.write(keys, left, undo)
        undo.pop_all()
    return notes


def _require(obj: bpy.types.Object, chosen: Sequence[str]) -> None:
    keys = keys_of(obj)
    if not 2 <= len(set(chosen)) == len(chosen) <= _MOST_KEYS:
        raise InputError(f"Combinations are of two or three different keys, and {len(chosen)} were named.")
    for name in chosen:
        if name not in keys.key_blocks:
            raise InputError(f"There is no shape key '{name}' on '{obj.name}'; choose from those of the mesh.")
    blocks = [keys.key_blocks[name] for name in chosen]
    if keys.reference_key in blocks:
        raise InputError(f"'{keys.reference_key.name}' is what the keys are relative to; choose others.")
    bases = {key.relative_key.name for key in blocks}
    if len(bases) > 1:
        raise InputError(f"The keys are relative to different ones, {' and '.join(sorted(bases))}; choose others.")
    if combined_keys.names_made(keys) & set(chosen):
        raise InputError("One of the keys corrects others itself; choose those that it corrects.")


def _require_unlocked(keys: bpy.types.Key, names_: Sequence[str] | set[str]) -> None:
    for name in names_:
        if keys.key_blocks[name].lock_shape:
            raise InputError(f"Shape key '{name}' of an earlier combination is locked; unlock it first.")


def _write(
    obj: bpy.types.Object,
    named: tuple[str, ...],
    corrections: dict[tuple[float, ...], Floats],
    earlier: Combined | None,
    known: list[Combined],
) -> Combined:
    """Write the correction keys, all of them or, if anything fails, none. Existing ones keep their names."""
    keys = keys_of(obj)
    relative = keys.key_blocks[named[0]].relative_key
    start = key_coordinates(obj, relative.name)
    # The earlier time's values in the order of this one.
    there = {}
    if earlier is not None:
        own = [earlier.keys.index(name) for name in named]
        there = {tuple(places[number] for number in own): name_of for name_of, places in earlier.made}
    active = obj.active_shape_key_index
    with ExitStack() as undo:
        made = []
        for places, correction in corrections.items():
            if places in there:
                key = keys.key_blocks[there.pop(places)]
                undo.callback(set_key_coordinates, key, key_coordinates(obj, key.name))
            else:
                key = shape_keys.new_key(obj, names.combination_name(named, places), relative, undo)
            set_key_coordinates(key, (start + correction).astype(np.float32))
            _drive(keys, key, named, places)
            made.append((key.name, places))
        combined = Combined(named, tuple(made))
        others = [one for one in known if one is not earlier]
        combined_keys.write(keys, [*others, combined], undo)
        undo.pop_all()
    shape_keys.remove_keys(obj, [keys.key_blocks[name] for name in there.values()])
    obj.active_shape_key_index = active
    keys.update_tag()
    return combined


def _drive(keys: bpy.types.Key, key: bpy.types.ShapeKey, named: Sequence[str], places: Sequence[float]) -> None:
    """Drive a correction key by the values of the combined keys; it is 0 if one of these is muted.

    The expression is simple enough for Blender to evaluate it without the permission that scripts need.
    """
    path = value_path(key.name)
    curve = None if keys.animation_data is None else keys.animation_data.drivers.find(path)
    curve = compat.new_driver(keys, path) if curve is None else curve
    driver = present(curve.driver)
    driver.type = 'SCRIPTED'
    while driver.variables:
        driver.variables.remove(driver.variables[0])
    factors = []
    for number, (name, place) in enumerate(zip(named, places, strict=True)):
        for letter, path_of in (("v", value_path), ("m", mute_path)):
            variable = driver.variables.new()
            variable.name = f"{letter}{number}"
            target = variable.targets[0]
            target.id_type, target.id, target.data_path = 'KEY', keys, path_of(name)
        factors += [_cardinal(f"v{number}", place), f"(1-m{number})"]
    driver.expression = "*".join(factors)
    driver.is_valid = True


def _cardinal(variable: str, place: float) -> str:
    """The Lagrange polynomial that is 1 at one place and 0 at the others and at 0, as an expression."""
    others = [other for other in (0.0, *PLACES) if other != place]
    scale = 1.0 / float(np.prod([place - other for other in others]))
    parts = [variable if other == 0.0 else f"({variable}-{other:g})" for other in others]
    return "*".join([f"{scale:.9g}", *parts])
