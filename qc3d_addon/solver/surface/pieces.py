# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pieces of a surface whose gradients are worked on at once: as much as the processor's cache can hold.

On small surfaces a piece is the whole surface, of several shapes, all coordinates in one sparse product, because calls
take longer than the numbers. On large ones it is a part of the triangles, because arrays of all of them would go
through memory again and again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_array, csr_array

from ..arrays import Floats, Ints
from ..numerics.assembly import gradient_operator, repeated

# A dozen arrays of this many triangles fit into the cache of one core.
TRIANGLES_IN_CACHE = 30_000
_TRIANGLES_OF_A_PIECE = 15_000
_COORDINATES = 3


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of a surface's triangles.

    Parameters
    ----------
    triangles : slice
        Which of the surface's m moving triangles.
    used : slice or (l,) int64
        The vertices at their corners, as positions among the surface's used vertices; distinct.
    gradient : (2p, l) sparse
        Takes values at the vertices to derivatives, ordered by direction and triangle.
    """

    triangles: slice
    used: slice | Ints
    gradient: csr_array
    _plain: dict[int, tuple[csr_array, csc_array]] = field(default_factory=dict)

    @property
    def hats(self) -> Floats:
        """(p, 3, 2) gradients of the hat functions of the triangles."""
        return self.gradient.data.reshape(2, -1, 3).transpose(1, 2, 0)

    def operator(self, shapes: slice, stretch: Sequence[Floats] | None = None) -> Operator:
        """The gradient operator for some of several shapes, multiplied by their stretches (m, 2, 2) each.

        Without stretches, of all these shapes as they are.
        """
        one, count = self.gradient, shapes.stop - shapes.start
        together = _COORDINATES if count * one.shape[0] * _COORDINATES <= 2 * TRIANGLES_IN_CACHE else 1
        if stretch is not None:
            # Shape by shape: einsum over several would round differently depending on their number.
            parts = (np.einsum("mcb,mbd->dcm", self.hats, part[self.triangles]) for part in stretch[shapes])
            values = np.concatenate([part.transpose(0, 2, 1).ravel() for part in parts])
            gradient = repeated(one, together * count, np.tile(values, together))
            matrices = gradient, gradient.T
        elif count not in self._plain:
            gradient = repeated(one, together * count)
            matrices = gradient, gradient.T
            if together > 1:  # on large surfaces they would take more memory than time
                self._plain[count] = matrices
        else:
            matrices = self._plain[count]
        return Operator(shapes, self.triangles, self.used, *matrices, together)


class Operator(NamedTuple):
    """Takes positions to gradients on a piece, and back.

    ``gradient`` takes one coordinate, or all, of some shapes to their derivatives; ``spread`` is its transpose.
    """

    shapes: slice
    triangles: slice
    used: slice | Ints
    gradient: csr_array
    spread: csc_array
    together: int

    def gradients(self, positions: Floats) -> Floats:
        """(3, 2, q, p) gradients for positions (3, q', l') of all used vertices in all shapes.

        In memory, the shape comes before the direction.
        """
        part = positions[:, self.shapes][:, :, self.used]
        found = [self.gradient @ row for row in part.reshape(_COORDINATES // self.together, -1)]
        derivatives = found[0] if len(found) == 1 else np.stack(found)
        return np.asarray(derivatives.reshape(_COORDINATES, part.shape[1], 2, -1).transpose(0, 2, 1, 3))

    def add_spread(self, vectors: Floats, load: Floats) -> None:
        """Add to the load (3, q', l') what vectors (3, 2, q, p) on the triangles give their corners."""
        rows = vectors.transpose(0, 2, 1, 3).reshape(_COORDINATES // self.together, -1)
        for first, row in zip(range(0, _COORDINATES, self.together), rows, strict=True):
            concerned = load[first : first + self.together, self.shapes]
            concerned[:, :, self.used] += (self.spread @ row).reshape(*concerned.shape[:2], -1)


def pieces_of(faces: Ints, hats: Floats, count: int) -> list[Piece]:
    """The pieces of triangles (m, 3), whose corners are among ``count`` vertices, with the hat gradients (m, 3, 2)."""
    if len(faces) <= TRIANGLES_IN_CACHE:
        return [Piece(slice(0, len(faces)), slice(0, count), gradient_operator(faces, hats, count))]
    pieces = []
    for start in range(0, len(faces), _TRIANGLES_OF_A_PIECE):
        part = slice(start, min(start + _TRIANGLES_OF_A_PIECE, len(faces)))
        used, corners = np.unique(faces[part], return_inverse=True)
        gradient = gradient_operator(corners.reshape(-1, 3).astype(np.int64), hats[part], len(used))
        pieces.append(Piece(part, used, gradient))
    return pieces
