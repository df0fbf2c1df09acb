# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The results of a bake that are stored for the panel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from . import stored_values as stored

if TYPE_CHECKING:
    from ...solver.frames.report import BakeReport, PlayedReport

_MOST = 2**63 - 1  # upper bound of counts


@dataclass(frozen=True)
class WorstPlace:
    """Where the in-betweens stretch or shrink most beyond their keys.

    Parameters
    ----------
    excess
        By how much, relative to the length in the nearer key; 0 if nowhere.
    at
        Position of the slider, in [0, 1].
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
class Played:
    """Quality of what a control plays, also between its shapes: the worst values over many positions.

    Parameters
    ----------
    distance
        Largest distance of a vertex from the computed motion, over the size.
    stretch
        Largest relative amount by which an edge leaves the interval between its lengths in the two keys.
    volume
        Largest relative amount by which the enclosed volume leaves the interval between its values in the two keys;
        None if the mesh is not closed.
    folds, crossings
        As in ``Summary``, at the worst position.
    """

    distance: float
    stretch: float
    volume: float | None
    folds: int | None
    crossings: int | None

    @classmethod
    def of_report(cls, report: PlayedReport) -> Played:
        """The values from the solver's report."""
        return cls(report.distance, report.worst_stretch, report.volume, report.folds, report.crossings)

    @classmethod
    def from_json(cls, values: object) -> Played:
        """What ``dataclasses.asdict`` makes of it; raises ValueError, KeyError or TypeError for anything else."""
        found = stored.plain_dict(values)
        volume = found["volume"]
        folds, crossings = (None if found[name] is None else stored.whole(found[name], 0, _MOST)
                            for name in ("folds", "crossings"))  # fmt: skip
        return cls(
            stored.number(found["distance"], 0.0),
            stored.number(found["stretch"], 0.0),
            None if volume is None else stored.number(volume, 0.0),
            folds,
            crossings,
        )


@dataclass(frozen=True)
class Summary:
    """The results of a bake.

    Parameters
    ----------
    count
        Number of in-betweens that became shape keys.
    engine
        Engine that filled the volume with tetrahedra.
    seconds
        Time of the computation.
    folds
        Number of inverted tetrahedra, summed over the in-betweens; None without a map.
    crossings
        Number of pairs of crossing triangles beyond those of the keys, summed over the in-betweens; None if unknown.
    worst
        Where the in-betweens stretch or shrink most beyond their keys; None if not measured.
    residual
        RMS distance of the map from the second key before the exact key is blended in, over the size; None without a
        map.
    collider_crossings
        Number of pairs of triangles that cross with colliders, summed over the in-betweens; None without colliders.
    played
        Quality of what the control plays, also between the in-betweens; None for bakes of older versions.
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
    played: Played | None = None
    notes: tuple[str, ...] = ()

    @classmethod
    def of_report(cls, report: BakeReport, places: Sequence[float], keys: int, notes: Sequence[str]) -> Summary:
        """The results in the solver's ``report`` about shapes at these places of the control, of which are ``keys``."""
        worst, played = report.worst_stretch, report.played
        return cls(
            count=len(places) - keys,
            engine=report.engine,
            seconds=sum(report.seconds.values()),
            folds=_summed(report.folds.frames),
            crossings=_summed(report.crossings),
            worst=WorstPlace(worst.excess, places[worst.frame], worst.vertex),
            residual=None if report.residual is None else report.residual.rms,
            collider_crossings=_summed(report.collider_crossings),
            played=None if played is None else Played.of_report(played),
            notes=tuple(notes),
        )

    @classmethod
    def from_json(cls, values: object) -> Summary | None:
        """The inverse of ``dataclasses.asdict``; None for None or an empty dictionary.

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
        found["played"] = Played.from_json(found["played"]) if found.get("played") else None
        found["engine"] = stored.text(found["engine"])
        found["seconds"] = stored.number(found["seconds"], 0.0)
        found["notes"] = tuple(stored.text(note) for note in stored.plain_list(found["notes"]))
        return cls(**found)


def _summed(counts: Sequence[int | None] | None) -> int | None:
    """The sum over all shapes; None if any count is unknown."""
    return None if counts is None or None in counts else sum(count or 0 for count in counts)
