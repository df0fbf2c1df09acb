# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The heat map of a chain: attributes for each step, and a modifier that interpolates them like the slider.

The mesh gets a float attribute for each measure and step, such as "QC3D stretch 2" for the second step. The modifier's
nodes write the values at the slider's position into "QC3D stretch", "QC3D volume" and "QC3D dilatation", which any
material can read, and the colors of one of them into the color attribute "QC3D Heat Map", which the viewport shows.
The heat map can be saved, played and rendered without the add-on.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError
from .. import compat
from ..keys import drivers
from ..keys.chain_keys import control_of
from ..keys.control import Control
from ..kinds import expect, keys_of, mesh_of, present
from ..store import id_properties, kept_measures
from ..store import stored_values as stored
from ..store.chain import Chain
from ..store.kept_measures import MEASURES
from .colors import Scale, linear, scale_between, scale_of

if TYPE_CHECKING:
    from bpy.stub_internal.rna_enums import NodeMathItems

NAME = "QC3D Heat Map"  # of the modifier, its nodes and the color attribute
_STATE = "qc3d_heat_map"
_BEFORE = "active_colour"  # in the state: the color attribute that was active before, spelled as files have it


class Shown(NamedTuple):
    """The contents of a shown heat map."""

    slider: str
    measure: str
    scale: Scale


def shown(obj: bpy.types.Object | None) -> Shown | None:
    """What an object's heat map shows; None without one. Fast enough for a panel."""
    if obj is None or obj.type != 'MESH' or _modifier(obj) is None:
        return None
    state = _state(obj)
    try:
        _, low, high, _ = stored.plain_list(state["scale"])
        scale = scale_between(str(state["measure"]), stored.number(low), stored.number(high))
        return Shown(stored.name(state["slider"]), str(state["measure"]), scale)
    except (TypeError, ValueError, KeyError):
        return None


def show(obj: bpy.types.Object, chain: Chain, measure: str) -> None:
    """Show the heat map of one measure on the object, instead of any other; if that fails, nothing is changed.

    Raises
    ------
    InputError
        If the measures of the bake are not stored or belong to another mesh, or the slider is not a number.
    """
    mesh = mesh_of(obj)
    measures = kept_measures.read(keys_of(obj), chain.slider, len(mesh.vertices))
    if measures is None or len(measures[measure]) != chain.intervals + 1:
        raise InputError(f"The in-betweens of '{chain.slider}' were not measured on this mesh; re-bake them first.")
    control = control_of(obj, chain)
    control.require()
    if NAME in obj.modifiers and _modifier(obj) is None:
        raise InputError(f"'{obj.name}' has another modifier named '{NAME}'; rename that first.")
    scale = scale_of(measure, measures[measure])
    by_step = {f"QC3D {name} {step}": of_all[step] for name, of_all in measures.items() for step in range(len(of_all))}
    color = _active_color(mesh)
    if color == NAME:  # of the one that this one replaces
        color = _state(obj).get(_BEFORE, "")
    state = {"slider": chain.slider, "measure": measure, "scale": scale, _BEFORE: color}
    with ExitStack() as undo:
        undo.callback(_set_active_color, mesh, _active_color(mesh))
        undo.callback(_set_attributes, mesh, _attributes(mesh))
        _set_attributes(mesh, by_step)
        mesh.color_attributes.active_color_name = NAME
        tree = bpy.data.node_groups.new(NAME, 'GeometryNodeTree')
        undo.callback(bpy.data.node_groups.remove, tree)
        _make_nodes(expect(bpy.types.GeometryNodeTree, tree), measure, scale)
        _drive(tree, control, chain)
        id_properties.put(obj, _STATE, json.dumps(state), undo)
        modifier = _modifier(obj)
        if modifier is None:
            added = obj.modifiers.new(NAME, 'NODES')
            undo.callback(obj.modifiers.remove, added)
            modifier = expect(bpy.types.NodesModifier, added)
            modifier.show_expanded = False
        before = modifier.node_group
        undo.callback(setattr, modifier, "node_group", before)
        modifier.node_group = tree
        undo.pop_all()
    if before is not None and before.users == 0:
        bpy.data.node_groups.remove(before)


