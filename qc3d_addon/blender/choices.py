# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user chooses for a bake, as Blender's properties."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from dataclasses import fields
from typing import TYPE_CHECKING, Any, get_args, get_type_hints

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..solver.settings import (
    Easing,
    Engine,
    FitOptions,
    FrameOptions,
    Mode,
    PlayOptions,
    Quality,
    StretchLaw,
    WeightKind,
)
from .bake.request import PlayOn
from .store.names import MAX_STEPS

_DESCRIPTIONS = {
    "mode": {
        "natural": "Limbs turn; lengths and volumes are kept",
        "linear": "The published scheme, for comparison: only the stretch of the volume is interpolated",
        "straight": "Vertices move on straight lines: for keys that are mirrored or turned inside out",
    },
    "stretch": {
        "linear": "Lengths grow by equal amounts",
        "logarithmic": "Lengths grow by equal factors",
    },
    "easing": {
        "linear": "Even speed",
        "ease-in": "Starts slowly",
        "ease-out": "Ends slowly",
        "ease-in-out": "Starts and ends slowly",
    },
    "engine": {
        "auto": "TetWild where it works, otherwise Delaunay",
        "tetwild": "fTetWild; slower, and finer where the surface needs it",
        "delaunay": "Delaunay tetrahedra of graded samples; fast, repeatable, works everywhere",
    },
    "weights": {
        "smooth": "A smooth path through the in-betweens, so that a few of them play the whole motion",
        "hats": "Straight lines from each in-between to the next",
    },
    "quality": {
        "normal": "Enough for in-betweens",
        "fine": "Twice as many tetrahedra: for heat maps of volume and dilatation, and for mode Linear",
        "finest": "Four times as many tetrahedra; slow",
        "exact": "As fine as the mesh itself, so that the map meets both keys; slowest, for heat maps and mode Linear",
    },
}
_OPTIONS = (FitOptions, FrameOptions, PlayOptions)
_DEFAULTS: dict[str, Any] = {field.name: field.default for kind in _OPTIONS for field in fields(kind)}
_KINDS = {name: hint for kind in _OPTIONS for name, hint in get_type_hints(kind).items()}


def _choice(setting: str, description: str) -> Any:  # noqa: ANN401 - what it is only Blender knows
    """A menu of what one of the solver's settings may be."""
    texts = _DESCRIPTIONS[setting]
    return EnumProperty(
        name=setting.capitalize(),
        description=description,
        items=[(name, name.capitalize(), texts.get(name, "")) for name in get_args(_KINDS[setting])],
        default=_DEFAULTS[setting],
        options={'SKIP_SAVE'},
    )


class InnerKey(bpy.types.PropertyGroup):
    """A key between the first and the last, by its name.

    It has nothing else: a script that passes a list of them to an operator must give every property of each.
    """


class MapChoices:
    """The keys, and everything that the maps between them depend on."""

    if TYPE_CHECKING:
        from_key: str
        via: "bpy.types.bpy_prop_collection_idprop[InnerKey]"
        to_key: str
        stretch: StretchLaw
        extra_turns: int
        engine: Engine
        quality: Quality
        seed: int
    else:
        from_key: StringProperty(
            name="From", description="The shape key to start from", options={'SKIP_SAVE'}
        )
        via: CollectionProperty(
            name="Through",
            description="The shape keys to go through on the way, in their order, as [{\"name\": key}, ...]",
            type=InnerKey,
            options={'SKIP_SAVE'},
        )
        to_key: StringProperty(name="To", description="The shape key to end with", options={'SKIP_SAVE'})
        stretch: _choice("stretch", "How mode Natural interpolates lengths")
        extra_turns: IntProperty(
            name="Extra Turns",
            description="Full turns to add between every two keys, for parts that spin more than half a turn; two "
            "shapes alone cannot tell them",
            default=_DEFAULTS["extra_turns"],
            min=-100,
            max=100,
            soft_min=-5,
            soft_max=5,
            options={'SKIP_SAVE'},
        )
        engine: _choice("engine", "Method that fills the volume around the mesh with tetrahedra")
        quality: _choice("quality", "Resolution of the volume around the mesh")
        seed: IntProperty(
            name="Seed",
            description="Seed of the random samples that the volume is made from",
            default=_DEFAULTS["seed"],
            min=0,
            options={'SKIP_SAVE'},
        )


