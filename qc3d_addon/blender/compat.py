# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Every difference between the Blender versions that QC3D supports (4.2 LTS to 5.2 LTS)."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import bpy


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt: without its window Blender keeps it for itself, and a second one kills it."""
    before = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        # None where the handler is Blender's own, which Python cannot put back; then the next Ctrl-C ends Blender.
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


def register_command(name: str, handler: Callable[[list[str]], int]) -> list[object]:
    """Register ``blender --command NAME``; the handles to take it back, none where Blender has no commands."""
    register = getattr(bpy.utils, "register_cli_command", None)
    return [] if register is None else [register(name, handler)]


def unregister_command(handle: object) -> None:
    """Take back what ``register_command`` returned."""
    bpy.utils.unregister_cli_command(handle)


def remove_handler(handlers: list[Callable[..., object]], handler: Callable[..., object]) -> None:
    """Take a handler back, where it is still there: some scripts and add-ons remove those of others with their own."""
    if handler in handlers:
        handlers.remove(handler)


def new_driver(owner: bpy.types.ID, data_path: str) -> bpy.types.FCurve:
    """Add a driver whose value reaches the property unchanged.

    A new driver comes with a generator modifier (up to 4.5) or with two Bézier keyframes from (0, 0) to (1, 1) (5.x);
    the Bézier curve turns 0.5 into 0.49999994. Without either the value passes through as it is.
    """
    curve = owner.driver_add(data_path)
    while curve.modifiers:
        curve.modifiers.remove(curve.modifiers[0])
    while curve.keyframe_points:
        curve.keyframe_points.remove(curve.keyframe_points[0])
    return curve


def clear_shape_keys(obj: bpy.types.Object) -> None:
    """Remove all shape keys of an object's mesh.

    Up to 4.5 Blender leaves their data block behind, without a mesh: who then reads a point of it crashes.
    """
    number = obj.data.shape_keys.session_uid
    obj.shape_key_clear()
    bpy.data.batch_remove([keys for keys in bpy.data.shape_keys if keys.session_uid == number])


def find_fcurve(owner: bpy.types.ID, data_path: str) -> bpy.types.FCurve | None:
    """The F-curve that animates a property of ``owner`` in its active action, if there is one."""
    curves = _fcurves(owner)
    return None if curves is None else curves.find(data_path)


def is_animated(owner: bpy.types.ID, data_path: str) -> bool:
    """Whether a property of ``owner`` has keyframes: in its active action, or in a strip of the NLA that is on."""
    if owner.animation_data is None:
        return False
    curve = find_fcurve(owner, data_path)
    if curve is not None and len(curve.keyframe_points):
        return True
    for track in owner.animation_data.nla_tracks:
        for strip in track.strips if not track.mute else ():
            curves = _strip_fcurves(strip)
            if not strip.mute and curves is not None and curves.find(data_path) is not None:
                return True
    return False


def _strip_fcurves(strip: bpy.types.NlaStrip) -> bpy.types.bpy_prop_collection | None:
    """The F-curves that a strip of the NLA plays."""
    if strip.action is None:
        return None
    if not hasattr(strip, "action_slot"):  # before 4.4 an action holds its curves itself
        return strip.action.fcurves
    if strip.action_slot is None:
        return None
    from bpy_extras import anim_utils

    channels = anim_utils.action_get_channelbag_for_slot(strip.action, strip.action_slot)
    return None if channels is None else channels.fcurves


def remove_fcurve(owner: bpy.types.ID, data_path: str) -> None:
    """Remove the F-curve of a property, and the action with it where it holds nothing else and nobody else uses it."""
    curves = _fcurves(owner)
    assert curves is not None
    curves.remove(curves.find(data_path))
    action = owner.animation_data.action
    if not len(curves) and action.users == 1 and not action.use_fake_user:
        owner.animation_data.action = None
        bpy.data.actions.remove(action)


def _fcurves(owner: bpy.types.ID) -> bpy.types.bpy_prop_collection | None:
    """The F-curves of ``owner`` in its active action."""
    animation = owner.animation_data
    if animation is None or animation.action is None:
        return None
    if not hasattr(animation, "action_slot"):  # before 4.4 an action holds its curves itself
        return animation.action.fcurves
    if animation.action_slot is None:
        return None
    from bpy_extras import anim_utils

    channels = anim_utils.action_get_channelbag_for_slot(animation.action, animation.action_slot)
    return None if channels is None else channels.fcurves


def ensure_fcurve(owner: bpy.types.ID, data_path: str, undo: ExitStack) -> bpy.types.FCurve:
    """The F-curve of a property, with the action (and slot) made where there is none.

    Closing ``undo`` takes back what was made.
    """
    curve = find_fcurve(owner, data_path)
    if curve is not None:
        return curve
    if owner.animation_data is None:
        owner.animation_data_create()
        undo.callback(owner.animation_data_clear)
    animation = owner.animation_data
    if animation.action is None:
        animation.action = bpy.data.actions.new(f"{owner.name}Action")
        undo.callback(bpy.data.actions.remove, animation.action)
    if hasattr(animation, "action_slot"):
        undo.callback(_take_back_slots, owner, animation.action_slot, set(animation.action.slots))
        curve = animation.action.fcurve_ensure_for_datablock(owner, data_path)
    else:
        curve = animation.action.fcurves.new(data_path)
    undo.callback(lambda: _fcurves(owner).remove(find_fcurve(owner, data_path)))
    return curve


def _take_back_slots(
    owner: bpy.types.ID, chosen: bpy.types.ActionSlot | None, before: set[bpy.types.ActionSlot]
) -> None:
    animation = owner.animation_data
    for slot in [slot for slot in animation.action.slots if slot not in before]:
        animation.action.slots.remove(slot)
    animation.action_slot = chosen
