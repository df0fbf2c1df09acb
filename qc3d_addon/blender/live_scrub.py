# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Live scrub: while it is on, the slider shows every moment of the motion and not only the baked ones.

A shape key follows the slider. It adds to what the baked keys show, so it is on beside all other keys, and neither the
active key nor the display changes. It is no part of the file: it goes away before the file is saved and comes back
after. Its name is reserved: a key of that name is taken away wherever it turns up, by undo or in a recovered file.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bmesh
import bpy
from bpy.app.handlers import persistent

from ..solver.errors import InputError
from . import compat
from .keys import chain_keys, shape_keys
from .store.mesh_data import key_coordinates, set_key_coordinates
from .store.records import Chain, Record

if TYPE_CHECKING:
    from ..solver.frames.preview import PreviewCurve
    from ..solver.frames.weights import Weights
    from .bake.plan import Plan

KEY = "QC3D Preview"


@dataclass
class _Scrub:
    """The preview that is on."""

    plan: Plan  # finds the object, and knows the keys that the curve was made from
    chain: Chain
    weights: Weights
    curve: PreviewCurve
    place: float | None = None  # where the slider was when the key was last set
    was_edited: bool = False


_scrub: _Scrub | None = None
_suspended: _Scrub | None = None  # while the file is saved


def is_on(obj: bpy.types.Object | None, slider_name: str = "") -> bool:
    """Whether the preview is on for an object, and for that slider where one is named."""
    on_object = _scrub is not None and obj is not None and _scrub.plan.object_id == obj.session_uid
    return on_object and (not slider_name or _scrub.chain.slider == slider_name)  # type: ignore[union-attr]


def begin(plan: Plan, chain: Chain, curve: PreviewCurve) -> None:
    """Show the curve where the slider of a baked chain is, and follow the slider from now on.

    Raises
    ------
    InputError
        If the object of the plan is gone or was changed meanwhile, or the slider is not a number; it is as it was.
    """
    obj = plan.find_object()
    chain_keys.control_of(obj, chain).require()
    chain_keys.restart_drivers(obj.data.shape_keys, chain)
    end()
    _show(obj, _Scrub(plan, chain, chain.weights, curve))


def end() -> None:
    """Take the preview away, also one that undo or a recovered file brought back; else nothing happens."""
    global _scrub
    _scrub = None
    for keys in list(bpy.data.shape_keys):
        mesh = keys.user
        if isinstance(mesh, bpy.types.Mesh) and mesh.library is None and _has_key(mesh):
            _remove_key(mesh)


def _show_again(scrub: _Scrub) -> None:
    """Show it where the object is there, is not being edited, and has the keys that the curve was made from."""
    with contextlib.suppress(InputError):
        obj = scrub.plan.find_object()
        chain = Record.read(obj.data.shape_keys).chain_of_slider(scrub.chain.slider)
        if chain is not None:  # undo may have brought back another number of steps
            _show(obj, replace(scrub, chain=chain, weights=chain.weights))


def _show(obj: bpy.types.Object, scrub: _Scrub) -> None:
    global _scrub
    try:
        key = obj.shape_key_add(name=KEY, from_mix=False)
        key.relative_key = obj.data.shape_keys.reference_key
        key.value = 1.0
        scrub.place = None
        _scrub = scrub
        _follow(scrub)
    except BaseException:
        end()
        raise


def _follow(scrub: _Scrub) -> None:
    """Set the key to where the slider is, or end where the object is gone, was edited, or has lost key or slider."""
    obj = scrub.plan.locate()
    keys = None if obj is None or obj.type != 'MESH' else obj.data.shape_keys
    key = None if keys is None else keys.key_blocks.get(KEY)
    if key is None:
        end()
        return
    if obj.data.is_editmode:
        scrub.was_edited = True  # the mesh cannot lose a key while a tool may be at work on it
        return
    control = chain_keys.control_of(obj, scrub.chain)
    is_whole = len(obj.data.vertices) == len(key.points) == scrub.curve.vertices
    if scrub.was_edited or obj.mode != 'OBJECT' or not is_whole or control.problem is not None:
        end()
        return
    place = control.value
    if place != scrub.place and not key.mute:
        scrub.place = place
        basis = key_coordinates(obj, keys.reference_key.name)
        set_key_coordinates(key, basis + scrub.curve.beyond(place, scrub.weights))
        keys.update_tag()


def _has_key(mesh: bpy.types.Mesh) -> bool:
    in_layers = mesh.is_editmode and KEY in bmesh.from_edit_mesh(mesh).verts.layers.shape
    return in_layers or KEY in mesh.shape_keys.key_blocks


def _remove_key(mesh: bpy.types.Mesh) -> None:
    obj = next((obj for obj in bpy.data.objects if obj.data == mesh), None)
    is_unused = obj is None
    if is_unused:  # only an object can remove a key
        obj = bpy.data.objects.new(KEY, mesh)
    if mesh.is_editmode:  # leaving Edit Mode would make the key again from its layer
        layers = bmesh.from_edit_mesh(mesh).verts.layers.shape
        if KEY in layers:
            layers.remove(layers[KEY])
    if KEY in mesh.shape_keys.key_blocks:
        shape_keys.remove_key(obj, mesh.shape_keys.key_blocks[KEY])
    if is_unused:
        bpy.data.objects.remove(obj)


@persistent
def _on_update(*_: object) -> None:
    if _scrub is not None:
        _follow(_scrub)


@persistent
def _after_undo(*_: object) -> None:
    """What was undone may have been made with or without the preview: it stays on while the keys are the same."""
    scrub = _scrub
    end()
    if scrub is not None:
        _show_again(scrub)


@persistent
def _before_save(*_: object) -> None:
    global _suspended
    _suspended = _scrub
    end()


@persistent
def _after_save(*_: object) -> None:
    global _suspended
    scrub, _suspended = _suspended, None
    if scrub is not None:
        _show_again(scrub)


@persistent
def _before_render(*_: object) -> None:
    _mute(True)


@persistent
def _after_render(*_: object) -> None:
    _mute(False)


@persistent
def _after_load(*_: object) -> None:
    end()


def _mute(state: bool) -> None:
    obj = None if _scrub is None else _scrub.plan.locate()
    keys = None if obj is None or obj.type != 'MESH' else obj.data.shape_keys
    if keys is not None and KEY in keys.key_blocks:
        keys.key_blocks[KEY].mute = state


_HANDLERS = {
    "depsgraph_update_post": _on_update,
    "frame_change_post": _on_update,
    "undo_post": _after_undo,
    "redo_post": _after_undo,
    "save_pre": _before_save,
    "save_post": _after_save,
    "save_post_fail": _after_save,
    "render_init": _before_render,
    "render_complete": _after_render,
    "render_cancel": _after_render,
    "load_post": _after_load,
}


def register() -> None:
    """Follow what happens in the file."""
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Take the preview away and follow nothing."""
    for name, handler in _HANDLERS.items():
        compat.remove_handler(getattr(bpy.app.handlers, name), handler)
    end()
