# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves loose pieces, such as leaves, stones or buttons, aside where they would collide on their way.

In a straight blend, turning pieces shrink and miss each other; pieces that keep their size may collide.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..collision.self_crossings import CrossingLimit
from ..numerics.grouped_sums import means_by_label, sums_by_label
from ..triangles.geometry import areas, face_normals

# Largest number of iterations, and of successive iterations without fewer crossings.
_ROUNDS, _PATIENCE = 24, 4
# Share of the surface; a component with more is the body that the pieces belong to.
_LARGEST_PIECE = 0.25
# Largest displacement of a piece, relative to its size.
_FARTHEST = 0.25
# Over-relaxation: factor on the displacement in the first iteration, and its increase in each further one.
_MORE, _MORE_AGAIN = 1.2, 0.4
# Displacements vanish at the keys. A crossing near a key may enlarge the one in the middle by at most this factor.
_MOST_WIDENED = 4.0


class LoosePieces:
    """The connected components of a surface that may move aside.

    Parameters
    ----------
    key0 : (n, 3)
    faces : (m, 3) int64
    components : (n,) int64
        Labels of the connected components.
    still : (n,) bool
        Still vertices; components that have one do not move aside.
    """

    def __init__(self, key0: Floats, faces: Ints, components: Ints, still: Bools) -> None:
        self._faces, self._labels = faces, components
        count = int(components.max(initial=-1)) + 1
        surface = sums_by_label(components[faces[:, 0]], areas(key0, faces), count) if len(faces) else np.zeros(count)
        self._free = np.bincount(components, weights=still, minlength=count) == 0
        self._free &= surface < _LARGEST_PIECE * surface.sum()
        self._sizes = np.zeros(count)
        spread = key0 - means_by_label(components, key0, count=count)[components]
        np.maximum.at(self._sizes, components, 2.0 * np.linalg.norm(spread, axis=1))

    def apart(
        self, limit: CrossingLimit, times: Floats, shapes: list[Floats], excess: list[int | None]
    ) -> tuple[list[Floats], list[int | None]]:
        """Shapes (n, 3) at ``times`` (k,) with fewer crossings, and the number of new crossings that each still has.

        Each piece keeps its shape and is displaced in one direction by an amount proportional to t (1 - t).
        """
        if not self._free.any() or not any(excess):
            return shapes, excess
        width = 4.0 * times * (1.0 - times)
        steps = np.zeros((len(self._sizes), 3))
        best, left = shapes, excess
        tried = shapes
        patience = _PATIENCE
        for number in range(_ROUNDS):
            wanted = (_MORE + number * _MORE_AGAIN) * self._wanted(limit, width, tried)
            if not wanted.any() or not patience:
                break
            steps = steps + wanted
            length = np.maximum(np.linalg.norm(steps, axis=1), 1e-300)
            steps *= np.minimum(1.0, _FARTHEST * self._sizes / length)[:, None]
            tried = [shape + part * steps[self._labels] for shape, part in zip(shapes, width.tolist(), strict=True)]
            found = [limit.excess(shape) for shape in tried]
            patience -= 1
            if CrossingLimit.left(found) < CrossingLimit.left(left):
                best, left, patience = tried, found, _PATIENCE
        return best, left

    def _wanted(self, limit: CrossingLimit, width: Floats, shapes: Sequence[Floats]) -> Floats:
        """(components, 3) further displacement of each piece: the largest that any of the shapes needs."""
        wanted = np.zeros((len(self._sizes), 3))
        for shape, part in zip(shapes, width.tolist(), strict=True):
            pairs = limit.new_pairs(shape) if part > 0.0 else np.empty((0, 2), dtype=np.int64)
            if len(pairs):
                asked = self._asked(shape, pairs) * min(1.0 / part, _MOST_WIDENED)
                wider = np.linalg.norm(asked, axis=1) > np.linalg.norm(wanted, axis=1)
                wanted[wider] = asked[wider]
        return wanted

    def _asked(self, shape: Floats, pairs: Ints) -> Floats:
        """(components, 3) displacements that separate crossing triangles (k, 2), the shortest out of their planes."""
        sides = [self._out_of_plane(shape, first, second) for first, second in (pairs.T, pairs.T[::-1])]
        shorter = np.linalg.norm(sides[0], axis=1) <= np.linalg.norm(sides[1], axis=1)
        apart = np.where(shorter[:, None], sides[0], -sides[1])
        pieces = self._labels[self._faces[pairs, 0]]
        # Out of the plane plus away from the other's center: the first alone fails at edges, the second at long sides.
        middles = means_by_label(self._labels, shape, count=len(self._sizes))
        away = middles[pieces[:, 0]] - middles[pieces[:, 1]]
        away /= np.maximum(np.linalg.norm(away, axis=1), 1e-300)[:, None]
        apart += np.linalg.norm(apart, axis=1)[:, None] * away
        moves = self._free[pieces]
        share = moves / np.maximum(moves.sum(axis=1, keepdims=True), 1)
        labels = pieces.T.ravel()
        steps = np.concatenate([share[:, :1] * apart, -share[:, 1:] * apart])
        # A piece with several crossings gets their mean displacement, weighted by length.
        lengths = np.linalg.norm(steps, axis=1)
        return means_by_label(labels, steps, lengths, len(self._sizes))

    def _out_of_plane(self, shape: Floats, first: Ints, second: Ints) -> Floats:
        """(k, 3) shortest displacements of the ``first`` triangles (k,) to one side of the planes of the ``second``."""
        normals = face_normals(shape, self._faces[second])
        normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
        corners = shape[self._faces[first]] - shape[self._faces[second][:, :1]]
        heights = np.einsum("kij,kj->ki", corners, normals)
        up, down = -heights.min(axis=1), heights.max(axis=1)
        moves: Floats = np.where(up < down, up, -down)[:, None] * normals
        return moves
