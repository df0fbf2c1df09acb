# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Exports an object with its in-betweens: Blender's own exporter writes the file, then in-betweens are added."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError
from ...solver.files.atomic import replacing_all, require_room, require_writable
from .. import native_files
from ..keys import chain_keys, chain_shapes
from ..kinds import keys_of, mesh_of, present
from ..store import checks
from ..store.chain import Chain
from ..store.records import Record
from . import fbx_files, gltf_files, usd_files
from .in_betweens import InBetweens
from .stand_ins import playing_keys
from .wholes import as_whole

# In-betweens per key in USD and FBX. Programs that read them interpolate linearly, and with so many, straight lines
# miss a rotation by 90 degrees by 0.2 % of the radius.
DENSITY = 12
# The specification asks glTF viewers to support only eight morphed attributes (glTF 2.0, section 3.7.2.2).
_MOST_TARGETS = 8
_MOST_EVALUATIONS = 10
SUFFIXES = (".usda", ".usdc", ".usd", ".fbx", ".glb")


def export(obj: bpy.types.Object | None, path: Path, density: int = DENSITY) -> list[str]:
    """Write an object with its shape keys and their in-betweens, and the animation over the scene's frames.

    The object and the scene are unchanged afterward, whatever happens. The parents of the object and the armatures
    that deform it are exported too.

    Parameters
    ----------
    obj
        A mesh object with in-betweens. Those that a slider plays become in-betweens of a key named as the slider.
    path
        The file; its extension chooses the format: .usda, .usdc or .usd, .fbx, .glb.
    density
        Number of in-betweens per key in USD and FBX, computed from what the key plays.

    Returns
    -------
    list of str
        Sentences for the user.

    Raises
    ------
    InputError
        If the object has no in-betweens, the extension is unknown, or the file cannot be written.
    """
    obj = checks.require_object(obj)
    chains = _chains(obj)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"{path.name} has none of the extensions {', '.join(SUFFIXES)}; choose one of them.")
    require_writable(path)
    # Beside its place: exporters write the paths of images relative to the file's own folder.
    size = 12 * len(mesh_of(obj).vertices) * (len(keys_of(obj).key_blocks) + (density + 1) * len(chains))
    with replacing_all(path, beside=True) as (unfinished,), _alone(obj):
        native_files.require_short(unfinished, path)
        if suffix == ".glb":
            with as_whole(obj):
                return _export_gltf(obj, chains, unfinished, path, size)
        with playing_keys(obj, chains) as playing:
            found = [in_betweens(obj, chain, density, key) for chain, key in zip(chains, playing, strict=True)]
            with as_whole(obj) as whole:
                if whole is not None:
                    found = [one._replace(offsets=whole.offsets(one.offsets)) for one in found]
                _export_in_betweens(obj, found, unfinished, path, size)
    return []


def _export_in_betweens(
    obj: bpy.types.Object, found: list[InBetweens], unfinished: Path, path: Path, size: int
) -> None:
    """Export the keys as shapes, and add their in-betweens."""
    if path.suffix.lower() == ".fbx":
        _called(
            lambda: bpy.ops.export_scene.fbx(
                filepath=str(unfinished),
                use_selection=True,
                bake_anim_use_nla_strips=False,
                bake_anim_use_all_actions=False,
                bake_anim_simplify_factor=0.0,
                use_mesh_modifiers=False,
            ),
            unfinished,
            path,
            size,
        )
        fbx_files.add_in_betweens(unfinished, mesh_of(obj).name, found)
        return
    _called(
        lambda: bpy.ops.wm.usd_export(
            filepath=str(unfinished), selected_objects_only=True, export_animation=True, export_shapekeys=True
        ),
        unfinished,
        path,
        size,
    )
    names = [key.name for key in keys_of(obj).key_blocks[1:]]
    usd_files.add_in_betweens(unfinished, names, len(mesh_of(obj).vertices), found)


def in_betweens(obj: bpy.types.Object, chain: Chain, density: int, key: str) -> InBetweens:
    """``density`` evenly spaced shapes that a key plays between 0 and 1, including what was sculpted since.

    Parameters
    ----------
    key
        Name of the key that plays the chain by its value, or stands in for its slider.

    Raises
    ------
    InputError
        If shape keys of the chain are missing.
    """
    places = np.linspace(0.0, 1.0, density + 2)[1:-1]
    shapes = chain_shapes.step_shapes(obj, chain)
    played = chain.weights.played(shapes, places)
    made = frozenset(key.name for key in chain_keys.owned_keys(keys_of(obj), chain).values())
    return InBetweens(key, made, places, played - shapes[0])


def _chains(obj: bpy.types.Object) -> list[Chain]:
    chains = Record.read(keys_of(obj)).chains
    if not chains:
        raise InputError(f"'{obj.name}' has no in-betweens; bake some first.")
    return chains


