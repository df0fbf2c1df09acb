# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user chooses for a bake, on the object's panel and as the operators' properties."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from typing import get_args

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty

from ..solver.settings import Engine, Mode, Quality, Settings
from .bake import BakeRequest
from .names import MAX_INBETWEENS

_DESCRIPTIONS = {
    "natural": "Rotations, lengths and volumes are kept",
    "linear": "The stretch of the volume is interpolated linearly, as published",
    "auto": "TetWild where it can run, else Delaunay",
    "tetwild": "Tetrahedral meshing in the wild; slower, and finer where the surface needs it",
    "delaunay": "Delaunay tetrahedra of graded samples; quick, repeatable, runs everywhere",
    "draft": "Coarse volume, for a first look",
    "normal": "What most characters need",
    "fine": "Fine volume; slow",
}
_DEFAULTS = Settings()


def _choices(literal: object) -> list[tuple[str, str, str]]:
    return [(name, name.capitalize(), _DESCRIPTIONS.get(name, "")) for name in get_args(literal)]


class PairChoices:
    """Two keys, and how the volume around them is filled."""

    from_key: StringProperty(name="From", description="The shape key to start from", options={'SKIP_SAVE'})
    to_key: StringProperty(name="To", description="The shape key to end with", options={'SKIP_SAVE'})
    engine: EnumProperty(
        name="Engine",
        description="What fills the volume around the mesh",
        items=_choices(Engine),
        default=_DEFAULTS.engine,
        options={'SKIP_SAVE'},
    )
    quality: EnumProperty(
        name="Quality",
        description="How fine the volume is",
        items=_choices(Quality),
        default=_DEFAULTS.quality,
        options={'SKIP_SAVE'},
    )


class BakeChoices(PairChoices):
    """A pair, and the in-betweens to make of it."""

    count: IntProperty(
        name="In-Betweens",
        description="Number of in-betweens, evenly spaced from the first key to the second",
        default=3,
        min=1,
        max=MAX_INBETWEENS,
        soft_max=20,
        options={'SKIP_SAVE'},
    )
    mode: EnumProperty(
        name="Mode",
        description="How the map between the keys is interpolated",
        items=_choices(Mode),
        default=_DEFAULTS.mode,
        options={'SKIP_SAVE'},
    )
    use_keyframes: BoolProperty(
        name="Keyframes",
        description="Animate the slider from the first key to the second",
        default=False,
        options={'SKIP_SAVE'},
    )
    frame_start: IntProperty(
        name="Start", description="Frame at which the slider is at the first key", default=1, options={'SKIP_SAVE'}
    )
    frame_end: IntProperty(
        name="End", description="Frame at which the slider is at the second key", default=25, options={'SKIP_SAVE'}
    )


class ObjectSettings(BakeChoices, bpy.types.PropertyGroup):
    """The panel's choices, kept with the object."""


def fill_from_panel(properties: bpy.types.OperatorProperties, settings: ObjectSettings) -> None:
    """Give every property that the caller of an operator left out the value that the panel shows."""
    shared = set(properties.bl_rna.properties.keys()) & set(settings.bl_rna.properties.keys())
    for name in shared - {"rna_type"}:
        if not properties.is_property_set(name):
            setattr(properties, name, getattr(settings, name))


def bake_request(choices: BakeChoices) -> BakeRequest:
    """The choices as a request; raises InputError where they do not fit together.

    Not a method of the choices: the Python module of Blender 4.2 crashes at its end where a registered class inherits
    both properties and methods from a class of its own.
    """
    return BakeRequest(
        from_key=choices.from_key,
        to_key=choices.to_key,
        count=choices.count,
        settings=Settings(mode=choices.mode, engine=choices.engine, quality=choices.quality),
        keyframes=(choices.frame_start, choices.frame_end) if choices.use_keyframes else None,
    )
