# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of a bake as a small file that holds no frames: the later keys, the settings, and what baking again misses.

The reader bakes again. That takes as long as the bake did, and gives the same frames only where the same version of
QC3D runs on similar libraries; a sum over the frames tells whether it did.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Generator
from dataclasses import asdict, dataclass, field
from typing import Any, TypeVar

import numpy as np

from ..arrays import Floats, Ints
from ..compression.compact import Packed, Remaking, from_bytes, space_of, to_bytes
from ..compression.fields import Space, check_of
from ..compression.files import Source
from ..compression.integers import inflated_at_most
from ..compression.pack import Small, Work, diagonal_of, errors_of, small_frames, unpacked
from ..compression.smallest import Wanted, smallest
from ..errors import InputError, QC3DError
from ..settings import FitOptions, FrameOptions
from ..support.memory import machine_limit_mb
from ..support.progress import Steps, told
from .bake import evenly_spaced
from .key_times import KeyTimes
from .task import Task, carry_out

T = TypeVar("T")

_SHARE = 0.9  # of the error, for the keys: frames between them may miss a little more than they do
_TOLERANCE = 0.02  # of the error, between the frames that were made again here and there
_TIDY = 0.05  # of the error: what is less is meant to be nothing
_MOST_KEYS, _MOST_FRAMES, _MOST_SECONDS = 64, 10_000, 600.0  # a reader can be made to bake so much
_MOST_TEXT = 20_000
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
    """

    at: tuple[int, ...]
    times: tuple[float, ...] = ()
    fit_options: FitOptions = field(default_factory=FitOptions)
    frame_options: FrameOptions = field(default_factory=FrameOptions)

    @property
    def text(self) -> str:
        """All of it as JSON, without what is as by default."""
        content: dict[str, Any] = {"at": self.at}
        if self.times:
            content["times"] = self.times
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
            found = cls(at, times, FitOptions(**content.pop("fit", {})), FrameOptions(**frame))
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError, OverflowError) as error:
            raise InputError(_DAMAGED) from error
        numbers = [type(number) is int for number in at]
        if content or len(at) < 2 or not all(numbers) or at[0] != 0 or sorted(set(at)) != list(at):
            raise InputError(_DAMAGED)
        return found

    @classmethod
    def of_task(cls, task: Task, frames: Floats) -> Settings | None:
        """The settings of a task whose frames (F, n, 3) were made; None for a bake that keys and settings do not tell.

        That is one of a mirrored half, with colliders, or without a frame at each key.
        """
        keys = len(task.through) - 1
        at = np.searchsorted(task.times, KeyTimes.of(task.frame_options, keys).at - 1e-12)
        pairs = list(task.pairs.values())
        whole = len(at) == len(set(at.tolist())) and at[0] == 0 and at[-1] == len(frames) - 1
        if task.collider is not None or task.play is not None or any(pair.planes for pair in pairs) or not whole:
            return None
        shapes = [pairs[0].key0] + [task.pairs[ends].key1 for ends in zip(task.through, task.through[1:], strict=False)]
        if not all(np.array_equal(frames[number], shape) for number, shape in zip(at, shapes, strict=True)):
            return None
        even = np.array_equal(task.times, _usual_times(len(frames) - 1, keys, task.frame_options))
        numbers = tuple(int(number) for number in at)
        return cls(numbers, () if even else tuple(task.times.tolist()), task.fit_options, task.frame_options)


def remade(source: Source, keys: Floats, settings: Settings, polygons: Ints | None, count: int) -> Steps[Floats]:
    """Bake again: (count, n, 3) the frames after the first.

    Parameters
    ----------
    source : Source
        The first key and the triangles.
    keys : (k, n, 3)
        The later keys.
    polygons : (m,), optional
        The polygon of each triangle; without them each is one of its own.

    Raises
    ------
    QC3DError
        If the settings do not fit the keys, or the bake needs too much memory or cannot be made.
    """
    limit = settings.fit_options.mesh_time_limit
    if len(settings.at) > _MOST_KEYS + 1 or count > _MOST_FRAMES or limit > _MOST_SECONDS:
        raise InputError("These are more frames or keys than are baked again; compress them by the scheme stored.")
    if settings.at[-1] != count or len(settings.at) != len(keys) + 1 or len(settings.times) not in (0, count + 1):
        raise InputError(_DAMAGED)
    names = tuple(str(number) for number in range(len(settings.at)))
    shapes = dict(zip(names, [source.points, *keys], strict=True))
    task = Task.of_keys(
        shapes,
        source.cells,
        None,
        names,
        settings.fit_options,
        settings.frame_options,
        settings.times or _usual_times(count, len(keys), settings.frame_options),
        polygons=np.arange(len(source.cells)) if polygons is None else polygons,
        mirror="none",
    )
    task.require_memory(machine_limit_mb())
    bake = (yield from carry_out(task)).bake
    assert bake is not None
    return bake.frames[1:]


def _usual_times(count: int, pairs: int, options: FrameOptions) -> Floats:
    """(count + 1,) the times of as many in-betweens between every two keys, or evenly spaced ones."""
    each, left = divmod(count, pairs)
    return evenly_spaced(count - 1) if left else KeyTimes.of(options, pairs).between(each - 1)


def small_bake(frames: Floats, faces: Ints, error: float, settings: Settings, polygons: Ints | None = None) -> Work:
    """The smallest file of a bake's frames (F, n, 3), made again or not; see ``compression.pack.small_frames``."""
    source = Source("frames", frames[0], faces)
    stored = yield from _told(small_frames(frames, faces, error), 0.0, 0.2)
    try:
        found = yield from _told(_made_again(source, frames, error, settings, polygons), 0.2, 0.8)
    except QC3DError:
        return stored  # such as keys that rounding has made unusable
    return min((found, stored), key=lambda small: len(small.data))


