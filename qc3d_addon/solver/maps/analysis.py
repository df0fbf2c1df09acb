# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that can be told about a mapping, tetrahedron by tetrahedron and in figures."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..arrays import Floats
from ..numerics.grouped_sums import sums_by_label
from .distortion import dilatation, inner_dilatation, outer_dilatation, singular_values, volume_ratio
from .mapping import Mapping
from .representation import eigen_form, upper_triangle

_PERCENTILES = (1, 50, 99)


@dataclass(frozen=True, eq=False)
class Analysis:
    """The distortion of a mapping.

    Parameters
    ----------
    mapping : Mapping
    """

    mapping: Mapping

    @cached_property
    def upper_triangle(self) -> Floats:
        """(M, 6) the representation as xx, xy, xz, yy, yz, zz of the stretch P; ratios of lengths, no unit."""
        return upper_triangle(self.mapping.stretch)

    @cached_property
    def eigen_form(self) -> Floats:
        """(M, 6) the representation as eigenvalues a >= b >= c and Euler angles in radians, see ``eigen_form``."""
        return eigen_form(self.mapping.stretch)

    @cached_property
    def eigenvalues(self) -> Floats:
        """(M, 3) a >= b >= c: how much lengths grow along the principal directions; c <= 0 where the map is folded."""
        return singular_values(self.mapping.jacobians)

    @cached_property
    def directions(self) -> Floats:
        """(M, 3, 3) rows: unit vectors of the source along which lengths grow by a, b and c, of either sign."""
        return np.asarray(np.linalg.eigh(self.mapping.stretch)[1].transpose(0, 2, 1)[:, ::-1])

    @cached_property
    def measures(self) -> dict[str, Floats]:
        """(M,) each: ``dilatation`` K, ``outer_dilatation`` and ``inner_dilatation`` in [1, inf]; ``volume_ratio``."""
        values = self.eigenvalues
        return {
            "dilatation": dilatation(values),
            "outer_dilatation": outer_dilatation(values),
            "inner_dilatation": inner_dilatation(values),
            "volume_ratio": volume_ratio(values),
        }

    def at_vertices(self) -> dict[str, Floats]:
        """(N,) means of the measures over the tetrahedra around each vertex, in logarithms, weighted by volume.

        Tetrahedra that are folded have no logarithm and are left out; NaN where there are no others.
        """
        mesh = self.mapping.mesh
        good = self.measures["volume_ratio"] > 0.0
        corners, volumes = mesh.tets[good], np.repeat(mesh.volumes[good], 4)
        count = len(mesh.points)
        weights = sums_by_label(corners.ravel(), volumes, count)
        means = {}
        for name, values in self.measures.items():
            summed = sums_by_label(corners.ravel(), volumes * np.repeat(np.log(values[good]), 4), count)
            with np.errstate(invalid="ignore"):
                means[name] = np.exp(summed / weights)
        return means

    def summary(self) -> dict[str, Any]:
        """Plain values: sizes, folds, and for each measure its extremes, percentiles and mean, weighted by volume."""
        mesh = self.mapping.mesh
        share = mesh.volumes / mesh.volumes.sum()
        eigenvalues = dict(zip("abc", self.eigenvalues.T, strict=True))
        return {
            "vertices": len(mesh.points),
            "tetrahedra": len(mesh.tets),
            "volume": {
                "source": float(mesh.volumes.sum()),
                "target": float((mesh.volumes * self.measures["volume_ratio"]).sum()),
            },
            "folds": self.mapping.folds,
            **{name: _statistics(values, share) for name, values in {**eigenvalues, **self.measures}.items()},
        }


def _statistics(values: Floats, share: Floats) -> dict[str, float | None]:
    """Extremes, percentiles and mean by share of the volume; None stands for infinity, which JSON does not have."""
    order = np.argsort(values)
    reached = np.cumsum(share[order])
    found = {"smallest": values[order[0]]}
    for percentile in _PERCENTILES:
        place = min(int(np.searchsorted(reached, percentile / 100.0)), len(order) - 1)
        found["median" if percentile == 50 else f"percentile_{percentile}"] = values[order[place]]
    found["largest"] = values[order[-1]]
    found["mean"] = share @ values
    return {name: float(value) if np.isfinite(value) else None for name, value in found.items()}
