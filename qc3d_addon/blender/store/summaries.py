# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is remembered of how a bake turned out, for the box that the panel draws of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from . import stored_values as stored

if TYPE_CHECKING:
    from ...solver.frames.report import BakeReport

_MOST = 2**63 - 1  # of what is counted


@dataclass(frozen=True)
class WorstPlace:
    """Where the in-betweens stretch or shrink most beyond their keys.

    Parameters
    ----------
    excess
        How far, over the length in the nearer key; 0 where they do not.
    at
        Position of the slider, 0..1.
    vertex
        Index of a vertex.
    """

    excess: float
    at: float
    vertex: int

    @classmethod
    def from_json(cls, values: object) -> WorstPlace:
        """What ``dataclasses.asdict`` makes of it; raises ValueError, KeyError or TypeError for anything else."""
        found = stored.plain_dict(values)
        excess, at = stored.number(found["excess"], 0.0), stored.number(found["at"], 0.0, 1.0)
        return cls(excess, at, stored.whole(found["vertex"], 0, _MOST))


@dataclass(frozen=True)
class Summary:
    """How a bake turned out.

    Parameters
    ----------
    count
        Number of in-betweens that became shape keys.
    engine
        What filled the volume.
    seconds
        How long the work took.
    folds
        Number of inverted tetrahedra in all in-betweens; None where there was no map.
    crossings
        Number of pairs of triangles that cross in an in-between beyond those of its keys; None where it is not known.
    worst
        Where the in-betweens stretch or shrink most beyond their keys; None where that was not measured.
    residual
        How far the map is from the second key before that is blended in, over the size; None without a map.
    collider_crossings
        Number of pairs of triangles that cross with colliders; None where there were none.
    notes
        Sentences for the user.
    """

    count: int
    engine: str
    seconds: float
    folds: int | None
    crossings: int | None
    worst: WorstPlace | None
    residual: float | None
    collider_crossings: int | None = None
    notes: tuple[str, ...] = ()

    @classmethod
    def of_report(
        cls, report: BakeReport, times: NDArray[np.float64], chosen: NDArray[np.int64], notes: Sequence[str]
    ) -> Summary:
        """The summary of the frames ``chosen`` among those at ``times``, which the solver's ``report`` is about."""
        worst = report.worst_stretch
        return cls(
            count=len(chosen) - 2,
            engine=report.engine,
            seconds=sum(report.seconds.values()),
            folds=_summed(report.folds.frames, chosen),
            crossings=_summed(report.crossings, chosen),
            worst=WorstPlace(worst.excess, float(times[worst.frame]), worst.vertex),
            residual=None if report.residual is None else report.residual.rms,
            collider_crossings=_summed(report.collider_crossings, chosen),
            notes=tuple(notes),
        )

    @classmethod
    def from_json(cls, values: object) -> Summary | None:
        """What ``dataclasses.asdict`` makes of it, None where there is none.

        Raises
        ------
        ValueError, KeyError, TypeError
            For anything else.
        """
        if values is None or values == {}:
            return None
        found = dict(stored.plain_dict(values))
        found["count"] = stored.whole(found["count"], 0, _MOST)
        for name in ("folds", "crossings", "collider_crossings"):
            if found.get(name) is not None:
                found[name] = stored.whole(found[name], 0, _MOST)
        if found["residual"] is not None:
            found["residual"] = stored.number(found["residual"], 0.0)
        found["worst"] = WorstPlace.from_json(found["worst"]) if found.get("worst") else None
        found["engine"] = stored.text(found["engine"])
        found["seconds"] = stored.number(found["seconds"], 0.0)
        found["notes"] = tuple(stored.text(note) for note in stored.plain_list(found["notes"]))
        return cls(**found)


def _summed(counts: Sequence[int | None] | None, chosen: NDArray[np.int64]) -> int | None:
    """The sum over the chosen frames; None where nothing, or not everything, is known."""
    known = [None if counts is None else counts[step] for step in chosen]
    return None if None in known else sum(count or 0 for count in known)