def _export_gltf(
    obj: bpy.types.Object, chains: list[Chain], unfinished: Path, path: Path, size: int
) -> list[str]:
    """Export the keys as morph targets with their weights at every frame."""
    _called(
        lambda: bpy.ops.export_scene.gltf(filepath=str(unfinished), export_format='GLB', use_selection=True),
        unfinished,
        path,
        size,
    )
    frames, values = _values_over_time(obj)
    render = present(bpy.context.scene).render
    names = [key.name for key in keys_of(obj).key_blocks]
    seconds = frames * (render.fps_base / render.fps)
    gltf_files.set_weight_animation(unfinished, obj.name, names, seconds, values)
    return [
        f"'{chain.on_key or chain.slider}' has {len(chain.keys)} in-betweens; some programs support only "
        f"{_MOST_TARGETS} morph targets, so re-bake it with fewer."
        for chain in chains
        if len(chain.keys) > _MOST_TARGETS
    ]


def _values_over_time(obj: bpy.types.Object) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The scene's frames (f,), and the values (f, k) of the object's shape keys at them."""
    scene = present(bpy.context.scene)
    before = scene.frame_current, scene.frame_subframe
    frames = range(scene.frame_start, scene.frame_end + 1)
    values = np.empty((len(frames), len(keys_of(obj).key_blocks)))
    try:
        for row, frame in enumerate(frames):
            scene.frame_set(frame)
            values[row] = _settled_values(obj)
    finally:
        scene.frame_set(before[0], subframe=before[1])
    return np.array(frames, dtype=np.float64), values


def _settled_values(obj: bpy.types.Object) -> NDArray[np.float64]:
    """(k,) the present values of the object's shape keys.

    Where drivers of the user move other things of the keys than their values, Blender's threads may write values of the
    frame before back, one time in a thousand on a machine with much to do: two evaluations that agree are right.
    """
    found = _values(obj)
    for _ in range(_MOST_EVALUATIONS):
        keys_of(obj).update_tag()
        present(bpy.context.view_layer).update()
        before, found = found, _values(obj)
        if np.array_equal(before, found):
            break
    return found


def _values(obj: bpy.types.Object) -> NDArray[np.float64]:
    keys = keys_of(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    return np.array([0.0 if key.mute else key.value for key in keys.key_blocks])


@contextmanager
def _alone(obj: bpy.types.Object) -> Iterator[None]:
    """Select only the object, its parents and the armatures that deform it while the block runs."""
    layer = present(bpy.context.view_layer)
    together = {obj}
    for modifier in obj.modifiers:
        if isinstance(modifier, bpy.types.ArmatureModifier) and modifier.object is not None:
            together.add(modifier.object)
    above = obj.parent
    while above is not None:
        together.add(above)
        above = above.parent
    selected, active = set(present(bpy.context.selected_objects)), layer.objects.active
    with ExitStack() as undo:
        undo.callback(_select, layer, selected, active)
        for one in together:
            if one.name not in layer.objects:
                raise InputError(f"'{one.name}' is not in this view layer; enable its collection first.")
            _show(one, undo)
        layer.update()  # only what it knows to be shown can be selected
        _select(layer, together, obj)
        yield


def _show(one: bpy.types.Object, undo: ExitStack) -> None:
    """Show a hidden object until ``undo`` is closed; raises InputError if its collection is hidden."""
    if one.visible_get():
        return
    undo.callback(one.hide_set, one.hide_get())
    undo.callback(setattr, one, "hide_viewport", one.hide_viewport)
    one.hide_viewport = False
    one.hide_set(False)
    if not one.visible_get():
        raise InputError(f"'{one.name}' is in a hidden collection; show the collection first.")


def _select(layer: bpy.types.ViewLayer, objects: set[bpy.types.Object], active: bpy.types.Object | None) -> None:
    for one in layer.objects:
        one.select_set(one in objects, view_layer=layer)
    layer.objects.active = active


def _called(exporter: Callable[[], object], unfinished: Path, path: Path, size: int) -> None:
    """Run one of Blender's exporters, which writes a file of about ``size`` bytes.

    Raises
    ------
    InputError
        If the exporter is disabled or fails.
    """
    try:
        result = exporter()
    except AttributeError as error:
        raise InputError(f"Blender's exporter for {path.suffix} is disabled; enable its add-on first.") from error
    except RuntimeError as error:
        words = native_files.words(error, unfinished, path)
        require_room(path, size)  # on a full disk, exporters report all kinds of errors
        raise InputError(f"{path} cannot be written: {words}.") from error
    if result != {'FINISHED'} or not unfinished.exists():
        require_room(path, size)
        raise InputError(f"{path} was not written by Blender's exporter; try another folder.")
