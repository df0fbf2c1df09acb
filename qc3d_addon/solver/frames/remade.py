# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of a bake as a small file that holds no frames: the later keys, the settings, and what baking again misses.

The reader bakes again. That takes as long as the bake did, and gives the same frames only where the same version of
QC3D runs on similar libraries; a sum over the frames tells whether it did.
"""

from __future__ import annotations

import zlib
from collections.abc import Generator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from ..arrays import Floats, Ints
from ..collision.colliders import Collider
from ..compression.compact import Packed, Remaking, from_bytes, space_of, to_bytes
from ..compression.fields import check_of
from ..compression.files import Source
from ..compression.integers import inflated_at_most
from ..compression.pack import Small, Work, diagonal_of, errors_of, small_frames, unpacked
from ..compression.smallest import Wanted, smallest
from ..errors import InputError, QC3DError
from ..keys.halves import mirror_planes
from ..settings import Mirror
from ..support.memory import machine_limit_mb
from ..support.progress import Steps, told
from .bake_settings import Settings, usual_times
from .task import Task, carry_out

T = TypeVar("T")

_SHARE = 0.9  # of the error, for the keys: frames between them may miss a little more than they do
_TOLERANCE = 0.02  # of the error, between the frames that were made again here and there
_TIDY = 0.05  # of the error: what is less is meant to be nothing
_SEAM = 4.0  # of the error: what is less far from the seam, and on it in the first key, is meant to be on it
_HAS_POLYGONS, _HAS_COLLIDER = 1, 2
_MOST_KEYS, _MOST_FRAMES, _MOST_SECONDS = 64, 10_000, 600.0  # a reader can be made to bake so much
_MOST_TEXT = 20_000
_DAMAGED = "The settings of the frames make no sense; the file is damaged."


@dataclass(frozen=True, eq=False)
class Inputs:
    """What the reader of a file has.

    Parameters
    ----------
    source : Source
        The first key and the triangles.
    polygons : (m,), optional
        The polygon of each triangle; without them each is one of its own.
    collider : Collider, optional
        What the frames do not enter.
    """

    source: Source
    polygons: Ints | None = None
    collider: Collider | None = None

    @classmethod
    def of(
        cls, first: Floats, faces: Ints, polygons: Ints | None = None, collider: Collider | None = None
    ) -> Inputs:
        """From the first key (n, 3) and the triangles (m, 3)."""
        return cls(Source("frames", first, faces), polygons, collider)


def remade(inputs: Inputs, keys: Floats, settings: Settings, count: int) -> Steps[Floats]:
    """Bake again: (count, n, 3) the frames after the first.

    Parameters
    ----------
    inputs : Inputs
    keys : (k, n, 3)
        The later keys.

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
    names, source = tuple(str(number) for number in range(len(settings.at))), inputs.source
    shapes = dict(zip(names, [source.points, *keys], strict=True))
    task = Task.of_keys(
        shapes,
        source.cells,
        None,
        names,
        settings.fit_options,
        settings.frame_options,
        settings.times or usual_times(count, len(keys), settings.frame_options),
        inputs.collider,
        np.arange(len(source.cells)) if inputs.polygons is None else inputs.polygons,
        settings.mirror,
    )
    task.require_memory(machine_limit_mb())
    bake = (yield from carry_out(task)).bake
    assert bake is not None
    return bake.frames[1:]


def small_bake(
    frames: Floats,
    faces: Ints,
    error: float,
    settings: Settings,
    polygons: Ints | None = None,
    collider: Collider | None = None,
) -> Work:
    """The smallest file of a bake's frames (F, n, 3), made again or not; see ``compression.pack.small_frames``.

    Its reader needs the same ``Inputs``.
    """
    inputs = Inputs.of(frames[0], faces, polygons, collider)
    stored = yield from _told(small_frames(frames, faces, error), 0.0, 0.2)
    try:
        found = yield from _told(_made_again(inputs, frames, error, settings), 0.2, 0.8)
    except QC3DError:
        return stored  # such as keys that rounding has made unusable
    return min((found, stored), key=lambda small: len(small.data))


