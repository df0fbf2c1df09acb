# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a second key is the first one mirrored or turned inside out, found out before any slow work."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..errors import InputError
from ..numerics.grouped_sums import sums_by_label
from ..triangles.closed_volume import ClosedComponents
from ..triangles.geometry import areas
from ..triangles.topology import sides, unique_edges, vertex_components
from .keypair import KeyPair

# Of the surface: beyond this the keys as a whole are mirrored, below it only parts of them.
_MOST_SHARE = 0.5
# Volumes below this part of the size cubed are none; parts that are as small as the second are named all the same.
_LEAST_VOLUME, _LEAST_OF_A_PART = 1e-9, 1e-12
# What is turned inside out holds, for its surface, at least this part of the volume that it held before: what crosses
# itself all over or is flattened holds next to none, on whichever side.
_AS_FULL = 0.3


@dataclass(frozen=True)
class Reversal:
    """How much of a mesh no motion of a volume carries from the first key to the second.

    Parameters
    ----------
    mirrored : float
        Of the first key's surface, 0..1: closed components that are mirror images or turned inside out.
    tangled : float
        The same for closed components that cross themselves so far, or are so flat, that their signed volume has the
        other sign.
    parts : int
        How many components are mirrored.
    """

    mirrored: float
    tangled: float
    parts: int


def require_reachable(pair: KeyPair) -> Reversal:
    """Check that a motion of the volume can lead from the first key to the second; returns what it does not reach.

    Raises
    ------
    InputError
        If more than half of the surface is mirrored, turned inside out or tangled: no map that keeps orientation does
        that.
    """
    found = reversal(pair)
    if found.mirrored + found.tangled <= _MOST_SHARE:
        return found
    if pair.far_away is not None:
        raise InputError(pair.far_away)
    if found.mirrored >= found.tangled:
        raise InputError(
            "The second key is mirrored or turned inside out: no motion of a volume leads there. Choose the mode "
            "straight, which blends along straight lines, or mirror the second key back."
        )
    raise InputError(
        "The second key crosses itself so far, or is so flat, that more of it faces inwards than outwards: no motion "
        "of a volume leads there. Choose the mode straight, which blends along straight lines, or repair the key."
    )


def mirrored_share(pair: KeyPair) -> float:
    """The part of the first key's surface, 0..1, that is mirrored, turned inside out or tangled in the second."""
    found = reversal(pair)
    return found.mirrored + found.tangled


def reversal(pair: KeyPair) -> Reversal:
    """What is mirrored, turned inside out or tangled between the keys.

    Told by the sign of the volume that a closed component encloses. What is open has no inside that could be turned
    out: a leaf may bend to its mirror image.
    """
    vertices, group = pair.welding
    keys = [_in_unit_size(key[vertices]) for key in (pair.key0, pair.key1)]
    faces = group[pair.faces]
    labels = vertex_components(unique_edges(sides(faces)), len(vertices))
    closed = ClosedComponents(faces, labels)
    volumes = np.stack([closed.volumes(key) for key in keys])
    count = volumes.shape[1]
    flips, least = volumes[0] * volumes[1] < 0.0, np.abs(volumes).min(axis=0)
    surface = np.stack([sums_by_label(labels[faces[:, 0]], areas(key, faces)[:, None], count)[:, 0] for key in keys])
    full = np.abs(volumes) / np.maximum(surface, 1e-100) ** 1.5
    is_real = full[1] > _AS_FULL * full[0]
    is_reversed = flips & (least > _LEAST_VOLUME)
    is_part = flips & (least > _LEAST_OF_A_PART)
    total = max(float(surface[0].sum()), 1e-300)
    mirrored, tangled = (float(surface[0] @ (is_reversed & chosen)) / total for chosen in (is_real, ~is_real))
    return Reversal(mirrored, tangled, int((is_part & is_real).sum()))


def _in_unit_size(key: Floats) -> Floats:
    low, high = key.min(axis=0), key.max(axis=0)
    size = float((high - low).max())
    return np.asarray((key - low) / (size if size > 0.0 else 1.0))
