# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading FRAMES.npz, the file of ``qc3d interpolate``: frames, faces, how they were made, what they do not enter."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..solver.arrays import Floats, Ints
from ..solver.collision.colliders import Collider
from ..solver.errors import InputError
from ..solver.files.npz import Archive, open_archive
from ..solver.frames.bake_settings import Settings
from ..solver.frames.remade import Inputs
from ..solver.keys.files import polygon_labels
from ..solver.keys.keypair import KeyPair
from ..solver.support.memory import require_memory_for_frames

_MOST_SETTINGS = 20_000  # characters


class FrameFile(NamedTuple):
    """Frames (k, n, 3) of triangles (m, 3), the polygons of these (m,), and of the bake its settings and collider."""

    frames: Floats
    faces: Ints
    polygons: Ints | None
    settings: Settings | None
    collider: Collider | None


def holds(path: Path, name: str) -> bool:
    """Whether a file is an archive with an array of that name."""
    if path.suffix.lower() != ".npz":
        return False
    with open_archive(path, "an array of numbers is needed") as archive:
        return name in archive


def read_frame_file(path: Path) -> FrameFile:
    """Read a file of frames; raises InputError for anything else, and for frames that do not fit into memory."""
    with open_archive(path, "faces and frames are needed") as archive:
        header = archive.headers(("frames", "faces"))["frames"]
        if len(header.shape) != 3 or header.dtype.kind not in "fiu" or not header.rows:
            raise InputError(f"The frames in {path} must be numbers of the shape (k, n, 3).")
        require_memory_for_frames(*header.shape[:2])
        frames, faces = archive.read(("frames", "faces")).values()
        settings = _settings(archive, path, len(frames))
        labels, collider = _polygons(archive, faces), collider_in(archive)
    # Every frame is a key of a pair with the first, and checked as such.
    pairs = [KeyPair.checked(frames[0], frame, faces, polygons=labels) for frame in frames]
    polygons = None if labels is None else pairs[0].polygons
    return FrameFile(np.stack([pair.key1 for pair in pairs]), pairs[0].faces, polygons, settings, collider)


def read_inputs(path: Path) -> Inputs:
    """What the frames of a small file are made from: the first key, the triangles, and what else the file has of it."""
    with open_archive(path, "faces and key0 are needed") as archive:
        require_memory_for_frames(1, archive.headers(["key0"])["key0"].rows)
        first, faces = archive.read(("key0", "faces")).values()
        labels, collider = _polygons(archive, faces), collider_in(archive)
    pair = KeyPair.checked(first, first, faces, polygons=labels)
    return Inputs.of(pair.key0, pair.faces, None if labels is None else pair.polygons, collider)


def collider_in(archive: Archive) -> Collider | None:
    """What frames must not enter: ``collider`` (k, c, 3), at each key or at all, and ``collider_faces`` (f, 3)."""
    if "collider" not in archive:
        return None
    return Collider.checked(*archive.read(("collider", "collider_faces")).values())


def _polygons(archive: Archive, faces: Ints) -> Ints | None:
    if "polygons" not in archive:
        return None
    return polygon_labels(archive.read(["polygons"])["polygons"], faces)


def _settings(archive: Archive, path: Path, count: int) -> Settings | None:
    if "settings" not in archive:
        return None
    header = archive.headers(["settings"])["settings"]
    if header.shape != () or header.dtype.kind != "U" or header.dtype.itemsize > 4 * _MOST_SETTINGS:
        raise InputError(f"The settings in {path} are not those of a bake; leave that array out.")
    settings = Settings.of_text(str(archive.read(["settings"])["settings"][()]))
    if settings.at[-1] != count - 1:
        raise InputError(f"The settings in {path} belong to {settings.at[-1] + 1} frames; leave that array out.")
    return settings
