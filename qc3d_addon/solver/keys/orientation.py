# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a second key is the first one mirrored or turned inside out, found out before any slow work."""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..errors import InputError
from ..numerics.grouped_sums import covariances_by_label, means_by_label, sums_by_label
from ..triangles.closed_volume import ClosedComponents
from ..triangles.geometry import areas
from ..triangles.topology import sides, unique_edges, vertex_components
from .keypair import KeyPair

# Of the surface: beyond this the keys as a whole are mirrored, below it only parts of them.
_MOST_SHARE = 0.5
# A part is a mirror image where this fits so much better than any turn, and turns leave so much, relative to its size.
_BETTER = 0.25
_LEFT_BY_TURNS = 0.1
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

    Closed components are told by the sign of the volume that they enclose. Others are told by what a rotation with
    scaling and what a reflection with scaling leave of them (Kabsch 1976): flat ones, whose mirror image a turn
    reaches, are never mirrored.
    """
    vertices, group = pair.welding
    keys = [_in_unit_size(key[vertices]) for key in (pair.key0, pair.key1)]
    faces = group[pair.faces]
    labels = vertex_components(unique_edges(sides(faces)), len(vertices))
    closed = ClosedComponents(faces, labels)
    first, second = (np.where(np.abs(found) > _LEAST_VOLUME, found, 0.0) for found in map(closed.volumes, keys))
    is_closed = np.zeros(len(first), dtype=bool)
    is_closed[labels[closed.faces[:, 0]]] = True
    mirrored = np.where(is_closed, first * second < 0.0, _are_mirror_images(keys[0], keys[1], labels))
    surface = areas(keys[0], faces)
    total = float(surface.sum())
    return float(surface[mirrored[labels[faces[:, 0]]]].sum()) / total if total > 0.0 else 0.0


def _in_unit_size(key: Floats) -> Floats:
    low, high = key.min(axis=0), key.max(axis=0)
    return np.asarray((key - low) / (high - low).max())


def _are_mirror_images(key0: Floats, key1: Floats, labels: Ints) -> Bools:
    """(components,) whether a reflection carries a component onto the other key, and no turn does."""
    spread = [key - means_by_label(labels, key)[labels] for key in (key0, key1)]
    sizes = [np.sqrt(sums_by_label(labels, (points**2).sum(axis=1))) for points in spread]
    scale = sizes[0] * sizes[1]
    usable = scale > 0.0
    covariances = covariances_by_label(labels, spread[1], spread[0])[usable] / scale[usable, None, None]
    left, kept, right = np.linalg.svd(covariances)
    is_odd = np.linalg.det(left) * np.linalg.det(right) < 0.0
    by_turn = _left_over(kept[:, 0] + kept[:, 1] - kept[:, 2])
    by_reflection = _left_over(kept.sum(axis=1))
    found = np.zeros(len(scale), dtype=bool)
    found[usable] = is_odd & (by_reflection < _BETTER * by_turn) & (by_turn > _LEFT_BY_TURNS)
    return found


def _left_over(kept: Floats) -> Floats:
    return np.asarray(np.sqrt(np.maximum(1.0 - kept**2, 0.0)))
