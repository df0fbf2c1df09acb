# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The anchors of a surface: where the interpolated map of the volume takes its vertices, led along a course."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ..arrays import Floats
from ..fit.fitted_map import FittedMap
from .course import Course
from .volume_path import VolumePath

VELOCITY_STEP = 0.02  # of a pair's time: second-order differences are accurate enough, and rounding is negligible


class VolumeAnchors:
    """Anchors of the vertices of an embedded pair, cube units; at the keys, they are the keys.

    Parameters
    ----------
    fitted : FittedMap
    volume : VolumePath
        The maps between its keys.
    """

    def __init__(self, fitted: FittedMap, volume: VolumePath) -> None:
        self._fitted, self._volume = fitted, volume
        self._course: Course | None = None
        ends = ((0.0, fitted.embedding.key0), (1.0, fitted.embedding.key1))
        self._missed = [key - fitted.landmarks @ volume.at(time) for time, key in ends]

    def along(self, course: Course) -> VolumeAnchors:
        """The same, led along a course."""
        led = copy.copy(self)
        led._course = course
        return led

    @property
    def is_led(self) -> bool:
        """Whether there is a course."""
        return self._course is not None

    def of(self, maps: Sequence[Floats] | Floats, times: Sequence[float]) -> list[tuple[float, Floats]]:
        """Times, each with the anchors (n, 3) of its map, as far along the course as that is followed."""
        plain = self._plain(maps, times)
        if self._course is None:
            return plain
        return [(time, self._course.lead(anchors, self._fitted.embedding, time)) for time, anchors in plain]

    def aside(
        self, maps: Sequence[Floats] | Floats, times: Sequence[float], reach: Floats, haste: int
    ) -> list[tuple[float, Floats]]:
        """The same, but within ``reach`` (n,), 0..1, those of the volume, whose parts do not cross.

        They go through the keys at the speed of the course, and are themselves again the sooner the more ``haste``, at
        least 2.
        """
        course, embedding = self._course, self._fitted.embedding
        plain = self._plain(maps, times)
        if course is None:
            return plain
        led = []
        for time, anchors in plain:
            first, second = time * (1.0 - time) ** haste, (1.0 - time) * time**haste
            change = embedding.vectors_to_cube(first * self._slower[0] - second * self._slower[1], time)
            anchors = anchors + course.share[:, None] * change
            led.append((time, course.lead(anchors, embedding, time, (1.0 - reach) * course.share)))
        return led

    def _plain(self, maps: Sequence[Floats] | Floats, times: Sequence[float]) -> list[tuple[float, Floats]]:
        """The landmarks (n, 3) of each map, what maps miss at the two keys blended in."""
        landmarks, missed = self._fitted.landmarks, self._missed
        return [
            (time, np.asarray(landmarks @ values + (1.0 - time) * missed[0] + time * missed[1]))
            for values, time in zip(maps, times, strict=True)
        ]

    @cached_property
    def _slower(self) -> tuple[Floats, Floats]:
        """(n, 3) velocities of the course at both keys minus those of the volume."""
        assert self._course is not None
        embedding, course = self._fitted.embedding, self._course
        times = [VELOCITY_STEP, 2.0 * VELOCITY_STEP, 1.0 - VELOCITY_STEP, 1.0 - 2.0 * VELOCITY_STEP]
        plain = self._plain(self._volume.maps_at(times), times)
        places = [embedding.from_cube(anchors, time) for time, anchors in plain]
        first = end_velocity(places[0], places[1], course.key0, 0)
        second = end_velocity(places[2], places[3], course.key1, 1)
        return course.slopes[0] - first, course.slopes[1] - second


def end_velocity(near: Floats, far: Floats, key: Floats, end: int) -> Floats:
    """(n, 3) velocities at the first (0) or second (1) key, from shapes one and two ``VELOCITY_STEP`` away from it."""
    outward = (4.0 * near - far - 3.0 * key) / (2.0 * VELOCITY_STEP)
    return np.asarray(outward if end == 0 else -outward)