class BakeChoices(MapChoices):
    """The keys, and the in-betweens to make between them."""

    if TYPE_CHECKING:
        count: int
        more: bool
        use_tolerance: bool
        tolerance: float
        weights: WeightKind
        colliders: str
        play_on: PlayOn
        mode: Mode
        easing: Easing
        use_keyframes: bool
        frame_start: int
        frame_end: int
    else:
        count: IntProperty(
            name="In-Betweens",
            description="Number of in-betweens between every two keys, evenly spaced",
            default=5,
            min=1,
            max=MAX_STEPS - 1,
            soft_max=20,
            options={'SKIP_SAVE'},
        )
        more: BoolProperty(
            name="More Where Needed",
            description="Make more in-betweens than that, up to twice as many, where volumes would not be kept "
            "between them",
            default=True,
            options={'SKIP_SAVE'},
        )
        use_tolerance: BoolProperty(
            name="As Few as Needed",
            description="Make only as many in-betweens as the tolerance asks for, where they help most, "
            "instead of a fixed number",
            default=False,
            options={'SKIP_SAVE'},
        )
        tolerance: FloatProperty(
            name="Tolerance",
            description="Largest distance of a vertex from its exact place, at any position of the slider; "
            "in the object's own units, before its scale",
            default=0.001,
            min=1e-6,
            soft_max=1.0,
            precision=4,
            step=0.01,
            subtype='DISTANCE',
            unit='LENGTH',
            options={'SKIP_SAVE'},
        )
        weights: _choice("weights", "How in-betweens are blended while they are played")
        colliders: StringProperty(
            name="Colliders",
            description="Collection of objects that the in-betweens must not enter, such as eyeballs under lids",
            options={'SKIP_SAVE'},
        )
        play_on: EnumProperty(
            name="Play On",
            description="What plays the in-betweens",
            items=[
                ("auto", "Auto", "The last key's own value where possible, otherwise a slider"),
                ("key", "Key", "The last key's own value, so that its present controls play the in-betweens"),
                ("slider", "Slider", "A new slider: a custom property of the object"),
            ],
            default="auto",
            options={'SKIP_SAVE'},
        )
        mode: _choice("mode", "How the in-betweens are made")
        easing: _choice("easing", "How the speed from the first key to the last changes")
        use_keyframes: BoolProperty(
            name="Keyframes",
            description="Animate the key or slider that plays the in-betweens",
            default=False,
            options={'SKIP_SAVE'},
        )
        frame_start: IntProperty(
            name="Start", description="Frame that shows the first key", default=1, options={'SKIP_SAVE'}
        )
        frame_end: IntProperty(
            name="End", description="Frame that shows the last key", default=25, options={'SKIP_SAVE'}
        )


class TimedChoices(BakeChoices):
    """The keys, when each is shown, and the in-betweens to make between them.

    Numbers in a text, since properties have no lists of any length. They are hidden, since only scripts need them: the
    panel has a row for each key.
    """

    if TYPE_CHECKING:
        via_at: str
        via_frames: str
    else:
        via_at: StringProperty(
            name="Values",
            description="Values of the slider or of the last key that show the keys to go through, such as "
            "\"0.25 0.6\"; empty for even ones",
            options={'SKIP_SAVE', 'HIDDEN'},
        )
        via_frames: StringProperty(
            name="Frames",
            description="Frames that show the keys to go through, such as \"12 18\"; what plays the in-betweens gets "
            "keyframes there, at Start and at End",
            options={'SKIP_SAVE', 'HIDDEN'},
        )
