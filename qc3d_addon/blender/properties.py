# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's choices, kept with each object, and what operators take from them."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

import contextlib
from dataclasses import fields
from typing import TYPE_CHECKING

import bpy
from bpy.props import CollectionProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..solver.errors import InputError
from ..solver.settings import FitOptions, FrameOptions
from .bake import jobs
from .bake.request import BakeRequest
from .bake.suggested_keys import suggested_keys
from .choices import BakeChoices, MapChoices
from .heat_map import heat_map
from .heat_map.colors import MEASURE_ITEMS
from .kinds import expect, keys_of, shape_keys_of
from .store import checks
from .store.chain import Chain
from .store.records import Record


def _show_measure(settings: "ObjectSettings", context: bpy.types.Context) -> None:
    """Switch a heat map that is shown to the chosen measure; if that is impossible, its button says why."""
    obj = expect(bpy.types.Object, settings.id_data)
    state = heat_map.shown(obj)
    if state is None or state.measure == settings.measure or checks.object_problem(obj) is not None:
        return
    with contextlib.suppress(InputError):
        chain = Record.read(keys_of(obj)).chain_of_slider(state.slider)
        if chain is not None:
            heat_map.show(obj, chain, settings.measure)


def _get_first(settings: "ObjectSettings") -> str:
    return panel_keys(settings)[0]


def _set_first(settings: "ObjectSettings", name: str) -> None:
    settings.from_key = name
    jobs.prepare_ahead()


def _get_last(settings: "ObjectSettings") -> str:
    return panel_keys(settings)[-1]


def _set_last(settings: "ObjectSettings", name: str) -> None:
    settings.to_key = name
    jobs.prepare_ahead()


def _get_row(settings: "ObjectSettings") -> int:
    sliders = [chain.slider for chain in newest_first(expect(bpy.types.Object, settings.id_data))]
    return sliders.index(settings.chosen) if settings.chosen in sliders else 0


def _set_row(settings: "ObjectSettings", row: int) -> None:
    chains = newest_first(expect(bpy.types.Object, settings.id_data))
    if 0 <= row < len(chains):
        settings.chosen = chains[row].slider


class TimedKey(bpy.types.PropertyGroup):
    """A key between the first and the last in the panel, with the value and the frame that show it."""

    if TYPE_CHECKING:
        at: float
        frame: int
    else:
        at: FloatProperty(
            name="Value",
            description="Value of the slider, or of the key that plays the in-betweens, that shows this key",
            default=0.5,
            min=0.001,
            max=0.999,
            precision=3,
        )
        frame: IntProperty(name="Frame", description="Frame that shows this key", default=1)


class ObjectSettings(BakeChoices, bpy.types.PropertyGroup):
    """The panel's choices, kept with the object.

    ``first`` and ``last`` are the keys that the panel shows: those that were chosen, and where none was, those that are
    most likely meant. ``row`` is the row of the list of bakes that is chosen, the newest where none was.
    """

    if TYPE_CHECKING:
        via: "bpy.types.bpy_prop_collection_idprop[TimedKey]"  # type: ignore[assignment]
        via_timing: str
        measure: str
        first: str
        last: str
        chosen: str
        row: int
    else:
        via: CollectionProperty(
            name="Through", description="The shape keys to go through on the way, in their order", type=TimedKey
        )
        via_timing: EnumProperty(
            name="Spacing",
            description="When the keys to go through are shown",
            items=[
                ("even", "Even", "The motion takes the same time from each key to the next"),
                ("value", "Values", "Each key is shown at a value of the slider or of the last key"),
                ("frame", "Frames", "Each key is shown at a frame; what plays the in-betweens gets keyframes there"),
            ],
            default="even",
        )
        measure: EnumProperty(
            name="Measure", description="What the heat map shows", items=MEASURE_ITEMS, update=_show_measure
        )
        first: StringProperty(
            name="From",
            description="The shape key to start from; what the last one is relative to where none was chosen",
            get=_get_first,
            set=_set_first,
        )
        last: StringProperty(
            name="To",
            description="The shape key to end with; the active one where none was chosen",
            get=_get_last,
            set=_set_last,
        )
        chosen: StringProperty(name="Bake", description="The bake that the panel shows; the newest where empty")
        row: IntProperty(
            name="Bake", description="The bake whose details are shown below", get=_get_row, set=_set_row
        )


SETTINGS = "qc3d"  # the attribute of an object that has them


def settings_of(obj: bpy.types.Object) -> ObjectSettings:
    """The panel's choices for an object."""
    settings: ObjectSettings = getattr(obj, SETTINGS)
    return settings


