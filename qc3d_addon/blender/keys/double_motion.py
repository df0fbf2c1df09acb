# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Warnings about motion that adds to in-betweens: keys of the chain with a value of their own, other sliders."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import bpy

from .. import compat
from ..kinds import expect, keys_of
from ..store.chain import Chain
from . import drivers
from .chain_keys import owned_keys
from .control import value_path
from .own_keyframes import own_keys


def double_motion(obj: bpy.types.Object, chain: Chain, chains: Sequence[Chain]) -> list[str]:
    """Sentences about motion that adds to what the control of a chain shows; fast enough for every redraw of a panel.

    Parameters
    ----------
    chains
        All chains of the object.
    """
    keys = keys_of(obj)
    what = f"'{chain.on_key}'" if chain.on_key else "the slider"
    found = [_on_by_itself(key, what) for key in own_keys(keys, chain)]
    return [sentence for sentence in found if sentence] + list(_shown_twice(keys, chain, chains))


def _on_by_itself(key: bpy.types.ShapeKey, what: str) -> str:
    """A sentence about what moves a key besides the control, named ``what``; empty if nothing does."""
    keys, path = expect(bpy.types.Key, key.id_data), value_path(key.name)
    animation = keys.animation_data
    if key.mute:
        return ""
    if animation is not None and animation.drivers.find(path) is not None:
        return f"Key '{key.name}' is driven, which adds to what {what} shows."
    if compat.is_animated(keys, path):
        return f"Key '{key.name}' is animated, which adds to what {what} shows."
    if key.value != 0.0:
        return f"Key '{key.name}' has the value {key.value:.2f}, which adds to what {what} shows; set it to 0."
    return ""


def _shown_twice(keys: bpy.types.Key, chain: Chain, chains: Sequence[Chain]) -> Iterator[str]:
    """Other sliders that show the first key together with this one, each at its start."""
    first = chain.through[0]
    for other in chains if first != keys.reference_key.name and not chain.on_key else ():
        is_slider = other.slider != chain.slider and not other.on_key and not other.mirror_of
        if is_slider and other.through[0] == first and other.through != chain.through:
            yield f"The slider '{other.slider}' starts at '{first}' too, which then shows twice; keep one of them."


def unknown_inbetweens(keys: bpy.types.Key, chain: Chain, chains: Sequence[Chain]) -> Iterator[str]:
    """Sentences about keys that the same value plays but no record lists, as after a damaged record was deleted."""
    known = {value_path(key.name) for other in chains for key in owned_keys(keys, other).values()}
    for path, curve in drivers.driven_by(keys, value_path(chain.on_key)).items():
        if path not in known and path.endswith(".value") and len(curve.keyframe_points) > 1:
            name = bpy.utils.unescape_identifier(path.removeprefix('key_blocks["').removesuffix('"].value'))
            yield f"Key '{name}', of an earlier bake without a record, also follows '{chain.on_key}'; delete it."
