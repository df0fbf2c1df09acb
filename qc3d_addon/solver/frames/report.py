# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bake tells about itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from ..arrays import Floats
from ..fit.fitted_map import Residual
from ..keys.keypair import KeyPair


@dataclass(frozen=True)
class Certificate:
    """The proof of one frame's map: all determinants of its Jacobians are positive where ``folds`` is 0.

    Parameters
    ----------
    time
        Time of the frame within its pair of keys, 0..1.
    folds
        Tetrahedra that the frame's map does not keep positively oriented.
    smallest_determinant
        The smallest determinant of the map's Jacobians.
    place
        Where that is: x, y, z in the keys' coordinates.
    repaired
        Whether folds of the interpolated map had to be removed.
    """

    time: float
    folds: int
    smallest_determinant: float
    place: list[float]
    repaired: bool


@dataclass(frozen=True)
class Folds:
    """Folded tetrahedra: of the fitted maps together, and of each frame's map; None in mode ``straight``."""

    map: int | None
    frames: list[int] | None


@dataclass(frozen=True)
class WorstStretch:
    """The edge that leaves the interval between its lengths in the two keys farthest.

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


@dataclass
class BakeReport:
    """Everything that a bake tells about itself.

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
        For each frame, pairs of triangles of which one is a collider's; None without colliders.
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
    crossings: list[int]
    certificates: list[Certificate]
    residual: Residual | None
    worst_stretch: WorstStretch
    key_error: float
    seconds: dict[str, float]
    peak_memory_mb: float | None
    collider_crossings: list[int] | None = None
    notes: list[str] = field(default_factory=list)

    def as_json(self) -> dict[str, Any]:
        """The report as plain values that can be written as JSON."""
        return asdict(self)

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> BakeReport:
        """The report that ``as_json`` told; raises TypeError or KeyError where it is none."""
        parts = dict(values)
        parts["folds"] = Folds(**parts["folds"])
        parts["certificates"] = [Certificate(**one) for one in parts["certificates"]]
        parts["residual"] = None if parts["residual"] is None else Residual(**parts["residual"])
        parts["worst_stretch"] = WorstStretch(**parts["worst_stretch"])
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


def crossing_notes(crossings: Sequence[int], times: Floats, subject: str = "itself") -> list[str]:
    """A sentence about the frame at ``times`` (k,) that crosses ``subject`` most, if one does."""
    if not any(crossings):
        return []
    worst = int(np.argmax(crossings))
    beyond = " more than a key" if subject == "itself" else ""
    pairs = f"{crossings[worst]} {'pair' if crossings[worst] == 1 else 'pairs'} of triangles"
    return [f"The frame at {times[worst]:.3g} crosses {subject} in {pairs}{beyond}."]
