# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses the direction of parts that turn by about half a turn: the one with fewer collisions."""

from __future__ import annotations

import numpy as np

from ..arrays import Ints
from ..collision.self_crossings import CrossingLimit
from ..keys.embedding import Embedding
from ..numerics.grouped_sums import means_by_label
from ..settings import FitOptions
from ..surface.path import SurfacePath

_LOOKED_AT = (0.25, 0.5, 0.75)
_SWEEPS = 4
_AS_LONG = np.radians(10.0)  # from half a turn: both directions look equally long
_MOST_TRIED = 8  # parts; each costs three more shapes


def path_between(embedding: Embedding, options: FitOptions) -> SurfacePath:
    """The surface's path between the keys of a pair.

    A part that turns by about half a turn and collides with others is turned in the other direction if it collides less
    there: the page of a book turns over instead of passing through the covers.
    """

    def path(other_way: Ints) -> SurfacePath:
        return SurfacePath(embedding, options.stretch, options.extra_turns != 0, other_way)

    chosen = np.empty(0, dtype=np.int64)
    best = path(chosen)
    if not len(best.half_turned):
        return best
    limit = CrossingLimit(embedding.pair.welded_faces, embedding.key0, embedding.key1, best.still)
    excess, crossing = _crossings(limit, best)
    for part in crossing[:_MOST_TRIED].tolist():
        tried = path(np.append(chosen, part))
        found, _ = _crossings(limit, tried)
        if found < excess:
            best, excess, chosen = tried, found, np.append(chosen, part)
    return best


def _crossings(limit: CrossingLimit, path: SurfacePath) -> tuple[int, Ints]:
    """Number of new crossings of shapes on a path, and the half-turned parts that are involved in them."""
    shapes = path.shapes([(time, None) for time in _LOOKED_AT], _SWEEPS)
    involved = np.logical_or.reduce([limit.new_vertices(shape) for shape in shapes])
    parts = path.half_turned
    return sum(limit.excess(shape) or 0 for shape in shapes), parts[np.isin(parts, path.components[involved])]


def half_turned_parts(path: SurfacePath) -> int:
    """Number of parts that turn so nearly by half a turn that both directions are equally long; 1 if the whole does."""
    if np.linalg.norm(path.whole_turn) > np.pi - _AS_LONG:
        return 1
    owners = path.components[path.vertices[path.deformation.faces[:, 0]]]
    mean = np.linalg.norm(means_by_label(owners, path.turning.swing - path.rest, path.deformation.weights), axis=1)
    return int((np.abs(mean[path.half_turned] - np.pi) < _AS_LONG).sum())
