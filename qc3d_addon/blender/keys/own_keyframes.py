# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The user's own keyframes on keys that a slider goes through: muted, not removed, since they would add to the slider.

A muted F-curve keeps its keyframes, and can be turned on again in Blender's editors.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack

import bpy

from .. import compat
from ..store.chain import Chain
from .control import value_path


def is_controlled(keys: bpy.types.Key, name: str) -> bool:
    """Whether the value of a key has a driver, or keyframes in the active action, muted or not."""
    animation = keys.animation_data
    if animation is not None and animation.drivers.find(value_path(name)) is not None:
        return True
    curve = compat.find_fcurve(keys, value_path(name))
    return curve is not None and len(curve.keyframe_points) > 0


def own_keys(keys: bpy.types.Key, chain: Chain) -> Iterator[bpy.types.ShapeKey]:
    """The user's keys whose own values add to a chain: those it goes through, except the Basis and what plays it.

    The base of a key that plays a chain is shown as that key's own 0, so its value adds nothing.
    """
    through = chain.through[1:-1] if chain.on_key else chain.through
    for name in dict.fromkeys(through):
        key = keys.key_blocks.get(name)
        if key is not None and key != keys.reference_key and name != chain.on_key:
            yield key


def playing(keys: bpy.types.Key, chain: Chain) -> list[str]:
    """Names of the keys of a slider's chain whose own keyframes play and can be muted. Fast enough for a panel."""
    if chain.on_key or not _is_alone(keys):
        return []
    curves = {key.name: compat.find_fcurve(keys, value_path(key.name)) for key in own_keys(keys, chain)}
    return [name for name, curve in curves.items() if curve is not None and compat.plays(curve)]


def mute(keys: bpy.types.Key, chain: Chain, undo: ExitStack) -> list[str]:
    """Mute those keyframes and set the keys to 0; the chain remembers which. Closing ``undo`` undoes it.

    Returns
    -------
    list of str
        A sentence about what was muted, if anything was.
    """
    names = playing(keys, chain)
    for name in names:
        curve, key = compat.find_fcurve(keys, value_path(name)), keys.key_blocks[name]
        assert curve is not None
        undo.callback(setattr, key, "value", key.value)
        undo.callback(setattr, curve, "mute", False)
        curve.mute = True
        key.value = 0.0
    undo.callback(setattr, chain, "muted", chain.muted)
    chain.muted = (*chain.muted, *(name for name in names if name not in chain.muted))
    if not names:
        return []
    keys.update_tag()
    return [
        f"The keyframes of {_listed(names)} are muted, since they would add to what the slider shows; Remove turns "
        "them on again."
    ]


def unmute(keys: bpy.types.Key, chain: Chain) -> list[str]:
    """Let the keyframes that bakes of a chain muted play again; sentences about those that cannot."""
    left = []
    for name in chain.muted:
        curve = compat.find_fcurve(keys, value_path(name))
        if curve is None or not curve.mute:
            continue
        if _is_alone(keys):
            curve.mute = False
        else:
            left.append(name)
    chain.muted = ()
    keys.update_tag()
    return [f"The keyframes of {_listed(left)} stay muted, since other data uses their action too."] if left else []


def _is_alone(keys: bpy.types.Key) -> bool:
    """Whether the active action can be changed without changing how anything else moves."""
    action = keys.animation_data and keys.animation_data.action
    if not action or action.library or action.override_library:
        return False
    return action.users - int(action.use_fake_user) == 1


def _listed(names: list[str]) -> str:
    """Quoted names, as in a sentence."""
    quoted = [f"'{name}'" for name in names]
    return " and ".join([", ".join(quoted[:-1]), quoted[-1]] if len(quoted) > 1 else quoted)
