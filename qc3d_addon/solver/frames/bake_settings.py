# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How a chain of frames was baked, as a few words: all but the keys, the triangles, and what frames must not enter."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, cast, get_args

import numpy as np

from ..arrays import Floats
from ..errors import InputError
from ..keys.halves import MirrorPlane
from ..settings import FitOptions, FrameOptions, Mirror
from .bake import evenly_spaced
from .key_times import KeyTimes
from .task import Task

_DAMAGED = "The settings of the frames make no sense; the file is damaged."


@dataclass(frozen=True)
class Settings:
    """How a chain of frames was baked.

    Parameters
    ----------
    at : tuple of int
        The numbers of the frames that are keys; the first is 0, the last that of the last frame.
    times : tuple of float
        The frames' times, or none where these are as usual: as many between every two keys.
    fit_options, frame_options
    mirror : str
        The axes across which the mesh was mirrored; ``none`` for a whole.
    """

    at: tuple[int, ...]
    times: tuple[float, ...] = ()
    fit_options: FitOptions = field(default_factory=FitOptions)
    frame_options: FrameOptions = field(default_factory=FrameOptions)
    mirror: Mirror = "none"

    @property
    def text(self) -> str:
        """All of it as JSON, without what is as by default."""
        content: dict[str, Any] = {"at": self.at}
        if self.times:
            content["times"] = self.times
        if self.mirror != "none":
            content["mirror"] = self.mirror
        for name, options in (("fit", self.fit_options), ("frame", self.frame_options)):
            usual = asdict(type(options)())
            if changed := {key: value for key, value in asdict(options).items() if value != usual[key]}:
                content[name] = changed
        return json.dumps(content, separators=(",", ":"))

    @classmethod
    def of_text(cls, text: str | bytes) -> Settings:
        """What ``text`` made; raises InputError for anything else."""
        try:
            content = json.loads(text)
            at = tuple(content.pop("at"))
            times = tuple(map(float, content.pop("times", ())))
            frame = content.pop("frame", {})
            if "via_at" in frame:
                frame["via_at"] = tuple(frame["via_at"])
            mirror = content.pop("mirror", "none")
            found = cls(at, times, FitOptions(**content.pop("fit", {})), FrameOptions(**frame), mirror)
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError, OverflowError) as error:
            raise InputError(_DAMAGED) from error
        numbers = [type(number) is int for number in at]
        if mirror == "auto" or mirror not in get_args(Mirror):
            raise InputError(_DAMAGED)
        if content or len(at) < 2 or not all(numbers) or at[0] != 0 or sorted(set(at)) != list(at):
            raise InputError(_DAMAGED)
        return found

    @classmethod
    def of_task(cls, task: Task, frames: Floats) -> Settings | None:
        """The settings of a task whose frames (F, n, 3) were made; None for a bake that keys and settings do not tell.

        That is one that a control needs, one of a half that is mirrored elsewhere than across coordinate planes, or one
        without a frame at each key.
        """
        keys = len(task.through) - 1
        at = np.searchsorted(task.times, KeyTimes.of(task.frame_options, keys).at - 1e-12)
        pairs = list(task.pairs.values())
        whole = len(at) == len(set(at.tolist())) and at[0] == 0 and at[-1] == len(frames) - 1
        mirror = _mirror_of(pairs[0].planes)
        if task.play is not None or mirror is None or not whole:
            return None
        along = zip(task.through, task.through[1:], strict=False)
        shapes = [pairs[0].own.key0] + [task.pairs[ends].own.key1 for ends in along]
        if not all(np.array_equal(frames[number], shape) for number, shape in zip(at, shapes, strict=True)):
            return None
        even = np.array_equal(task.times, usual_times(len(frames) - 1, keys, task.frame_options))
        numbers = tuple(int(number) for number in at)
        times = () if even else tuple(task.times.tolist())
        return cls(numbers, times, task.fit_options, task.frame_options, mirror)


def usual_times(count: int, pairs: int, options: FrameOptions) -> Floats:
    """(count + 1,) the times of as many in-betweens between every two keys, or evenly spaced ones."""
    each, left = divmod(count, pairs)
    return evenly_spaced(count - 1) if left else KeyTimes.of(options, pairs).between(each - 1)


def _mirror_of(planes: Sequence[MirrorPlane]) -> Mirror | None:
    """The axes of planes, in the order of their letters; None for planes that axes do not tell."""
    for mirror in get_args(Mirror):
        axes = [] if mirror in ("auto", "none") else ["xyz".index(letter) for letter in mirror]
        if mirror != "auto" and len(axes) == len(planes):
            expected = [MirrorPlane.across(axis, plane.reach) for axis, plane in zip(axes, planes, strict=True)]
            if list(planes) == expected:
                return cast(Mirror, mirror)
    return None