# Functions, not methods of the choices: the Python module of Blender 4.2 crashes at its end where a registered class
# inherits both properties and methods from a class of its own.


def fill_from_panel(properties: bpy.types.OperatorProperties, settings: ObjectSettings) -> None:
    """Give every property that the caller of an operator left out the value that the panel shows.

    The keys go together: who names the first or the last means those between as they are given, none included. Who
    gives a number of in-betweens means exactly that number.
    """
    known = set(properties.bl_rna.properties.keys())
    if not any(properties.is_property_set(name) for name in ("from_key", "to_key", "via")):
        timing = {"value": "via_at", "frame": "via_frames"}.get(settings.via_timing, "")
        for inner in settings.via:
            properties.via.add().name = inner.name
        if timing in known and not properties.is_property_set(timing):
            numbers = [f"{inner.at:.6g}" if timing == "via_at" else f"{inner.frame}" for inner in settings.via]
            setattr(properties, timing, " ".join(numbers))
    if "more" in known and properties.is_property_set("count") and not properties.is_property_set("more"):
        properties.more = False
    left_out = [name for name in ("from_key", "to_key") if not properties.is_property_set(name)]
    shared = known & set(settings.bl_rna.properties.keys())
    for name in shared - {"rna_type", "via"}:
        if not properties.is_property_set(name):
            setattr(properties, name, getattr(settings, name))
    first, last = (getattr(properties, name) for name in ("from_key", "to_key"))
    likely = suggested_keys(expect(bpy.types.Object, settings.id_data), first, last)
    for name, key in zip(("from_key", "to_key"), likely, strict=True):
        if name in left_out:
            setattr(properties, name, key)


def fill_panel(settings: ObjectSettings, keys: tuple[str, ...], chosen: FitOptions) -> None:
    """Let the panel show the keys of a map and what it was made with."""
    settings.from_key, settings.to_key = keys[0], keys[-1]
    settings.via.clear()
    for name in keys[1:-1]:
        settings.via.add().name = name
    for field in fields(FitOptions):
        if hasattr(settings, field.name):
            setattr(settings, field.name, getattr(chosen, field.name))


def newest_first(obj: bpy.types.Object) -> list[Chain]:
    """The bakes of an object as the panel lists them; none where the record cannot be read."""
    keys = shape_keys_of(obj) if obj.type == 'MESH' else None
    with contextlib.suppress(InputError):
        return [] if keys is None else Record.read(keys).chains[::-1]
    return []


def show_newest(obj: bpy.types.Object | None) -> None:
    """Let the panel show the newest bake of an object."""
    if obj is not None:
        settings_of(obj).chosen = ""


def panel_keys(settings: ObjectSettings) -> tuple[str, ...]:
    """The names of the keys that the panel shows, from the first to the last."""
    obj = expect(bpy.types.Object, settings.id_data)
    first, last = suggested_keys(obj, settings.from_key, settings.to_key)
    return (first, *(inner.name for inner in settings.via), last)


def key_names(choices: MapChoices) -> tuple[str, ...]:
    """The names of the keys from the first to the last."""
    return (choices.from_key, *(inner.name for inner in choices.via), choices.to_key)


def fit_options(choices: MapChoices) -> FitOptions:
    """What the fit depends on; what the panel does not offer stays at its default."""
    names = [field.name for field in fields(FitOptions) if hasattr(choices, field.name)]
    return FitOptions(**{name: getattr(choices, name) for name in names})


def bake_request(choices: BakeChoices, keys: tuple[str, ...] | None = None) -> BakeRequest:
    """The choices as a request, for their own keys or others; raises InputError where they do not fit together."""
    frames = [round(frame) for frame in _numbers(getattr(choices, "via_frames", ""))]
    keyframes = (choices.frame_start, *frames, choices.frame_end) if choices.use_keyframes or frames else None
    return BakeRequest(
        keys=key_names(choices) if keys is None else keys,
        count=choices.count,
        fit_options=fit_options(choices),
        frame_options=FrameOptions(choices.mode, choices.easing, _numbers(getattr(choices, "via_at", ""))),
        keyframes=keyframes,
        tolerance=choices.tolerance if choices.use_tolerance else 0.0,
        weights=choices.weights,
        play_on=choices.play_on,
        colliders=choices.colliders,
        more=choices.more,
    )


def _numbers(text: str) -> tuple[float, ...]:
    """The numbers of a text, separated by spaces or commas; raises InputError for anything else."""
    try:
        return tuple(float(part) for part in text.replace(",", " ").split())
    except ValueError as error:
        raise InputError(f"{text!r} is not a row of numbers; write them like 12 18.") from error
