# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Live scrub: while it is on, the slider shows the exact motion at every position, not only at the baked ones.

A temporary shape key follows the slider and adds the difference to what the baked keys show, so that all other keys,
the active key and the display stay as they are. It is not part of the file: it is removed before the file is saved and
comes back afterward. Its name is reserved: a key of that name is removed wherever undo or a recovered file brings it
back.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bmesh
import bpy

from ..solver.errors import InputError
from . import compat
from .keys import chain_keys, shape_keys
from .kinds import keys_of, mesh_of, shape_keys_of
from .store.chain import Chain
from .store.mesh_data import key_coordinates, set_key_coordinates
from .store.records import Record

if TYPE_CHECKING:
    from ..solver.frames.preview import PreviewCurve
    from ..solver.frames.weights import Weights
    from .bake.plan import Plan

KEY = "QC3D Preview"


@dataclass
class _Scrub:
    """The preview that is shown."""

    plan: Plan  # finds the object again and has the keys that the curve was made from
    chain: Chain
    weights: Weights
    curve: PreviewCurve
    place: float | None = None  # value of the slider when the key was last set
    was_edited: bool = False


_scrub: _Scrub | None = None
_suspended: _Scrub | None = None  # while the file is saved


def is_on(obj: bpy.types.Object | None, slider_name: str = "") -> bool:
    """Whether the preview is on for an object, and for the slider if one is named."""
    if _scrub is None or obj is None or _scrub.plan.object_id != obj.session_uid:
        return False
    return not slider_name or _scrub.chain.slider == slider_name


def begin(plan: Plan, chain: Chain, curve: PreviewCurve) -> None:
    """Show the motion at the slider of a baked chain and follow the slider from now on.

    Raises
    ------
    InputError
        If the object of the plan was deleted or changed, or the slider is not a number; nothing is changed then.
    """
    obj = plan.find_object()
    chain_keys.control_of(obj, chain).require()
    chain_keys.restart_drivers(keys_of(obj), chain)
    end()
    _show(obj, _Scrub(plan, chain, chain.weights, curve))


def end() -> None:
    """Remove the preview, if there is one, also one that undo or a recovered file brought back."""
    global _scrub
    _scrub = None
    for keys in list(bpy.data.shape_keys):
        mesh = keys.user
        if isinstance(mesh, bpy.types.Mesh) and mesh.library is None and _has_key(mesh):
            _remove_key(mesh)


def _show_again(scrub: _Scrub) -> None:
    """Show it if the object exists, is not being edited, and has the keys that the curve was made from."""
    with contextlib.suppress(InputError):
        obj = scrub.plan.find_object()
        chain = Record.read(keys_of(obj)).chain_of_slider(scrub.chain.slider)
        if chain is not None:  # undo may have restored a different number of steps
            _show(obj, replace(scrub, chain=chain, weights=chain.weights))


def _show(obj: bpy.types.Object, scrub: _Scrub) -> None:
    global _scrub
    try:
        key = obj.shape_key_add(name=KEY, from_mix=False)
        key.relative_key = keys_of(obj).reference_key
        key.value = 1.0
        scrub.place = None
        _scrub = scrub
        _follow(scrub)
    except BaseException:
        end()
        raise


def _follow(scrub: _Scrub) -> None:
    """Update the key to the slider, or end the preview if the object was deleted or edited, or lost key or slider."""
    obj = scrub.plan.locate()
    keys = None if obj is None or obj.type != 'MESH' else shape_keys_of(obj)
    key = None if keys is None else keys.key_blocks.get(KEY)
    if obj is None or keys is None or key is None:
        end()
        return
    if mesh_of(obj).is_editmode:
        scrub.was_edited = True  # the key is removed only after Edit Mode, while no tool works on the mesh
        return
    control = chain_keys.control_of(obj, scrub.chain)
    is_whole = len(mesh_of(obj).vertices) == len(key.points) == scrub.curve.vertices
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
    in_layers = mesh.is_editmode and bmesh.from_edit_mesh(mesh).verts.layers.shape.get(KEY) is not None
    return in_layers or _block(mesh) is not None


def _block(mesh: bpy.types.Mesh) -> bpy.types.ShapeKey | None:
    keys = mesh.shape_keys
    return None if keys is None else keys.key_blocks.get(KEY)


def _remove_key(mesh: bpy.types.Mesh) -> None:
    found = next((obj for obj in bpy.data.objects if obj.data == mesh), None)
    obj = bpy.data.objects.new(KEY, mesh) if found is None else found  # Blender removes keys through an object
    if mesh.is_editmode:  # leaving Edit Mode would create the key again from its layer
        layers = bmesh.from_edit_mesh(mesh).verts.layers.shape
        layer = layers.get(KEY)
        if layer is not None:
            layers.remove(layer)
    key = _block(mesh)
    if key is not None:
        shape_keys.remove_key(obj, key)
    if found is None:
        bpy.data.objects.remove(obj)


@compat.persistent
def _on_update(*_: object) -> None:
    if _scrub is not None:
        _follow(_scrub)


@compat.persistent
def _after_undo(*_: object) -> None:
    """Keep the preview after undo or redo as long as the keys are the same."""
    scrub = _scrub
    end()
    if scrub is not None:
        _show_again(scrub)


@compat.persistent
def _before_save(*_: object) -> None:
    global _suspended
    _suspended = _scrub
    end()


@compat.persistent
def _after_save(*_: object) -> None:
    global _suspended
    scrub, _suspended = _suspended, None
    if scrub is not None:
        _show_again(scrub)


@compat.persistent
def _before_render(*_: object) -> None:
    _mute(True)


@compat.persistent
def _after_render(*_: object) -> None:
    _mute(False)


@compat.persistent
def _after_load(*_: object) -> None:
    end()


def _mute(state: bool) -> None:
    obj = None if _scrub is None else _scrub.plan.locate()
    keys = None if obj is None or obj.type != 'MESH' else shape_keys_of(obj)
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
    """Add the handlers."""
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Remove the handlers and the preview."""
    for name, handler in _HANDLERS.items():
        compat.remove_handler(getattr(bpy.app.handlers, name), handler)
    end()