def refresh(obj: bpy.types.Object, chain: Chain) -> None:
    """Update the heat map after a new bake of the chain, if the heat map of that chain is shown."""
    state = shown(obj)
    if state is None or state.slider != chain.slider:
        return
    if kept_measures.has(keys_of(obj), chain.slider):
        show(obj, chain, state.measure)
    else:  # a straight blend has none
        hide(obj)


def hide(obj: bpy.types.Object) -> None:
    """Remove the heat map and everything that it added."""
    before, modifier = _state(obj).get(_BEFORE, ""), _modifier(obj)
    _set_attributes(mesh_of(obj), None)
    _set_active_color(mesh_of(obj), before)
    if modifier is not None:  # last, so that an interrupted removal can be repeated
        tree = modifier.node_group
        obj.modifiers.remove(modifier)
        if tree is not None and tree.users == 0:
            bpy.data.node_groups.remove(tree)
    obj.pop(_STATE, None)


def _modifier(obj: bpy.types.Object) -> bpy.types.NodesModifier | None:
    modifier = obj.modifiers.get(NAME)
    return modifier if isinstance(modifier, bpy.types.NodesModifier) else None


def _state(obj: bpy.types.Object) -> dict[str, Any]:
    """The state that ``show`` stored with the object; empty if there is none or it is invalid."""
    try:
        return stored.parse(obj.get(_STATE))
    except ValueError:
        return {}


def _active_color(mesh: bpy.types.Mesh) -> str:
    return (mesh.color_attributes.active_color_name or "") if mesh.color_attributes else ""


def _set_active_color(mesh: bpy.types.Mesh, name: object) -> None:
    """Let the viewport show the color attribute of this name, if there is one."""
    if isinstance(name, str) and name in mesh.color_attributes.keys():  # noqa: SIM118 - fails on half a surrogate pair
        mesh.color_attributes.active_color_name = name


def _attributes(mesh: bpy.types.Mesh) -> dict[str, NDArray[np.float32]] | None:
    """Values (n,) of the heat map's attributes by name; None if the mesh has no attribute of the heat map."""
    found = {}
    for attribute in mesh.attributes:
        if _is_ours(attribute.name) and attribute.name != NAME and isinstance(attribute, bpy.types.FloatAttribute):
            found[attribute.name] = np.empty(len(attribute.data), dtype=np.float32)
            attribute.data.foreach_get("value", found[attribute.name])
    return found if found or NAME in mesh.attributes else None


def _set_attributes(mesh: bpy.types.Mesh, values: dict[str, NDArray[np.float32]] | None) -> None:
    """Replace the heat map's attributes by ones with these values (n,) and one for its colors; None removes all."""
    for name in [attribute.name for attribute in mesh.attributes if _is_ours(attribute.name)]:
        mesh.attributes.remove(mesh.attributes[name])
    if values is None:
        return
    for name, at_vertices in values.items():
        attribute = expect(bpy.types.FloatAttribute, mesh.attributes.new(name, 'FLOAT', 'POINT'))
        attribute.data.foreach_set("value", np.ascontiguousarray(at_vertices))
    mesh.color_attributes.new(NAME, 'FLOAT_COLOR', 'POINT')


def _is_ours(name: str) -> bool:
    if name == NAME:
        return True
    words = name.split(" ")
    return len(words) == 3 and words[0] == "QC3D" and words[1] in MEASURES and words[2].isdigit()


