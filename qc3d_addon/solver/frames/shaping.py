# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of a pair at some times: solved, turned by extra turns, and as symmetric as the keys."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain

from ..arrays import Floats
from ..keys.embedding import Embedding
from ..support.threads import Item, Result, batches, in_threads
from ..surface.path import SWEEPS, SurfacePath
from .extra_turns import ExtraSpins
from .mirror_image import MirrorImages

_ONE_BY_ONE = 500_000  # vertices: each frame that is solved beside another takes half a kilobyte for each


@dataclass(frozen=True, eq=False)
class Shaping:
    """What is done with every shape of a surface, whatever its anchors.

    Parameters
    ----------
    embedding : Embedding
    spins : ExtraSpins
    mirror_images : MirrorImages
    """

    embedding: Embedding
    spins: ExtraSpins
    mirror_images: MirrorImages

    def shaped(
        self, surface: SurfacePath, moments: Sequence[tuple[float, Floats]], sweeps: int = SWEEPS
    ) -> list[Floats]:
        """(n, 3) cube positions of a surface at each time, drawn to the anchor given with it; extra turns are added."""
        return [
            self.symmetric(self.spins.apply(shape, time), time)
            for (time, _), shape in zip(moments, surface.shapes(moments, sweeps), strict=True)
        ]

    def symmetric(self, shape: Floats, time: float) -> Floats:
        """Cube positions (n, 3) as symmetric as the keys."""
        if not self.mirror_images:
            return shape
        embedding = self.embedding
        return embedding.to_cube(self.mirror_images.averaged(embedding.from_cube(shape, time), time), time)

    def all_shaped(self, surface: SurfacePath, moments: Sequence[tuple[float, Floats]]) -> list[Floats]:
        """The same for any number of times, a few together."""
        few = batches(moments, surface.shapes_at_once)
        return list(chain.from_iterable(self.side_by_side(partial(self.shaped, surface), few)))

    def side_by_side(self, work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """Results of the work on each item: in threads, or one by one where each takes very much memory."""
        return map(work, items) if len(self.embedding.key0) > _ONE_BY_ONE else in_threads(work, items)
