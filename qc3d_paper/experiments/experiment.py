# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A map of the cube cut off in several ways, for figures 8 to 13 (section 6.2)."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np

from qc3d_addon.solver.arrays import Bools, Floats
from qc3d_addon.solver.compression.codec import Codec
from qc3d_addon.solver.compression.logarithms import exponential, logarithm
from qc3d_addon.solver.compression.modes import Spectrum, Transfer, spectrum
from qc3d_addon.solver.compression.transfer_loss import transferred
from qc3d_addon.solver.errors import ReconstructionError
from qc3d_addon.solver.maps.boundary_conditions import Conditions
from qc3d_addon.solver.maps.mapping import Mapping
from qc3d_addon.solver.maps.reconstruction import reconstruct
from qc3d_addon.solver.maps.representation import from_upper_triangle, upper_triangle
from qc3d_addon.solver.settings import FitOptions

from . import bijections, shapes
from .shapes import Pose

# Meshes of which all modes can be computed: a few thousand vertices.
OPTIONS = FitOptions()
FITTED_COUNTS = (4, 16, 60, 240)  # fewer, because each needs an optimization
_EXACTLY = 1e-9  # a quantization step so small that rounding does not matter

Way = Literal["coordinates", "displacements", "put back", "published", "logarithm", "fitted"]
# Numbers that each mode takes: three coordinates, or the six of the representation.
NUMBERS: dict[Way, int] = {
    "coordinates": 3,
    "displacements": 3,
    "put back": 3,
    "published": 6,
    "logarithm": 6,
    "fitted": 6,
}


class Experiment:
    """One map and everything that its figures need, computed once.

    Parameters
    ----------
    title : str
        What it is, for captions.
    mapping : Mapping
        A map of the cube whose faces slide.
    """

    def __init__(self, title: str, mapping: Mapping) -> None:
        self.title, self.mapping, self.mesh = title, mapping, mapping.mesh
        self.modes = len(mapping.mesh.points)
        self.on_boundary: Bools = mapping.mesh.on_cube_face.any(axis=1)
        self.reference = self.error(mapping.mesh.points)

    @classmethod
    def fitted(cls, pose: Pose, data: Path | None) -> Experiment:
        """The map that carries the first shape of a pose onto the second."""
        found = shapes.fitted(shapes.read(pose, data), OPTIONS)
        return cls(f"{pose.label}, fitted", Mapping(found.mesh, found.mapped))

    @classmethod
    def smooth(cls, title: str, bijection: Callable[[Floats], Floats]) -> Experiment:
        """A smooth bijection of the cube, as the paper's are."""
        return cls(*bijections.without_folds(shapes.cube(OPTIONS), title, bijection))

    @cached_property
    def spectrum(self) -> Spectrum:
        """All modes of the mesh."""
        return spectrum(self.mesh, self.modes)

    @cached_property
    def _transfer(self) -> Transfer:
        return Transfer(self.mesh)

    @cached_property
    def channels(self) -> Floats:
        """(N, 6) what the modes have of P's upper triangle; squares of xy, xz and yz count twice in P's norm."""
        return self._projected(upper_triangle(self.mapping.stretch))

    @cached_property
    def _channels_of_logarithm(self) -> Floats:
        return self._projected(upper_triangle(logarithm(self.mapping.stretch)))

    def _projected(self, channels: Floats) -> Floats:
        weighted = self._transfer.vertex_volumes[:, None] * (self._transfer.to_vertices @ channels)
        return np.asarray(self.spectrum.modes.T @ weighted)

    @cached_property
    def _codec(self) -> Codec:
        return Codec(self.mesh, min(max(FITTED_COUNTS), self.modes), "fitted")

    def restored(self, way: Way, modes: int) -> Floats | None:
        """(N, 3) the map from its first modes; None where no map has the representation that was cut off."""
        if way in ("coordinates", "displacements", "put back"):
            kept = np.zeros_like(self.mesh.points) if way == "coordinates" else self.mesh.points
            basis = self.spectrum.modes[:, :modes]
            weighted = self._transfer.vertex_volumes[:, None] * (self.mapping.values - kept)
            found = kept + basis @ (basis.T @ weighted)
            if way == "put back":
                found[self.mesh.on_cube_face] = self.mesh.points[self.mesh.on_cube_face]
            return np.asarray(found)
        if way == "fitted":
            targets = self.mapping.values[None]
            return np.asarray(self._codec.rounded(targets, self._codec.coefficients(targets, modes), _EXACTLY)[1][0])
        numbers = (self.channels if way == "published" else self._channels_of_logarithm)[:modes]
        matrices = from_upper_triangle(self._transfer.to_tets @ (self.spectrum.modes[:, :modes] @ numbers))
        stretch = matrices if way == "published" else exponential(matrices)
        try:
            return reconstruct(self.mesh, stretch, Conditions.sliding_cube(self.mesh)).values
        except ReconstructionError:
            return None

    def transfer_part(self, way: Literal["published", "logarithm", "fitted"]) -> float:
        """What is left of the reference after the way from tetrahedra to vertices and back, with all modes."""
        found = transferred(self.mapping, way, Conditions.sliding_cube(self.mesh))
        return np.nan if found is None else self.error(found.values) / self.reference

    def error(self, values: Floats, where: Bools | slice = slice(None)) -> float:
        """Mean square distance of values (N, 3) from the map, at all vertices or some, cube units squared."""
        return float(((values - self.mapping.values)[where] ** 2).sum(axis=1).mean())

    def folds(self, values: Floats) -> int:
        """Folded tetrahedra of a map."""
        return Mapping(self.mesh, values).folds
