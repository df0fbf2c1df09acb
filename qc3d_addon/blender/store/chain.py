# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A baked sequence of keys, as the record of a mesh's bakes holds it.

Records come from files of anyone, so the types and ranges of everything that is read are checked before it is used.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any, get_args

from ...solver.settings import Easing
from . import stored_values as stored
from .chain_values import keyframe_values, keyframes_of, places_of, request_of
from .names import LIMIT
from .summaries import Summary

if TYPE_CHECKING:
    from ...solver.frames.weights import Weights

_LONGEST_KEY = 2 * LIMIT  # bytes; a mirror image may have invented key names, longer than Blender's limit
_LONGEST_DIGEST = 64


@dataclass
class Chain:
    """A baked sequence of keys: its control and the shape keys that the control plays.

    Parameters
    ----------
    through
        Names of the user's own keys that the motion goes through, from the first to the last.
    slider
        Name of the custom property that plays the chain, and name of the chain.
    places
        Values of the control at which it shows a single shape, from 0 (step 0, the first key) to 1 (the last key).
    corners
        Steps at which the path through the shapes is not smooth: all inner ones if it is piecewise linear.
    keys
        Names of the generated shape keys, by step.
    keyframes
        Frames of the keyframes that a bake put on the control, at the first and the last key or at each; None if it put
        none.
    request
        The request of the newest bake, as plain values; empty for bakes of older versions. Only ``BakeRequest.again``
        reads it.
    result
        The results of the newest bake that the panel shows; None for bakes of older versions.
    on_key
        Name of the user's key whose value plays the chain, the last of ``through``; empty if a slider does. If it is
        not empty, ``slider`` is only the name of the chain.
    digests
        Hashes of the shapes of the keys ``through`` at the newest bake; empty for bakes of older versions.
    mirror_of
        Slider of the chain that this one is the mirror image of; empty if it was baked from its own keys.
    muted
        Names of the keys ``through`` whose own keyframes a bake muted, because they would add to what a slider shows.
    """

    through: tuple[str, ...]
    slider: str
    places: tuple[float, ...] = (0.0, 1.0)
    corners: tuple[int, ...] = ()
    keys: dict[int, str] = field(default_factory=dict)
    keyframes: tuple[int, ...] | None = None
    request: dict[str, Any] = field(default_factory=dict)
    result: Summary | None = None
    mirror_of: str = ""
    on_key: str = ""
    digests: tuple[str, ...] = ()
    muted: tuple[str, ...] = ()

    @classmethod
    def from_json(cls, values: object) -> Chain:
        """What ``dataclasses.asdict`` makes of it; raises ValueError, KeyError or TypeError for anything else."""
        found = dict(stored.plain_dict(values))
        through = tuple(stored.name(name, _LONGEST_KEY) for name in stored.plain_list(found.pop("through")))
        places, corners = places_of(found)
        by_text = stored.plain_dict(found.pop("keys"))
        steps = {str(step): step for step in range(len(places))}
        keys = {steps[text]: stored.name(name) for text, name in by_text.items()}
        if len(through) < 2 or any(name == following for name, following in pairwise(through)):
            raise ValueError("not a row of keys")
        if len(set(keys.values())) < len(keys):
            raise ValueError("one key for two steps")
        keyframes = found.pop("keyframes", None)
        if keyframes is not None:
            keyframes = keyframes_of(keyframes, len(through))
        request, result = request_of(found.pop("request", {})), Summary.from_json(found.pop("result", None))
        slider, mirror_of = stored.name(found.pop("slider")), stored.text(found.pop("mirror_of", ""), LIMIT)
        on_key = stored.text(found.pop("on_key", ""), LIMIT)
        digests = tuple(stored.text(one, _LONGEST_DIGEST) for one in stored.plain_list(found.pop("digests", [])))
        muted = tuple(stored.name(name, _LONGEST_KEY) for name in stored.plain_list(found.pop("muted", [])))
        if on_key not in ("", through[-1]):
            raise ValueError("played by a key that is not its last")
        if found:
            raise ValueError("values that are not known")
        row = (through, slider, places, corners, keys, keyframes)
        return cls(*row, request, result, mirror_of, on_key, digests, muted)

    @property
    def base(self) -> str:
        """Name of the key that the playing key is relative to; empty if a slider plays the chain."""
        return self.through[0] if self.on_key else ""

    @property
    def mode(self) -> str:
        """The mode of the newest bake; empty if unknown."""
        return self._setting("mode")

    @property
    def easing(self) -> Easing:
        """The easing of the newest bake; linear if unknown."""
        return next((known for known in get_args(Easing) if known == self._setting("easing")), "linear")

    @property
    def keyframe_values(self) -> list[tuple[float, float]]:
        """Frames and values of the keyframes that a bake put on the control."""
        return keyframe_values(self.keyframes or (), self.via_at)

    @property
    def via_at(self) -> tuple[float, ...]:
        """Places of the inner keys, where the newest bake was told them; otherwise empty: they are evenly spaced."""
        values = self.request.get("via_at")
        if not isinstance(values, list) or not all(isinstance(value, float) for value in values):
            return ()
        return tuple(values)

    def _setting(self, name: str) -> str:
        settings = self.request.get("settings")
        value = settings.get(name) if isinstance(settings, dict) else None
        return value if isinstance(value, str) else ""

    @property
    def intervals(self) -> int:
        """Number of intervals between the steps."""
        return len(self.places) - 1

    @property
    def weights(self) -> Weights:
        """The weights of the steps' shapes as functions of the control."""
        from ...solver.frames.weights import Weights  # scipy would make Blender start slower

        return Weights.smooth(self.places, self.corners)
