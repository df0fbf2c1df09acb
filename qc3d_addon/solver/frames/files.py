# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing frames to .npz files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..arrays import Floats
from ..collision.colliders import Collider
from ..files.npz import write_arrays
from ..keys.keypair import KeyPair


def write_frames(
    path: Path,
    pairs: Sequence[KeyPair],
    times: Floats,
    frames: Floats,
    settings: str = "",
    collider: Collider | None = None,
) -> None:
    """Write frames (k, n, 3) at ``times`` (k,) with the faces, the first and the last key of the pairs, compressed.

    With the ``settings`` of the bake, its ``collider``, and the polygons of the triangles where some have several, the
    frames can be made again; see ``frames.remade``.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    own = [pair.own for pair in pairs]
    ends = {"key0": own[0].key0, "key1": own[-1].key1}
    arrays = {"faces": own[0].faces, "frames": frames, "times": times, **ends}
    if settings:
        arrays["settings"] = np.array(settings)
        if len(np.unique(own[0].polygons)) < len(own[0].faces):
            arrays["polygons"] = own[0].polygons
        if collider is not None:
            arrays |= {"collider": collider.shapes, "collider_faces": collider.faces}
    write_arrays(path, arrays)
