# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Combines several keys, each at its weight, into one shape, and resolves its self-crossings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from numbers import Real

import numpy as np

from ..arrays import Floats, Ints
from ..errors import InputError, MeshingError
from ..fit.fit_pair import fit_pair
from ..fit.fitted_map import FittedMap
from ..frames.chain import chain_frames
from ..keys.keypair import KeyPair
from ..settings import FitOptions, FrameOptions
from ..support.memory import estimated_mb, machine_limit_mb, require_memory
from ..support.progress import Progress, Steps, numbered, told
from .base import KeysOnBase
from .composer import Composer
from .joint_crossings import JointCrossings
from .order import outermost_first

_UNCROSSING_ATTEMPTS = 3
# Factors on the anchor weights at crossings: for the carried shape, so large that the smallest triangles give way; for
# the map of the volume, which is coarser than they are, less.
_STRONGEST_CARRIED, _STRONGEST_MAP = 1e12, 1e8


@dataclass(frozen=True, eq=False)
class Combination:
    """The combination of several keys.

    Parameters
    ----------
    shape : (n, 3)
        The combined shape, in the keys' own coordinates.
    order : tuple of int
        Indices of the keys, outermost first.
    crossings : int or None
        Number of pairs of triangles that cross in the shape, but neither in the base nor in a key; None if so many
        triangles overlap that the search was given up.
    notes : tuple of str
        Sentences for the user.
    """

    shape: Floats
    order: tuple[int, ...]
    crossings: int | None
    notes: tuple[str, ...] = ()


def combine(
    keys: KeysOnBase,
    weights: Sequence[float] | None = None,
    order: Sequence[int] | None = None,
    options: FitOptions | None = None,
    shown: Mapping[int, Floats] | None = None,
) -> Steps[Combination]:
    """Combine several keys, each at its weight.

    Parameters
    ----------
    keys : KeysOnBase
    weights : sequence of float, optional
        Weight of each key, 0..1; all 1 by default. A key with a weight between shows its natural in-between, for which
        a map is fitted, unless ``shown`` tells what it shows.
    order : sequence of int, optional
        Indices of the keys, outermost first; by default found from what they turn and bend.
    options : FitOptions, optional
        Options of the fits.
    shown : mapping of int to (n, 3), optional
        What some of the keys show at their weights, by their indices.

    Raises
    ------
    InputError
        If the number of weights is wrong, a weight is outside 0..1, the order is not a permutation of the keys, or
        memory would not be enough.
    MeshingError
        If the volume of a key with a weight between 0 and 1 cannot be filled.
    """
    chosen = FitOptions() if options is None else options
    values = checked_weights(weights, len(keys.pairs))
    through = outermost_first(keys) if order is None else _checked_order(order, len(keys.pairs))
    known = {} if shown is None else shown
    partly = [number for number, value in enumerate(values) if 0.0 < value < 1.0 and number not in known]
    if limit := machine_limit_mb():
        needed = estimated_mb(len(keys.base), len(partly) + 1, 1, chosen.quality, True, len(keys.faces))
        require_memory(needed, limit, len(keys.base))
    alone = {number: keys.pairs[number].key1 for number, value in enumerate(values) if value == 1.0} | dict(known)
    fits: dict[int, FittedMap] = {}
    for done, number in enumerate(partly):
        fits[number] = yield from numbered(fit_pair(keys.pairs[number], chosen), done, len(partly))
    notes = [note for fitted in fits.values() for note in fitted.notes]
    for done, number in enumerate(partly):
        made = chain_frames([keys.pairs[number]], [fits[number]], [values[number]], FrameOptions())
        alone[number] = (yield from told(made, partial(_sharing, len(partly), done))).frames[0]
    on = [alone[number] for number in through if number in alone]
    if len(on) < 2:
        return Combination((on[0] if on else keys.base).copy(), through, 0, tuple(notes))
    shape, crossings = yield from told(together(keys, on, chosen), partial(_sharing, len(partly), len(partly)))
    yield Progress("frames", 1.0)
    if crossings:
        notes.append(f"{crossings} pairs of triangles cross that do so in none of the keys.")
    return Combination(shape, through, crossings, tuple(notes))


def together(
    keys: KeysOnBase, on: Sequence[Floats], options: FitOptions, composer: Composer | None = None
) -> Steps[tuple[Floats, int | None]]:
    """The combined shape (n, 3) of the shapes ``on``, and its number of crossings beyond theirs.

    Where it crosses itself, it is drawn to what the outer shapes carry along. If that does not help, it is drawn to the
    image of the base under the closest fold-free map of the volume: this crosses itself only where the base does.
    """
    composer = composer or Composer(keys)
    best = composer.composed(on)
    base, *others = (keys.scaled(each) for each in (keys.base, *on))
    limit = JointCrossings(keys.faces, base, others, keys.still[keys.vertices])
    left = limit.fresh(keys.scaled(best))
    for strength in (_STRONGEST_CARRIED, _STRONGEST_MAP):
        if left is None or not len(left):
            break
        carried = strength == _STRONGEST_CARRIED
        anchor = composer.carried(on) if carried else (yield from _unfolded(keys, best, options))
        if anchor is None:
            break
        places = np.zeros(len(base), dtype=bool)
        crossing: Ints | None = left
        for _ in range(_UNCROSSING_ATTEMPTS):
            if crossing is None or not len(crossing):
                break
            places[keys.faces[crossing].ravel()] = True
            tried = composer.composed(on, anchor, places, strength)
            crossing = limit.fresh(keys.scaled(tried))
            if crossing is not None and len(crossing) < len(left):
                best, left = tried, crossing
    return best, None if left is None else len(left)


def _unfolded(keys: KeysOnBase, shape: Floats, options: FitOptions) -> Steps[Floats | None]:
    """(n, 3) the base carried close to a shape (n, 3) by a map without folds; None if none could be fitted."""
    first = keys.pairs[0]
    try:
        fitted = yield from fit_pair(KeyPair(keys.base, shape, first.faces, first.edges, first.polygons), options)
    except (InputError, MeshingError):
        return None
    return fitted.embedding.from_cube(fitted.landmarks @ fitted.mapped, 1.0)


def _sharing(fits: int, number: int, step: Progress) -> Progress:
    """A step of piece ``number`` of the work after ``fits`` fits, as progress of the stage of the frames."""
    return Progress("frames", (number + step.overall) / (fits + 1), fits, fits)


def checked_weights(weights: Sequence[float] | None, count: int) -> list[float]:
    """The weights of so many keys, 1 if none are given; raises InputError if the number or one of them is wrong."""
    values = [1.0] * count if weights is None else list(weights)
    if len(values) != count:
        raise InputError(f"There are {count} keys and {len(values)} weights; give one for each.")
    for value in values:
        if not isinstance(value, Real) or isinstance(value, bool) or not 0.0 <= value <= 1.0:
            raise InputError(f"The weight {value!r} is not possible; choose numbers from 0 (off) to 1 (fully on).")
    return [float(value) for value in values]


def _checked_order(order: Sequence[int], count: int) -> tuple[int, ...]:
    if sorted(order) != list(range(count)):
        raise InputError(f"The order {list(order)} is none of the {count} keys; name each of their numbers once.")
    return tuple(order)
