# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Live scrub: while it is on, the slider shows every moment of the motion and not only the baked ones.

A shape key, the only one that the object shows then, follows the slider. It is no part of the file: it goes away before
the file is saved and comes back after, and whatever else ends the preview, undo included, gives the object back the
active key and the display that it had.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
from bpy.app.handlers import persistent

from . import shape_keys
from .mesh_data import set_key_coordinates

if TYPE_CHECKING:
    from ..solver.preview import PreviewCurve
    from .records import Chain

KEY = "QC3D Preview"
_STATE = "qc3d_preview"  # property of the shape keys: what to give back


@dataclass
class _Scrub:
    """The preview that is on."""

    object_id: int
    slider: str
    curve: PreviewCurve
    owner_id: int
    place: float | None = None  # where the slider was when the key was last set


_scrub: _Scrub | None = None
_suspended: _Scrub | None = None


def is_on(obj: bpy.types.Object | None, slider: str = "") -> bool:
    """Whether the preview is on for an object, and for that slider where one is named."""
    on_object = _scrub is not None and obj is not None and _scrub.object_id == obj.session_uid
    return on_object and (not slider or _scrub.slider == slider)  # type: ignore[union-attr]


def begin(obj: bpy.types.Object, chain: Chain, curve: PreviewCurve) -> None:
    """Show the curve where the slider is, and follow the slider from now on."""
    end()
    owner = shape_keys.slider_owner(obj, chain)
    _show(obj, _Scrub(obj.session_uid, chain.slider, curve, owner.session_uid))


def end() -> None:
    """Take the preview away; nothing happens where there is none."""
    global _scrub, _suspended
    _scrub = _suspended = None
    clean()


def clean() -> None:
    """Give every object that still has a preview what it had before, also one from an undone or crashed session."""
    for keys in bpy.data.shape_keys:
        if _STATE in keys:
            for obj in bpy.data.objects:
                if obj.type == 'MESH' and obj.data.shape_keys == keys:
                    _give_back(obj)
            keys.pop(_STATE, None)


def _show(obj: bpy.types.Object, scrub: _Scrub) -> None:
    global _scrub
    keys = obj.data.shape_keys
    active = obj.active_shape_key
    state = {"active": None if active is None else active.name, "only": obj.show_only_shape_key, "object": obj.name}
    key = obj.shape_key_add(name=KEY, from_mix=False)
    key.value = 0.0
    key.relative_key = keys.reference_key
    state["key"] = key.name
    keys[_STATE] = json.dumps(state)
    obj.active_shape_key_index = keys.key_blocks.find(key.name)
    obj.show_only_shape_key = True
    _scrub = scrub
    _follow()


def _give_back(obj: bpy.types.Object) -> None:
    keys = obj.data.shape_keys
    try:
        state = json.loads(keys[_STATE])
        key = keys.key_blocks.get(state["key"])
        if state["object"] == obj.name:
            obj.show_only_shape_key = bool(state["only"])
    except (TypeError, ValueError, KeyError):
        return
    wanted = obj.active_shape_key.name if obj.active_shape_key not in (None, key) else state["active"]
    if key is not None:
        obj.shape_key_remove(key)
    obj.active_shape_key_index = max(keys.key_blocks.find(wanted or ""), 0)


def _follow() -> None:
    """Set the key to where the slider is, or end where the object is gone, edited or has lost the key."""
    scrub = _scrub
    if scrub is None:
        return
    obj = _find(scrub.object_id)
    if obj is None or obj.type != 'MESH' or obj.data.shape_keys is None or _STATE not in obj.data.shape_keys:
        end()
        return
    if obj.mode != 'OBJECT':
        return  # nothing may be removed now; the next update after it ends the preview
    keys = obj.data.shape_keys
    key = keys.key_blocks.get(json.loads(keys[_STATE])["key"])
    owner = _find(scrub.owner_id)
    is_whole = key is not None and owner is not None and scrub.slider in owner
    if not is_whole or obj.active_shape_key != key or len(key.points) != scrub.curve.vertices:
        end()
        return
    place = float(owner[scrub.slider])
    if place != scrub.place:
        scrub.place = place
        set_key_coordinates(key, scrub.curve.at(place))
        keys.update_tag()


def _find(object_id: int) -> bpy.types.Object | None:
    return next((obj for obj in bpy.data.objects if obj.session_uid == object_id), None)


@persistent
def _on_update(*_: object) -> None:
    if _scrub is not None:
        _follow()


@persistent
def _on_undo(*_: object) -> None:
    """What was undone may have been made while a preview was on that is off now, or the other way round."""
    obj = None if _scrub is None else _find(_scrub.object_id)
    keys = None if obj is None or obj.type != 'MESH' else obj.data.shape_keys
    if keys is None or _STATE not in keys:
        end()
    else:
        _scrub.place = None  # type: ignore[union-attr]
        _follow()


@persistent
def _before_save(*_: object) -> None:
    global _suspended
    suspended = _scrub
    end()
    _suspended = suspended


@persistent
def _after_save(*_: object) -> None:
    global _suspended
    suspended, _suspended = _suspended, None
    obj = None if suspended is None else _find(suspended.object_id)
    if obj is not None and obj.mode == 'OBJECT':
        suspended.place = None  # type: ignore[union-attr]
        _show(obj, suspended)  # type: ignore[arg-type]


@persistent
def _before_load(*_: object) -> None:
    global _scrub, _suspended
    _scrub = _suspended = None


@persistent
def _after_load(*_: object) -> None:
    clean()


_HANDLERS = {
    "depsgraph_update_post": _on_update,
    "frame_change_post": _on_update,
    "undo_post": _on_undo,
    "redo_post": _on_undo,
    "save_pre": _before_save,
    "save_post": _after_save,
    "save_post_fail": _after_save,
    "load_pre": _before_load,
    "load_post": _after_load,
}


def register() -> None:
    """Follow what happens in the file."""
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Take the preview away and follow nothing."""
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
    end()
