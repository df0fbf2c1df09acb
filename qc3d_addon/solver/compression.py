# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mappings in few numbers: the lowest modes of their representation, quantised (Chen & Lui, section 7).

Three schemes share the file format:

``published``
    The six channels of P, averaged to the vertices, projected on the first k modes, averaged back. P may lose its
    positive definiteness; the map cannot be rebuilt then.
``logarithm``
    The same on log P, whose exponential is positive definite whatever the numbers are.
``fitted``
    log P again, but the coefficients are those whose mean over corners fits the tetrahedra best in the least-squares
    sense, and each is rounded as coarsely as it can be: an error in a mode of eigenvalue lambda moves vertices by about
    one over the root of lambda, so steps grow with that root. What the rebuilt map misses may follow as displacements,
    rounded too, of everything that is not held: where detail is local, few modes and a remainder are smallest.

The boundary is not stored where it slides: the conditions of the rebuilding give it back exactly.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .conditions import Conditions
from .errors import InputError
from .mapping import Mapping
from .reconstruction import reconstruct
from .representation import from_upper_triangle, upper_triangle
from .spectral import Spectrum, Transfer, spectrum
from .tetmesh import Floats, TetMesh

Scheme = Literal["published", "logarithm", "fitted"]
Boundary = Literal["sliding", "fixed"]

# Off-diagonal entries count twice in the norm of a symmetric matrix.
_NORM = np.sqrt(np.array([1.0, 2.0, 2.0, 1.0, 2.0, 1.0]))
# Coefficients beyond so many steps do not fit the format; a step that makes larger ones is too small to be of use.
MOST_STEPS = 2**40
# No real map stretches by more than exp of this, about 20,000; beyond it rounding could spoil definiteness.
_MOST_LOGARITHM = 10.0


@dataclass(frozen=True, eq=False)
class Compressed:
    """A map as whole numbers.

    Parameters
    ----------
    scheme, boundary
    step : float
        What the number 1 stands for in the lowest mode.
    numbers : (k, 6) int64
        Coefficients of the six channels in steps, by mode.
    held : (b, 3)
        Images of the boundary's vertices where it is fixed, in the order of their numbers; empty where it slides.
    remainder_step : float
        What the number 1 stands for in the remainder, in units of the map.
    remainder : (r,) int64
        Displacements that follow the rebuilding, in steps, of all coordinates that are not held; empty for none.
    """

    scheme: Scheme
    boundary: Boundary
    step: float
    numbers: NDArray[np.int64]
    held: Floats
    remainder_step: float = 0.0
    remainder: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64))


