# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a second key is the first one mirrored or turned inside out, found out before any slow work."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..errors import InputError
from ..triangles.closed_volume import ClosedComponents
from ..triangles.geometry import areas
from ..triangles.topology import sides, unique_edges, vertex_components
from .keypair import KeyPair

# Of the surface: beyond this the keys as a whole are mirrored, below it only parts of them.
_MOST_SHARE = 0.5
# Volumes below this part of the size cubed are none.
_LEAST_VOLUME = 1e-9


def require_reachable(pair: KeyPair) -> None:
    """Check that a motion of the volume can lead from the first key to the second.

    Raises
    ------
    InputError
        If more than half of the surface is mirrored or turned inside out: no map that keeps orientation does that.
    """
    if mirrored_share(pair) > _MOST_SHARE:
        raise InputError(
            "The second key is mirrored or turned inside out: no motion of a volume leads there. Choose the mode "
            "straight, which blends along straight lines, or mirror the second key back."
        )


def mirrored_share(pair: KeyPair) -> float:
    """The part of the first key's surface, 0..1, whose components are mirrored or turned inside out in the second.

    Told by the sign of the volume that a closed component encloses. What is open has no inside that could be turned
    out: a leaf may bend to its mirror image.
    """
    vertices, group = pair.welding
    keys = [_in_unit_size(key[vertices]) for key in (pair.key0, pair.key1)]
    faces = group[pair.faces]
    labels = vertex_components(unique_edges(sides(faces)), len(vertices))
    closed = ClosedComponents(faces, labels)
    first, second = (np.where(np.abs(found) > _LEAST_VOLUME, found, 0.0) for found in map(closed.volumes, keys))
    mirrored = first * second < 0.0
    surface = areas(keys[0], faces)
    total = float(surface.sum())
    return float(surface[mirrored[labels[faces[:, 0]]]].sum()) / total if total > 0.0 else 0.0


def _in_unit_size(key: Floats) -> Floats:
    low, high = key.min(axis=0), key.max(axis=0)
    size = float((high - low).max())
    return np.asarray((key - low) / (size if size > 0.0 else 1.0))
