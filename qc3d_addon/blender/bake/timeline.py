# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds keys that the user keyframed one after another, with their frames."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import bpy
import numpy as np

from ...solver.errors import InputError
from .. import compat
from ..keys.control import value_path
from ..kinds import keys_of
from .suggested_keys import made_keys

_FULLY = 0.01  # tolerance for values that are meant to be 0 or 1


@dataclass(frozen=True)
class Row:
    """Keys that follow one another on the timeline.

    Parameters
    ----------
    keys
        Names, from the first to the last.
    frames
        The frame that shows each of them, increasing.
    notes
        Sentences for the user about keyframes that are left out.
    """

    keys: tuple[str, ...]
    frames: tuple[int, ...]
    notes: tuple[str, ...] = ()


def keyed(obj: bpy.types.Object) -> list[str]:
    """Names of the user's own keys whose values have keyframes in the active action. Fast enough for a panel."""
    keys = keys_of(obj)
    if keys.animation_data is None or keys.animation_data.action is None:
        return []
    made = made_keys(keys)
    found = []
    for key in keys.key_blocks:
        if key.name not in made and key != keys.reference_key:
            curve = compat.find_fcurve(keys, value_path(key.name))
            found += [key.name] if curve is not None and len(curve.keyframe_points) else []
    return found


def keys_on_timeline(obj: bpy.types.Object, now: int) -> Row:
    """The keys that the keyframes of their values show one after another, each alone at its keyframe.

    If none of the keys is on, the Basis is shown. If a key is held from one keyframe to the next, the row ends there
    and another one begins.

    Parameters
    ----------
    now
        The frame whose row is wanted, if there are several; otherwise the first.

    Raises
    ------
    InputError
        If no two keys follow one another.
    """
    shown, mixed = _shown(obj)
    rows: list[list[tuple[int, str]]] = [[]]
    for moment, following in pairwise([*shown, None]):
        assert moment is not None
        rows[-1].append(moment)
        if following is not None and following[1] == moment[1]:
            rows.append([])
    rows = [row for row in rows if len(row) > 1]
    if not rows:
        raise InputError(
            f"No two shape keys of '{obj.name}' follow one another on the timeline; keyframe their values so that at "
            "each keyframe one key is at 1 and the others are at 0."
        )
    row = next((row for row in rows if row[0][0] <= now <= row[-1][0]), rows[0])
    frames, names = zip(*row, strict=True)
    notes = []
    inside = [frame for frame in mixed if frames[0] < frame < frames[-1]]
    if inside:
        notes.append(f"Keyframes with several keys on, or one partly, are left out: {', '.join(map(str, inside))}.")
    if len(rows) > 1:
        notes.append(
            f"These are the keys from frame {frames[0]} to {frames[-1]}; one is held there. Go to another frame for "
            "those before or after."
        )
    return Row(names, frames, tuple(notes))


def _shown(obj: bpy.types.Object) -> tuple[list[tuple[int, str]], list[int]]:
    """Frames, each with the key that is on alone, or the Basis; and the other frames that have keyframes."""
    keys = keys_of(obj)
    names = [keys.reference_key.name, *keyed(obj)]
    curves = [curve for name in names[1:] if (curve := compat.find_fcurve(keys, value_path(name))) is not None]
    frames = sorted({round(point.co.x) for curve in curves for point in curve.keyframe_points})
    shown, mixed = [], []
    for frame in frames:
        values = np.array([curve.evaluate(frame) for curve in curves])
        on = np.flatnonzero(np.abs(values) > _FULLY)
        if len(on) > 1 or not np.allclose(values[on], 1.0, rtol=0.0, atol=_FULLY):
            mixed.append(frame)
        else:
            shown.append((frame, names[1 + int(on[0])] if len(on) else names[0]))
    return shown, mixed
