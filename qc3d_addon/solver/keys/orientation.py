# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Detects, before any slow work, a second key that is mirrored or turned inside out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..errors import InputError
from ..numerics.grouped_sums import covariances_by_label, means_by_label, sums_by_label
from ..triangles.closed_volume import AS_FULL, ClosedComponents
from ..triangles.geometry import areas, edge_lengths
from ..triangles.topology import sides, unique_edges, vertex_components
from .embedding import Embedding
from .keypair import KeyPair

# Share of the surface above which the key as a whole counts as mirrored, and not only some of its parts.
_MOST_SHARE = 0.5
# Volumes below these fractions of the cubed size may be nothing but rounding: the first decides about the share of the
# surface, the second about the parts that are counted in the report.
_LEAST_VOLUME, _LEAST_OF_A_PART = 1e-9, 1e-12
# Volumes over areas to the power of 3/2; a sphere has 0.094. What is flatter than that in a key has no inside there:
# rounding may decide about the sign.
_FLAT = 1e-4
# What passes through itself along straight lines, as a flat pyramid does through its base, is not turned inside out by
# that if no edge gets shorter or longer on the way than in both keys by more than this part of its length.
_PASSES = 0.1
_MOMENTS = 0.25, 0.5, 0.75


@dataclass(frozen=True)
class Reversal:
    """How much of a mesh cannot be carried from the first key to the second by a motion of the volume.

    Parameters
    ----------
    mirrored : float
        Share of the first key's surface, 0..1, in closed components that become mirror images or turn inside out.
    tangled : float
        Share of the surface, 0..1, in closed components whose signed volume changes its sign only because they cross
        themselves so much or become so flat.
    parts : int
        Number of mirrored components.
    where : str
        Which component that is, or the largest of several: how many vertices it has, and the number of one of them.
    """

    mirrored: float
    tangled: float
    parts: int
    where: str


def require_reachable(pair: KeyPair) -> Reversal:
    """Check that a motion of the volume can lead from the first key to the second; return what it cannot reach.

    Raises
    ------
    InputError
        If more than half of the surface is mirrored, turned inside out or tangled: no orientation-preserving map does
        that.
    """
    found = reversal(pair)
    if found.mirrored + found.tangled <= _MOST_SHARE:
        return found
    if pair.far_away is not None:
        raise InputError(pair.far_away)
    if found.mirrored >= found.tangled:
        raise InputError(
            f"The second key is mirrored or turned inside out{found.where}: no motion of a volume leads there. Choose "
            "the mode straight, which blends along straight lines, or mirror the second key back."
        )
    raise InputError(
        f"The second key crosses itself so far, or is so flat, that more of it faces inwards than outwards{found.where}"
        ": no motion of a volume leads there. Choose the mode straight, which blends along straight lines, or repair "
        "the key."
    )


def mirrored_share(pair: KeyPair) -> float:
    """Share of the first key's surface, 0..1, that is mirrored, turned inside out or tangled in the second key."""
    found = reversal(pair)
    return found.mirrored + found.tangled


def reversal(pair: KeyPair) -> Reversal:
    """Find what is mirrored, turned inside out or tangled, by the sign of each closed component's volume.

    Open components are never counted: they have no inside, and a leaf may well bend into its mirror image. Nor are
    those that can go straight, because they are so flat that this costs hardly any lengths.
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
    full = np.abs([closed.fullness(key) for key in keys])
    flips &= full.min(axis=0) > _FLAT
    if flips.any():
        flips &= ~_passing(pair, faces, labels)
    is_real = full[1] > AS_FULL * full[0]
    is_reversed = flips & (least > _LEAST_VOLUME)
    is_part = flips & (least > _LEAST_OF_A_PART)
    total = max(float(surface[0].sum()), 1e-300)
    mirrored, tangled = (float(surface[0] @ (is_reversed & chosen)) / total for chosen in (is_real, ~is_real))
    parts = np.flatnonzero(is_part & is_real) if mirrored >= tangled else np.flatnonzero(is_part & ~is_real)
    where = ""
    if len(parts) and count > 1:
        members = np.flatnonzero((labels == parts[np.argmax(surface[0, parts])])[group])
        most = " most of it" if len(parts) > 1 else ""
        where = f",{most} in the part of {len(members)} vertices to which vertex {members[0]} belongs"
    return Reversal(mirrored, tangled, int((is_part & is_real).sum()), where)


def _passing(pair: KeyPair, faces: Ints, labels: Ints) -> Bools:
    """(components,) which of them keep the lengths of their edges on straight lines.

    These are the lines between the keys without the motion of the whole, and without growth along the longest axis:
    what grows a lot while it is turned inside out stays between its lengths, too. ``faces`` (m, 3) and ``labels`` use
    one vertex of each group that coincides in both keys.
    """
    embedding, vertices, edges = Embedding.of(pair), pair.welding[0], unique_edges(sides(faces))
    key0, key1 = embedding.key0[vertices], embedding.key1[vertices]
    spread = [key - means_by_label(labels, key)[labels] for key in (key0, key1)]
    length = np.stack([np.linalg.eigvalsh(covariances_by_label(labels, each, each))[:, -1] for each in spread])
    key1 = key1 * np.sqrt(length[0] / np.maximum(length[1], 1e-300))[labels][:, None]
    ends = np.stack([edge_lengths(key, edges) for key in (key0, key1)])
    short, long = ends.min(axis=0), ends.max(axis=0)
    worst = np.zeros(int(labels.max()) + 1)
    for time in _MOMENTS:
        length = edge_lengths((1.0 - time) * key0 + time * key1, edges)
        beyond = np.maximum(short - length, length - long) / np.maximum(long, 1e-300)
        np.maximum.at(worst, labels[edges[:, 0]], beyond)
    return np.asarray(worst <= _PASSES)


def _in_unit_size(key: Floats) -> Floats:
    low, high = key.min(axis=0), key.max(axis=0)
    size = float((high - low).max())
    return np.asarray((key - low) / (size if size > 0.0 else 1.0))
