# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The report of a bake."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from ..arrays import Floats
from ..fit.fitted_map import Residual
from ..keys.halves import on_plane
from ..keys.keypair import KeyPair

T = TypeVar("T")


@dataclass(frozen=True)
class Certificate:
    """The certificate of one frame's map, which has no folds exactly if all determinants of its Jacobians are positive.

    Parameters
    ----------
    time : float
        Time of the frame within its pair of keys, 0..1.
    folds : int
        Number of tetrahedra that the frame's map inverts or flattens.
    smallest_determinant : float
        Smallest determinant of the map's Jacobians.
    place : list of float
        Where that is: x, y, z in the keys' coordinates.
    repaired : bool
        Whether folds of the interpolated map had to be removed.
    missed
        The largest distance of a vertex of the frame from where the map takes it, over the bounding-box diagonal. Where
        it is nothing and there are no folds, the vertices are those of a surface that is proven not to cross itself
        wherever the first key does not: the image of that key under the map. What is flat between the vertices is not
        part of the proof; its crossings are counted.
    """

    time: float
    folds: int
    smallest_determinant: float
    place: list[float]
    repaired: bool
    missed: float


@dataclass(frozen=True)
class Folds:
    """Numbers of folded tetrahedra: in all fitted maps, and in each frame's map; None in mode ``straight``."""

    map: int | None
    frames: list[int] | None


@dataclass(frozen=True)
class WorstStretch:
    """The edge that is farthest outside the interval between its lengths in the two keys.

    Parameters
    ----------
    excess
        How far, over the nearer end of that interval; 0 where no edge leaves it.
    frame, vertex
        Numbers of the frame and of one of the edge's vertices.
    """

    excess: float
    frame: int
    vertex: int


@dataclass(frozen=True)
class PlayedReport:
    """What a control plays between its shapes, looked at in several places between every two of them.

    Parameters
    ----------
    weights
        ``smooth`` or ``hats``.
    corners
        Numbers of the shapes at which the path turns.
    positions
        In how many places it was looked at.
    distance
        The largest distance of a vertex from where the computed motion has it, over the bounding-box diagonal.
    distance_at
        The position of the control where that is.
    worst_stretch
        The largest excess of an edge over its lengths in the two keys.
    volume
        The largest deviation of an enclosed volume from what lies between its two keys, relative to that; None where
        nothing is closed.
    folds
        Folded tetrahedra of the maps through those of the frames that cannot be unfolded as frames are, the most at one
        position; None in mode ``straight``.
    crossings
        Pairs of triangles that cross beyond what the worse of the two keys has, the most at one position; None where
        that is not known.
    """

    weights: str
    corners: list[int]
    positions: int
    distance: float
    distance_at: float
    worst_stretch: float
    volume: float | None
    folds: int | None
    crossings: int | None