def restored(data: bytes, inputs: Inputs) -> Steps[Floats]:
    """(F, n, 3) the frames after the first that a file holds, made again where they have to be.

    Raises
    ------
    InputError
        If the data is damaged or of another mesh, if inputs are missing, or if this machine makes other frames.
    QC3DError
        As the bake.
    """
    source = inputs.source
    packed, space = from_bytes(data, source, _MOST_KEYS)
    if packed.remaking is None:
        return unpacked(data, source)
    remaking = packed.remaking
    text, flags = inflated_at_most(remaking.settings[1:], _MOST_TEXT), remaking.settings[:1]
    if not flags or flags[0] > _HAS_POLYGONS | _HAS_COLLIDER:
        raise InputError(_DAMAGED)
    has_polygons, has_collider = (bool(flags[0] & flag) for flag in (_HAS_POLYGONS, _HAS_COLLIDER))
    if has_polygons and inputs.polygons is None:
        raise InputError("These frames were made with the mesh's polygons; give a file that has the array 'polygons'.")
    if has_collider and inputs.collider is None:
        raise InputError(
            "These frames were made with a collider; give a file that has the arrays 'collider' and 'collider_faces'."
        )
    settings = Settings.of_text(text)
    keys = _tidied(source, settings.mirror, remaking.keys.displacements(space), remaking.error)
    polygons, collider = inputs.polygons if has_polygons else None, inputs.collider if has_collider else None
    frames = yield from remade(Inputs(source, polygons, collider), keys, settings, packed.count)
    unit = diagonal_of(source.points)
    if not abs(check_of(frames) - remaking.check) <= _tolerance(remaking.error, unit, remaking.check):
        raise InputError(
            "The frames come out differently than where they were compressed: the file was made by another version of "
            "QC3D or with other libraries; compress the frames there with the scheme stored."
        )
    return np.asarray(frames + packed.field.displacements(space))


def _made_again(inputs: Inputs, frames: Floats, error: float, settings: Settings) -> Work:
    """A file of keys and what baking again with them misses; its way is ``remade`` where that is nothing."""
    source = inputs.source
    space, unit = space_of(source, "fixed"), diagonal_of(source.points)
    moved = frames[list(settings.at[1:])] - source.points
    told_keys = yield from _told(smallest(Wanted(space, moved, unit, _SHARE * error)), 0.0, 0.1)
    keys = _tidied(source, settings.mirror, told_keys.displacements(space), error)
    baking = told(remade(inputs, keys, settings, len(frames) - 1), lambda step: step.overall)
    made = yield from _told(baking, 0.1, 0.8)
    missed = frames[1:] - made
    rest = yield from _told(smallest(Wanted(space, missed, unit, error)), 0.9, 0.1)
    remaking = Remaking(packed_settings(settings, inputs), told_keys, error, check_of(made))
    data = to_bytes(source, space, Packed("frames", "sliding", len(missed), rest, None, remaking))
    back = np.asarray(made + rest.displacements(space))
    way = "remade with a remainder" if rest.part.step else "remade"
    return Small(data, way, back, errors_of(back, frames[1:], unit))


def packed_settings(settings: Settings, inputs: Inputs) -> bytes:
    """Settings as bytes, and which inputs there are."""
    flags = _HAS_POLYGONS * (inputs.polygons is not None) | _HAS_COLLIDER * (inputs.collider is not None)
    return bytes([flags]) + zlib.compress(settings.text.encode(), 9)


def _tidied(source: Source, mirror: Mirror, displacements: Floats, error: float) -> Floats:
    """(k, n, 3) the keys with displacements like these.

    What hardly moves stays, what hardly parts stays together, and what hardly leaves the seam of a half stays on it.
    """
    nothing = _TIDY * error * diagonal_of(source.points)
    _, first, group = np.unique(source.points, axis=0, return_index=True, return_inverse=True)
    leading = displacements[:, first[group.ravel()]]
    together = (np.abs(displacements - leading) <= nothing).all(axis=2, keepdims=True)
    joined = np.where(together, leading, displacements)
    still = (np.abs(joined) <= nothing).all(axis=2, keepdims=True)
    keys = np.asarray(source.points + np.where(still, 0.0, joined))
    seam = _SEAM * error * diagonal_of(source.points)
    for plane in mirror_planes(mirror, {"first": source.points}, source.cells):
        on_seam = np.abs(plane.heights(source.points)) <= plane.reach
        heights = plane.heights(keys.reshape(-1, 3)).reshape(keys.shape[:2])
        on_seam &= (np.abs(heights) <= seam).all(axis=0)
        for key, height in zip(keys, heights, strict=True):
            key[on_seam] = plane.raised(key[on_seam], -height[on_seam])
    return keys


def _tolerance(error: float, unit: float, check: float) -> float:
    return max(_TOLERANCE * error * unit, 1e-6 * abs(check))


def _told(work: Generator[float, None, T], start: float, share: float) -> Generator[float, None, T]:
    """The same work as a share of the whole that begins at ``start``."""
    return (yield from told(work, lambda done: start + share * done))
