# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""All differences between the Blender versions that QC3D supports (4.2 LTS to 5.2 LTS)."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, TypeVar

import bpy

from .kinds import expect, keys_of, present

if TYPE_CHECKING:
    Animated = bpy.types.Object | bpy.types.Key
    Curves = bpy.types.ActionChannelbagFCurves

Handler = TypeVar("Handler", bound=Callable[..., object])


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt: in background mode Blender handles it itself, and a second one kills it."""
    before = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        # None if the handler was Blender's own, which Python cannot restore; then the next Ctrl-C ends Blender.
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


def register_command(name: str, handler: Callable[[list[str]], int]) -> list[object]:
    """Register ``blender --command NAME``; returns the handles to unregister it, none if Blender has no commands."""
    register = getattr(bpy.utils, "register_cli_command", None)
    return [] if register is None else [register(name, handler)]


def unregister_command(handle: object) -> None:
    """Unregister a command by its handle from ``register_command``."""
    bpy.utils.unregister_cli_command(handle)


def persistent(handler: Handler) -> Handler:
    """Keep a handler when another file is loaded."""
    keep: Callable[[Handler], Handler] = bpy.app.handlers.persistent
    return keep(handler)


def remove_handler(handlers: list[Handler], handler: Handler) -> None:
    """Remove a handler if it is still there: some scripts and add-ons remove those of others too."""
    if handler in handlers:
        handlers.remove(handler)


def new_driver(owner: bpy.types.ID, data_path: str) -> bpy.types.FCurve:
    """Add a driver whose value reaches the property unchanged.

    A new driver comes with a generator modifier (up to 4.5) or with two Bézier keyframes from (0, 0) to (1, 1) (5.x);
    that curve turns 0.5 into 0.49999994. Without either, the value is passed on exactly.
    """
    curve = expect(bpy.types.FCurve, owner.driver_add(data_path))
    while curve.modifiers:
        curve.modifiers.remove(curve.modifiers[0])
    while curve.keyframe_points:
        curve.keyframe_points.remove(curve.keyframe_points[0])
    return curve


def clear_shape_keys(obj: bpy.types.Object) -> None:
    """Remove all shape keys of an object's mesh.

    Up to 4.5, Blender leaves their data block behind without a mesh, and reading a point of it crashes.
    """
    number = keys_of(obj).session_uid
    obj.shape_key_clear()
    bpy.data.batch_remove([keys for keys in bpy.data.shape_keys if keys.session_uid == number])


def find_fcurve(owner: Animated, data_path: str) -> bpy.types.FCurve | None:
    """The F-curve that animates a property of ``owner`` in its active action, if there is one."""
    curves = _fcurves(owner)
    return None if curves is None else curves.find(data_path)


def is_animated(owner: Animated, data_path: str) -> bool:
    """Whether a property of ``owner`` has keyframes that play, in its active action or in an unmuted NLA strip."""
    if owner.animation_data is None:
        return False
    curve = find_fcurve(owner, data_path)
    if curve is not None and plays(curve):
        return True
    for track in owner.animation_data.nla_tracks:
        for strip in track.strips if not track.mute else ():
            curves = _strip_fcurves(strip)
            curve = None if strip.mute or curves is None else curves.find(data_path)
            if curve is not None and plays(curve):
                return True
    return False


def plays(curve: bpy.types.FCurve) -> bool:
    """Whether an F-curve has keyframes and is not muted."""
    return len(curve.keyframe_points) > 0 and not curve.mute


def _strip_fcurves(strip: bpy.types.NlaStrip) -> Curves | None:
    """The F-curves that an NLA strip plays."""
    return None if strip.action is None else _curves_of(strip.action, strip)


def remove_fcurve(owner: Animated, data_path: str) -> None:
    """Remove the F-curve of a property, and the action too if it becomes empty and has no other user."""
    animation = _animation(owner)
    action = present(animation.action)
    curves = _without(owner, data_path)
    if not len(curves) and action.users == 1 and not action.use_fake_user:
        animation.action = None
        bpy.data.actions.remove(action)


def _animation(owner: Animated) -> bpy.types.AnimData:
    return present(owner.animation_data)


def _without(owner: Animated, data_path: str) -> Curves:
    """Remove the F-curve of a property; returns the remaining ones."""
    curves, curve = _fcurves(owner), find_fcurve(owner, data_path)
    assert curves is not None
    assert curve is not None
    curves.remove(curve)
    return curves


def _fcurves(owner: Animated) -> Curves | None:
    """The F-curves of ``owner`` in its active action."""
    animation = owner.animation_data
    return None if animation is None or animation.action is None else _curves_of(animation.action, animation)


def _curves_of(action: bpy.types.Action, player: bpy.types.AnimData | bpy.types.NlaStrip) -> Curves | None:
    """The F-curves of an action in the slot that ``player`` plays."""
    if not hasattr(player, "action_slot"):  # before 4.4 an action holds its curves itself
        return _curves_of_old(action)
    if player.action_slot is None:
        return None
    from bpy_extras import anim_utils

    # The stubs say that it returns nothing.
    channels_of: Callable[..., bpy.types.ActionChannelbag | None] = anim_utils.action_get_channelbag_for_slot
    channels = channels_of(action, player.action_slot)
    return None if channels is None else channels.fcurves


def _curves_of_old(action: bpy.types.Action) -> Curves:
    """The F-curves of an action before Blender 4.4, which had no slots."""
    curves: Curves = getattr(action, "fcurves")  # noqa: B009 - 5.x does not know it
    return curves


def ensure_fcurve(owner: Animated, data_path: str, undo: ExitStack) -> bpy.types.FCurve:
    """The F-curve of a property; creates it, the action and the slot if needed.

    Closing ``undo`` removes what was created.
    """
    curve = find_fcurve(owner, data_path)
    if curve is not None:
        return curve
    if owner.animation_data is None:
        owner.animation_data_create()
        undo.callback(owner.animation_data_clear)
    animation = _animation(owner)
    if animation.action is None:
        action = bpy.data.actions.new(f"{owner.name}Action")
        animation.action = action
        undo.callback(bpy.data.actions.remove, action)
    if hasattr(animation, "action_slot"):
        undo.callback(_take_back_slots, owner, animation.action_slot, set(animation.action.slots))
        curve = animation.action.fcurve_ensure_for_datablock(owner, data_path)
    else:
        curve = _curves_of_old(animation.action).new(data_path)
    undo.callback(_without, owner, data_path)
    return curve


def _take_back_slots(
    owner: Animated, chosen: bpy.types.ActionSlot | None, before: set[bpy.types.ActionSlot]
) -> None:
    animation = _animation(owner)
    slots = present(animation.action).slots
    for slot in [slot for slot in slots if slot not in before]:
        slots.remove(slot)
    animation.action_slot = chosen
