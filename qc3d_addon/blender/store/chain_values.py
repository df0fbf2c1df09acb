# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of a chain in the record of bakes, checked while they are read."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from . import stored_values as stored
from .names import MAX_STEPS

LEAST_DISTANCE = 1e-5  # smallest difference between two places
_MOST_FRAME = 2**31  # largest absolute value of a frame number


def keyframe_values(frames: Sequence[int], via_at: Sequence[float]) -> list[tuple[float, float]]:
    """Frames and values of keyframes at the first and the last key, or at each of them with the places of the inner."""
    inner = via_at if len(frames) > 2 else ()
    return [(float(frame), value) for frame, value in zip(frames, (0.0, *inner, 1.0), strict=False)]


def keyframes_of(values: object, keys: int) -> tuple[int, ...]:
    """The stored frames of keyframes at the first and the last of ``keys`` keys, or at each of them."""
    frames = tuple(stored.whole(frame, -_MOST_FRAME, _MOST_FRAME) for frame in stored.plain_list(values))
    if len(frames) not in (2, keys) or any(last <= first for first, last in pairwise(frames)):
        raise ValueError("keyframes that are not those of keys, or without time between them")
    return frames


def places_of(found: dict[str, Any]) -> tuple[tuple[float, ...], tuple[int, ...]]:
    """Remove the places and corners from a chain's values and return them."""
    if "intervals" in found:
        intervals = stored.whole(found.pop("intervals"), 1, MAX_STEPS)
        return tuple(step / intervals for step in range(intervals + 1)), tuple(range(1, intervals))
    places = tuple(stored.number(place, 0.0, 1.0) for place in stored.plain_list(found.pop("places")))
    corners = tuple(stored.whole(step, 1, len(places) - 2) for step in stored.plain_list(found.pop("corners")))
    if not 2 <= len(places) <= MAX_STEPS + 1 or (places[0], places[-1]) != (0.0, 1.0):
        raise ValueError("not places from 0 to 1")
    if any(later - place < LEAST_DISTANCE for place, later in pairwise(places)):
        raise ValueError("places that are not in order")
    if any(later <= step for step, later in pairwise(corners)):
        raise ValueError("corners that are not in order")
    return places, corners


def request_of(values: object) -> dict[str, Any]:
    """The stored request of a bake: plain values, and dictionaries and lists of plain values."""
    found = stored.plain_dict(values)
    for value in found.values():
        for inner in value.values() if isinstance(value, dict) else value if isinstance(value, list) else (value,):
            if isinstance(inner, (dict, list)):
                raise ValueError("nested too deep")
    return found