@dataclass
class BakeReport:
    """The report of a bake.

    Parameters
    ----------
    engine
        The engines that filled the volume, in order; "none" in mode ``straight``.
    mode, easing
        The options of the frames.
    stretch, quality
        Options of the fit; None in mode ``straight``.
    vertices, tetrahedra
        How many the mesh has, and the volumes of all pairs together.
    welded
        For each pair, how many vertices were taken as one with others, with which they coincide in both keys.
    folds
        Of the fitted maps and of the frames' maps.
    crossings
        For each frame, pairs of triangles that cross beyond what the worse of its keys has; a key's own frame has 0.
        None where so many triangles lie over each other that the search was given up.
    certificates
        For each frame; empty in mode ``straight``.
    residual
        Of the fitted maps, the worst pair's; None in mode ``straight``.
    worst_stretch
        Where lengths are held worst.
    key_error
        How far the frames computed at the keys were from the keys, over the diagonal, before the keys took their place.
    seconds
        Wall-clock seconds by stage.
    peak_memory_mb
        The most memory that the process has held, in megabytes; None where the system does not tell.
    collider_crossings
        For each frame, pairs of triangles of which one is a collider's, or None as above; None without colliders.
    played
        What a control plays between the frames; None where none was asked for.
    notes
        Sentences for the user.
    """

    engine: str
    mode: str
    easing: str
    stretch: str | None
    quality: str | None
    vertices: int
    tetrahedra: int
    welded: list[int]
    folds: Folds
    crossings: list[int | None]
    certificates: list[Certificate]
    residual: Residual | None
    worst_stretch: WorstStretch
    key_error: float
    seconds: dict[str, float]
    peak_memory_mb: float | None
    collider_crossings: list[int | None] | None = None
    played: PlayedReport | None = None
    notes: list[str] = field(default_factory=list)

    def as_json(self) -> dict[str, Any]:
        """The report as plain values that can be written as JSON."""
        return asdict(self)

    def of_first(self, count: int) -> BakeReport:
        """The report where all vertices but the first ``count`` are mirror images of these."""
        worst = replace(self.worst_stretch, vertex=self.worst_stretch.vertex % count)
        return replace(self, vertices=count, worst_stretch=worst)

    def at(self, chosen: list[int]) -> BakeReport:
        """The report of some of the frames, by their numbers."""
        worst = self.worst_stretch
        frame = chosen.index(worst.frame) if worst.frame in chosen else 0
        return replace(
            self,
            folds=replace(self.folds, frames=_at(self.folds.frames, chosen)),
            crossings=[self.crossings[index] for index in chosen],
            certificates=[self.certificates[index] for index in chosen] if self.certificates else [],
            collider_crossings=_at(self.collider_crossings, chosen),
            worst_stretch=replace(worst, frame=frame),
        )

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> BakeReport:
        """The report that ``as_json`` told; raises TypeError or KeyError where it is none."""
        parts = dict(values)
        parts["folds"] = Folds(**parts["folds"])
        parts["certificates"] = [Certificate(**one) for one in parts["certificates"]]
        parts["residual"] = None if parts["residual"] is None else Residual(**parts["residual"])
        parts["worst_stretch"] = WorstStretch(**parts["worst_stretch"])
        parts["played"] = None if parts["played"] is None else PlayedReport(**parts["played"])
        return cls(**parts)


def welding_notes(pairs: Sequence[KeyPair]) -> list[str]:
    """A sentence about vertices that were taken as one with others although they do not coincide exactly."""
    most = max(pair.nearly_coincident for pair in pairs)
    if not most:
        return []
    return [
        f"{most} {'vertex differs' if most == 1 else 'vertices differ'} from others by no more than rounding in both "
        "keys and stay together with them, as at a seam."
    ]


def mirror_notes(pair: KeyPair) -> list[str]:
    """A sentence about a mesh that was taken as one half of a mirrored whole."""
    if not pair.planes:
        return []
    count = len(pair.own.key0)
    held = [np.count_nonzero(on_plane(pair.key0, pair.key1, count, plane)) for plane in range(len(pair.planes))]
    planes = "a plane" if len(held) == 1 else f"{len(held)} planes"
    return [f"The mesh moves as one with its mirror image across {planes}; {sum(held)} vertices stay on the seam."]


def _at(counts: list[T] | None, chosen: list[int]) -> list[T] | None:
    return None if counts is None else [counts[index] for index in chosen]


def embedding_notes(certificates: Sequence[Certificate], met: float) -> list[str]:
    """A sentence about frames whose vertices are all within ``met`` of where a map without folds takes them."""
    proven = sum(one.folds == 0 and one.missed <= met for one in certificates)
    if not proven:
        return []
    return [
        f"In {proven} of {len(certificates)} frames every vertex is within {met:.2%} of the size of where a map "
        "without folds takes the first key: on a surface that is proven to cross itself nowhere where the key does "
        "not. Crossings of the flat triangles between them are counted."
    ]


def crossing_notes(crossings: Sequence[int | None], times: Floats, subject: str = "itself") -> list[str]:
    """Sentences about the frame at ``times`` (k,) that crosses ``subject`` most, and about frames of which that is not
    known, where there are any."""
    notes = []
    counts = [count or 0 for count in crossings]
    if any(counts):
        worst = int(np.argmax(counts))
        beyond = " more than a key" if subject == "itself" else ""
        pairs = f"{counts[worst]} {'pair' if counts[worst] == 1 else 'pairs'} of triangles"
        notes.append(f"The frame at {times[worst]:.3g} crosses {subject} in {pairs}{beyond}.")
    if None in crossings:
        notes.append(
            f"Whether the mesh crosses {subject} is not known in {crossings.count(None)} of {len(crossings)} frames: "
            "so many triangles overlap there that searching would take too long; remove repeated triangles."
        )
    return notes