def _make_nodes(tree: bpy.types.GeometryNodeTree, measure: str, scale: Scale) -> None:
    """Add nodes that interpolate every measure between the two steps around the slider, and color one measure."""
    tree.is_modifier = True
    # The stubs of 5.2 have no socket types.
    new_socket: Callable[..., object] = present(tree.interface).new_socket
    for direction in ('INPUT', 'OUTPUT'):
        new_socket("Geometry", in_out=direction, socket_type='NodeSocketGeometry')
    make, link = tree.nodes.new, tree.links.new
    along = make('ShaderNodeValue')
    along.name = along.label = "Slider"
    step = _math(tree, 'FLOOR', along.outputs[0])
    part = _math(tree, 'FRACT', along.outputs[0])
    following = _math(tree, 'ADD', step, 1.0)
    texts = [_whole_number_text(tree, number) for number in (step, following)]
    geometry = make('NodeGroupInput').outputs[0]
    for name in MEASURES:
        ends = []
        for text in texts:
            replace = make('FunctionNodeReplaceString')
            _give(replace.inputs["String"], f"QC3D {name} #")
            _give(replace.inputs["Find"], "#")
            link(text, replace.inputs["Replace"])
            attribute = make('GeometryNodeInputNamedAttribute')
            expect(bpy.types.GeometryNodeInputNamedAttribute, attribute).data_type = 'FLOAT'
            link(replace.outputs[0], attribute.inputs["Name"])
            ends.append(attribute.outputs[0])
        # first + part (second - first). There is no step after the last; the part is 0 there.
        difference = _math(tree, 'SUBTRACT', ends[1], ends[0])
        value = _math(tree, 'ADD', ends[0], _math(tree, 'MULTIPLY', difference, part))
        geometry = _store(tree, geometry, f"QC3D {name}", 'FLOAT', value)
        if name == measure:
            shown_value = value
    geometry = _store(tree, geometry, NAME, 'FLOAT_COLOR', _color(tree, shown_value, scale))
    link(geometry, make('NodeGroupOutput').inputs[0])


def _give(socket: bpy.types.NodeSocket, value: float | str) -> None:
    """Set the value of an input socket without a link."""
    socket.default_value = value  # type: ignore[attr-defined]  # each kind of socket has one, all in one do not


def _math(
    tree: bpy.types.NodeTree,
    operation: NodeMathItems,
    first: bpy.types.NodeSocket,
    second: bpy.types.NodeSocket | float = 0.0,
) -> bpy.types.NodeSocket:
    node = tree.nodes.new('ShaderNodeMath')
    expect(bpy.types.ShaderNodeMath, node).operation = operation
    tree.links.new(first, node.inputs[0])
    if isinstance(second, float):
        _give(node.inputs[1], second)
    else:
        tree.links.new(second, node.inputs[1])
    return node.outputs[0]


def _whole_number_text(tree: bpy.types.NodeTree, number: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    node = tree.nodes.new('FunctionNodeValueToString')
    tree.links.new(number, node.inputs["Value"])
    _give(node.inputs["Decimals"], 0)
    return node.outputs[0]


def _store(
    tree: bpy.types.NodeTree,
    geometry: bpy.types.NodeSocket,
    name: str,
    kind: Literal['FLOAT', 'FLOAT_COLOR'],
    value: bpy.types.NodeSocket,
) -> bpy.types.NodeSocket:
    node = tree.nodes.new('GeometryNodeStoreNamedAttribute')
    store = expect(bpy.types.GeometryNodeStoreNamedAttribute, node)
    store.data_type, store.domain = kind, 'POINT'
    _give(node.inputs["Name"], name)
    tree.links.new(geometry, node.inputs["Geometry"])
    tree.links.new(value, next(socket for socket in node.inputs if socket.name == "Value" and socket.enabled))
    return node.outputs[0]


def _color(tree: bpy.types.NodeTree, value: bpy.types.NodeSocket, scale: Scale) -> bpy.types.NodeSocket:
    place = tree.nodes.new('ShaderNodeMapRange')
    tree.links.new(_math(tree, 'LOGARITHM', value, float(np.e)), place.inputs["Value"])
    _give(place.inputs["From Min"], float(np.log(scale.low)))
    _give(place.inputs["From Max"], float(np.log(scale.high)))
    ramp = tree.nodes.new('ShaderNodeValToRGB')
    stops = present(expect(bpy.types.ShaderNodeValToRGB, ramp).color_ramp).elements
    while len(stops) < len(scale.colors):
        stops.new(0.5)
    for number, color in enumerate(scale.colors):
        stops[number].position = number / (len(scale.colors) - 1)
        stops[number].color = (*linear(color), 1.0)  # type: ignore[assignment,unused-ignore]  # only with 5.2's stubs
    tree.links.new(place.outputs["Result"], ramp.inputs[0])
    return ramp.outputs[0]


def _drive(tree: bpy.types.NodeTree, control: Control, chain: Chain) -> None:
    """Drive the node "Slider" by the control's position along the steps."""
    curve = compat.new_driver(tree, 'nodes["Slider"].outputs[0].default_value')
    drivers.drive_position(curve, control, chain.places, range(len(chain.places)))