def restored(data: bytes, source: Source, polygons: Ints | None) -> Steps[Floats]:
    """(F, n, 3) the frames after the first that a file holds, made again where they have to be.

    Raises
    ------
    InputError
        If the data is damaged or of another mesh, or if this machine makes other frames.
    QC3DError
        As the bake.
    """
    packed, space = from_bytes(data, source, _MOST_KEYS)
    if packed.remaking is None:
        return unpacked(data, source)
    remaking = packed.remaking
    text, is_polygonal = inflated_at_most(remaking.settings[1:], _MOST_TEXT), remaking.settings[:1] == b"\1"
    if is_polygonal and polygons is None:
        raise InputError("These frames were made with the mesh's polygons; give a file that has the array 'polygons'.")
    settings = Settings.of_text(text)
    keys = _tidied(source, space, remaking.keys.displacements(space), remaking.error)
    frames = yield from remade(source, keys, settings, polygons if is_polygonal else None, packed.count)
    unit = diagonal_of(source.points)
    if not abs(check_of(frames) - remaking.check) <= _tolerance(remaking.error, unit, remaking.check):
        raise InputError(
            "The frames come out differently than where they were compressed: the file was made by another version of "
            "QC3D or with other libraries; compress the frames there with the scheme stored."
        )
    return np.asarray(frames + packed.field.displacements(space))


def _made_again(source: Source, frames: Floats, error: float, settings: Settings, polygons: Ints | None) -> Work:
    """A file of keys and what baking again with them misses; its way is ``remade`` where that is nothing."""
    space, unit = space_of(source, "fixed"), diagonal_of(source.points)
    moved = frames[list(settings.at[1:])] - source.points
    told_keys = yield from _told(smallest(Wanted(space, moved, unit, _SHARE * error)), 0.0, 0.1)
    keys = _tidied(source, space, told_keys.displacements(space), error)
    baking = told(remade(source, keys, settings, polygons, len(frames) - 1), lambda step: step.overall)
    made = yield from _told(baking, 0.1, 0.8)
    missed = frames[1:] - made
    rest = yield from _told(smallest(Wanted(space, missed, unit, error)), 0.9, 0.1)
    remaking = Remaking(packed_settings(settings, polygons), told_keys, error, check_of(made))
    data = to_bytes(source, space, Packed("frames", "sliding", len(missed), rest, None, remaking))
    back = np.asarray(made + rest.displacements(space))
    way = "remade with a remainder" if rest.part.step else "remade"
    return Small(data, way, back, errors_of(back, frames[1:], unit))


def packed_settings(settings: Settings, polygons: Ints | None) -> bytes:
    """Settings as bytes, and whether there are polygons."""
    return bytes([polygons is not None]) + zlib.compress(settings.text.encode(), 9)


def _tidied(source: Source, space: Space, displacements: Floats, error: float) -> Floats:
    """(k, n, 3) the keys with displacements like these: what hardly moves stays, what hardly parts stays together."""
    nothing = _TIDY * error * diagonal_of(source.points)
    _, first, group = np.unique(source.points, axis=0, return_index=True, return_inverse=True)
    leading = displacements[:, first[group.ravel()]]
    together = (np.abs(displacements - leading) <= nothing).all(axis=2, keepdims=True)
    joined = np.where(together, leading, displacements)
    still = (np.abs(joined) <= nothing).all(axis=2, keepdims=True)
    return np.asarray(source.points + np.where(still, 0.0, joined))


def _tolerance(error: float, unit: float, check: float) -> float:
    return max(_TOLERANCE * error * unit, 1e-6 * abs(check))


def _told(work: Generator[float, None, T], start: float, share: float) -> Generator[float, None, T]:
    """The same work as a share of the whole that begins at ``start``."""
    return (yield from told(work, lambda done: start + share * done))
