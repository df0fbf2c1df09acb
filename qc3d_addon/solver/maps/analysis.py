# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Analysis of a map: its representation and distortion on each tetrahedron, at the vertices, and in summary."""

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
    """The representation and the distortion of a map; everything is computed when it is first asked for.

    Parameters
    ----------
    mapping : Mapping

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> found = Analysis(Mapping.checked(corners, [[0, 1, 2, 3]], corners * [3.0, 2.0, 0.5]))
    >>> found.eigenvalues.round(12), found.measures["volume_ratio"].round(12)
    (array([[3. , 2. , 0.5]]), array([3.]))
    """

    mapping: Mapping

    @cached_property
    def upper_triangle(self) -> Floats:
        """(M, 6) the entries xx, xy, xz, yy, yz, zz of the stretch P, without unit: the first six-number form."""
        return upper_triangle(self.mapping.stretch)

    @cached_property
    def eigen_form(self) -> Floats:
        """(M, 6) the eigenvalues a >= b >= c of the stretch and Euler angles in radians: the second six-number form."""
        return eigen_form(self.mapping.stretch)

    @cached_property
    def eigenvalues(self) -> Floats:
        """(M, 3) principal stretches a >= b >= c; c <= 0 where the map is folded."""
        return singular_values(self.mapping.jacobians)

    @cached_property
    def directions(self) -> Floats:
        """(M, 3, 3) principal directions in the source: unit vectors in rows for a, b and c, with arbitrary signs."""
        return np.asarray(np.linalg.eigh(self.mapping.stretch)[1].transpose(0, 2, 1)[:, ::-1])

    @cached_property
    def measures(self) -> dict[str, Floats]:
        """(M,) ``dilatation``, ``outer_dilatation``, ``inner_dilatation``, all in [1, inf], and ``volume_ratio``."""
        values = self.eigenvalues
        return {
            "dilatation": dilatation(values),
            "outer_dilatation": outer_dilatation(values),
            "inner_dilatation": inner_dilatation(values),
            "volume_ratio": volume_ratio(values),
        }

    def at_vertices(self) -> dict[str, Floats]:
        """(N,) volume-weighted geometric mean of each measure over the tetrahedra around each vertex.

        Folded tetrahedra are left out; NaN where there are no others.
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
        """Sizes, folds, and volume-weighted extremes, percentiles and mean of each measure, as values for JSON."""
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
    """Extremes, percentiles and mean, weighted by ``share`` of the volume (M,); None stands for infinity."""
    order = np.argsort(values)
    reached = np.cumsum(share[order])
    found = {"smallest": values[order[0]]}
    for percentile in _PERCENTILES:
        place = min(int(np.searchsorted(reached, percentile / 100.0)), len(order) - 1)
        found["median" if percentile == 50 else f"percentile_{percentile}"] = values[order[place]]
    found["largest"] = values[order[-1]]
    found["mean"] = share @ values
    return {name: float(value) if np.isfinite(value) else None for name, value in found.items()}