class Codec:
    """Compresses and restores maps of one mesh by one scheme; the modes are computed once.

    Parameters
    ----------
    mesh : TetMesh
    modes : int
        How many modes there are to choose from; 0 for a remainder alone.
    scheme : Scheme
    boundary : Boundary

    Raises
    ------
    InputError
        If the mesh has too few vertices for so many modes.
    """

    def __init__(self, mesh: TetMesh, modes: int, scheme: Scheme = "fitted", boundary: Boundary = "sliding") -> None:
        self.mesh, self.scheme, self.boundary = mesh, scheme, boundary
        empty = Spectrum(np.empty(0), np.empty((len(mesh.points), 0)))
        self.spectrum: Spectrum = spectrum(mesh, modes) if modes else empty
        self._transfer = Transfer(mesh)
        self._at_tets = np.asarray(self._transfer.to_tets @ self.spectrum.modes)

    def with_scheme(self, scheme: Scheme) -> Codec:
        """The same modes for another scheme."""
        other = copy.copy(self)
        other.scheme = scheme
        return other

    def coefficients(self, mapping: Mapping, modes: int) -> Floats:
        """(k, 6) coefficients of the representation in the first modes, off-diagonal channels times the root of two."""
        stretch = mapping.stretch if self.scheme == "published" else _logarithm(mapping.stretch)
        channels = upper_triangle(stretch) * _NORM
        if self.scheme == "fitted":
            basis, weights = self._at_tets[:, :modes], self.mesh.volumes[:, None]
            return np.asarray(np.linalg.solve(basis.T @ (weights * basis), basis.T @ (weights * channels)))
        weighted = self._transfer.vertex_volumes[:, None] * (self._transfer.to_vertices @ channels)
        return np.asarray(self.spectrum.modes[:, :modes].T @ weighted, dtype=np.float64)

    def steps(self, modes: int) -> Floats:
        """(k,) how much coarser each mode may be rounded than the lowest."""
        if self.scheme != "fitted":
            return np.ones(modes)
        eigenvalues = self.spectrum.eigenvalues[:modes]
        lowest = self.spectrum.eigenvalues[1] if len(self.spectrum.eigenvalues) > 1 else 1.0
        return np.asarray(np.sqrt(1.0 + eigenvalues / lowest))

    def compress(self, mapping: Mapping, modes: int, step: float) -> Compressed:
        """Round the coefficients of the first modes to multiples of a step.

        Raises
        ------
        InputError
            If the map is folded, moves a sliding boundary out of its faces, or the step is too small.
        """
        held = self._checked_boundary(mapping)
        rounded = np.round(self.coefficients(mapping, modes) / (step * self.steps(modes))[:, None])
        if not np.abs(rounded).max(initial=0.0) < MOST_STEPS:
            raise InputError(f"The step {step:.3g} is too small for this map; choose a larger one.")
        return Compressed(self.scheme, self.boundary, step, rounded.astype(np.int64), held)

    def restore(self, compressed: Compressed) -> Mapping:
        """The map that was compressed, as nearly as the numbers have it; its boundary exactly.

        Raises
        ------
        InputError
            If there are more modes than this codec has, or the boundary belongs to another mesh.
        ReconstructionError
            If the representation is not positive definite, which happens with the scheme ``published``.
        """
        rebuilt = reconstruct(self.mesh, self.stretch(compressed), self._conditions(compressed.held))
        return self.finished(compressed, rebuilt)

    def finished(self, compressed: Compressed, rebuilt: Mapping) -> Mapping:
        """The map rebuilt from the modes, with the remainder; raises InputError where that belongs to another mesh."""
        if not len(compressed.remainder):
            return rebuilt
        free = ~self._conditions(compressed.held).held
        if len(compressed.remainder) != np.count_nonzero(free):
            raise InputError(
                f"The remainder has {len(compressed.remainder)} numbers for {np.count_nonzero(free)} free coordinates."
            )
        values = np.array(rebuilt.values)
        values[free] += compressed.remainder_step * compressed.remainder
        return Mapping(self.mesh, values)

    def with_remainder(self, compressed: Compressed, rebuilt: Mapping, mapping: Mapping, step: float) -> Compressed:
        """The same with what ``rebuilt``, its restored map, misses of ``mapping``, rounded to multiples of a step.

        Raises
        ------
        InputError
            If the step is too small.
        """
        missed = (mapping.values - rebuilt.values)[~self._conditions(compressed.held).held]
        rounded = np.round(missed / step)
        if not np.abs(rounded).max(initial=0.0) < MOST_STEPS:
            raise InputError(f"The step {step:.3g} is too small for this map; choose a larger one.")
        return replace(compressed, remainder_step=step, remainder=rounded.astype(np.int64))

    def stretch(self, compressed: Compressed) -> Floats:
        """(M, 3, 3) the representation that the numbers stand for."""
        modes = len(compressed.numbers)
        if modes > self._at_tets.shape[1]:
            raise InputError(f"The map has {modes} modes; {self._at_tets.shape[1]} were computed.")
        coefficients = compressed.numbers * (compressed.step * self.steps(modes))[:, None]
        matrices = from_upper_triangle(self._at_tets[:, :modes] @ coefficients / _NORM)
        return matrices if compressed.scheme == "published" else _exponential(matrices)

    def _checked_boundary(self, mapping: Mapping) -> Floats:
        if mapping.folds:
            raise InputError(f"The map has {mapping.folds} folded tetrahedra; only those without can be compressed.")
        if self.boundary == "fixed":
            return np.asarray(mapping.values[np.unique(self.mesh.boundary_faces)])
        held = self.mesh.on_cube_face
        if not np.array_equal(mapping.values[held], self.mesh.points[held]):
            raise InputError("The map moves the cube's faces out of themselves; compress it with a fixed boundary.")
        return np.empty((0, 3))

    def _conditions(self, held: Floats) -> Conditions:
        if self.boundary == "sliding":
            return Conditions.sliding_cube(self.mesh)
        rows = np.unique(self.mesh.boundary_faces)
        if held.shape != (len(rows), 3):
            raise InputError(f"The stored boundary has {len(held)} vertices, that of the mesh {len(rows)}.")
        values = np.array(self.mesh.points)
        values[rows] = held
        return Conditions.fixed_boundary(self.mesh, values)


def _logarithm(stretch: Floats) -> Floats:
    values, vectors = np.linalg.eigh(stretch)
    return np.asarray((vectors * np.log(values)[:, None]) @ vectors.transpose(0, 2, 1))


def _exponential(matrices: Floats) -> Floats:
    values, vectors = np.linalg.eigh(matrices)
    stretches = np.exp(np.clip(values, -_MOST_LOGARITHM, _MOST_LOGARITHM))
    product = (vectors * stretches[:, None]) @ vectors.transpose(0, 2, 1)
    return np.asarray(0.5 * (product + product.transpose(0, 2, 1)))
