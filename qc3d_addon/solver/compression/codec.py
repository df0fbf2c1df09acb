# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mappings in few numbers: the lowest modes of their representation, quantized (Chen & Lui, section 6.2).

Three schemes share the file format:

``published``
    The six channels of P, averaged to the vertices, projected on the first k modes, averaged back. P may lose its
    positive definiteness; the map cannot be rebuilt then.
``logarithm``
    The same on log P, whose exponential is positive definite whatever the numbers are.
``fitted``
    log P again, but in modes to which all vertices count alike, with the coefficients whose rebuilt map is nearest
    (module ``nearest_map``), each rounded as coarsely as it can be: an error in a mode of eigenvalue lambda moves
    vertices by about one over the root of lambda, so steps grow with that root. What the rebuilt map misses may follow
    as displacements, rounded too: where detail is local, few modes and a remainder are smallest.

The boundary is not stored where it slides: the conditions of the rebuilding give it back exactly.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array, eye_array

from ..arrays import Bools, Floats
from ..errors import InputError
from ..maps.mapping import Mapping
from ..maps.reconstruction import reconstruct
from ..maps.representation import from_upper_triangle, upper_triangle
from ..tets.mesh import TetMesh
from .compressed import Boundary, Compressed, Scheme, whole_steps
from .held_boundary import HeldBoundary
from .logarithms import exponential, logarithm
from .modes import Spectrum, Transfer, spectrum
from .nearest_map import NORM, NearestMap

# Steps of the search for the nearest map: for the first of a row of maps, and for those that begin at the one before.
_FIRST_ITERATIONS, _NEXT_ITERATIONS = 60, 20
_CHECK_TOLERANCE = 1e-6
_ZERO = 1e-9  # of the largest eigenvalue
_MOST_WORK = 30_000_000  # tetrahedra of maps that are rebuilt for one file: about four minutes of one core


class Codec:
    """Compresses and restores maps of one mesh by one scheme; the modes are computed once.

    Parameters
    ----------
    mesh : TetMesh
    modes : int
        How many modes there are to choose from; 0 for a remainder alone.
    scheme : Scheme
    boundary : Boundary
    observed : (n, N) sparse array, optional
        What is to be restored of a map: these combinations of its values, such as the vertices of a surface in the
        mesh; the values themselves where it is not given. Only for the scheme ``fitted``.
    held_step : float
        In what steps a fixed boundary is told; 0 for exactly.
    known : Spectrum, optional
        The modes, where they were computed already for a scheme with the same ones.

    Raises
    ------
    InputError
        If the mesh has too few vertices for so many modes.
    """

    def __init__(
        self,
        mesh: TetMesh,
        modes: int,
        scheme: Scheme = "fitted",
        boundary: Boundary = "sliding",
        observed: csr_array | None = None,
        known: Spectrum | None = None,
        held_step: float = 0.0,
    ) -> None:
        self._held = HeldBoundary(mesh, boundary, held_step if boundary == "fixed" else 0.0)
        self.mesh, self.scheme, self.boundary = mesh, scheme, boundary
        self.observes_map = observed is None
        self._observed = csr_array(eye_array(len(mesh.points))) if observed is None else observed
        self.points: Floats = np.asarray(self._observed @ mesh.points)
        self.diagonal = float(np.linalg.norm(np.ptp(self.points, axis=0)))
        if known is None and modes:
            known = spectrum(mesh, modes, "equal" if scheme == "fitted" else "volume")
        self.spectrum = known or Spectrum(np.empty(0), np.empty((len(mesh.points), 0)))
        self._transfer = Transfer(mesh)
        self._at_tets = np.asarray(self._transfer.to_tets @ self.spectrum.modes)

    @property
    def modes(self) -> int:
        """How many modes there are."""
        return int(self._at_tets.shape[1])

    @cached_property
    def _kept(self) -> Bools:
        """(n, 3) what the conditions give exactly, so that no remainder is needed."""
        if self.observes_map:
            return self._held.conditions(np.zeros((self._held.rows.size, 3))).held
        return np.zeros(self.points.shape, dtype=bool)

    def projected(self, mapping: Mapping, modes: int) -> Floats:
        """(k, 6) coefficients of a map's representation, off-diagonal channels times the root of two.

        Averaged to the vertices and projected; in the scheme ``fitted`` those whose means over corners fit the
        tetrahedra best in the least-squares sense.
        """
        stretch = mapping.stretch if self.scheme == "published" else logarithm(mapping.stretch)
        channels = upper_triangle(stretch) * NORM
        if self.scheme == "fitted":
            basis, weights = self._at_tets[:, :modes], self.mesh.volumes[:, None]
            return np.asarray(np.linalg.lstsq(basis * np.sqrt(weights), channels * np.sqrt(weights), rcond=None)[0])
        weighted = self._transfer.vertex_volumes[:, None] * (self._transfer.to_vertices @ channels)
        return np.asarray(self.spectrum.modes[:, :modes].T @ weighted, dtype=np.float64)

    def coefficients(self, targets: Floats, modes: int) -> Floats:
        """(F, k, 6) coefficients in the first modes for targets (F, n, 3); see ``projected``.

        Raises
        ------
        InputError
            If a map is folded or moves a sliding boundary out of its faces.
        """
        held = self.held(targets)
        if not modes:
            return np.zeros((len(targets), 0, 6))
        if self.scheme != "fitted":
            return np.stack([self.projected(Mapping(self.mesh, values), modes) for values in targets])
        found: list[Floats] = []
        for values, kept in zip(targets, held, strict=True):
            if found:
                start, iterations = found[-1], _NEXT_ITERATIONS
            else:
                iterations = _FIRST_ITERATIONS
                start = self.projected(Mapping(self.mesh, values), modes) if self.observes_map else np.zeros((modes, 6))
            problem = NearestMap(self.mesh, self._held.conditions(kept), self._observed)
            found.append(
                problem.coefficients(self._at_tets[:, :modes], start, self.steps(modes), values, iterations)
            )
        return np.stack(found)

    def steps(self, modes: int) -> Floats:
        """(k,) how much coarser each mode may be rounded than the lowest."""
        if self.scheme != "fitted":
            return np.ones(modes)
        every = self.spectrum.eigenvalues
        # As many are 0 as the mesh has parts.
        lowest = min(every[every > _ZERO * every[-1]], default=1.0) if len(every) else 1.0
        eigenvalues = every[:modes]
        return np.asarray(np.sqrt(1.0 + eigenvalues / lowest))

    def rounded(self, targets: Floats, coefficients: Floats, step: float) -> tuple[Compressed, Floats]:
        """Coefficients (F, k, 6) as multiples of a step, and the maps (F, N, 3) that are rebuilt from these.

        Raises
        ------
        InputError
            If the step is too small.
        ReconstructionError
            If a representation is not positive definite, which happens with the scheme ``published``.
        """
        steps = step * self.steps(coefficients.shape[1])[:, None]
        compressed = Compressed(
            self.scheme,
            self.boundary,
            step,
            whole_steps(coefficients / steps, step),
            self.held(targets),
            held_step=self._held.step,
        )
        rebuilt = self.rebuilt(compressed)
        return replace(compressed, check=self._check(rebuilt)), rebuilt

    def rebuilt(self, compressed: Compressed) -> Floats:
        """(F, N, 3) the maps that belong to the numbers, without a remainder.

        Raises
        ------
        InputError
            If there are more modes than this codec has, the boundary belongs to another mesh, or so many maps differ
            that rebuilding them would take too long.
        ReconstructionError
            If a representation is not positive definite, which happens with the scheme ``published``.
        """
        changes = compressed.changes
        if (1 + np.count_nonzero(changes)) * len(self.mesh.tets) > _MOST_WORK:
            raise InputError(
                f"{1 + np.count_nonzero(changes)} different maps of {len(self.mesh.tets)} tetrahedra take too long to "
                f"rebuild; at most {_MOST_WORK // len(self.mesh.tets)} are."
            )
        maps: list[Floats] = []
        for number, place in enumerate(compressed.held):
            if number and not changes[number - 1]:
                maps.append(maps[-1])
            else:
                stretch, conditions = self.stretch(compressed, number), self._held.conditions(place)
                maps.append(reconstruct(self.mesh, stretch, conditions).values)
        return np.stack(maps)

    def restore(self, compressed: Compressed) -> Floats:
        """(F, n, 3) what was compressed, as nearly as the numbers have it; the boundary exactly.

        Raises
        ------
        InputError, ReconstructionError
            As ``rebuilt``, and if this machine rebuilds other maps than the one that compressed them.
        """
        rebuilt = self.rebuilt(compressed)
        if not abs(self._check(rebuilt) - compressed.check) <= _CHECK_TOLERANCE * self.diagonal:
            raise InputError(
                "The maps come out differently than where they were compressed: the file is damaged, or the mesh is so "
                "symmetric that its modes are not unique; compress it without modes, or break the symmetry."
            )
        return self.finished(compressed, rebuilt)

    def finished(self, compressed: Compressed, rebuilt: Floats) -> Floats:
        """(F, n, 3) what is observed of rebuilt maps (F, N, 3), with the remainder."""
        values = self.observe(rebuilt)
        if compressed.remainder is None:
            return values
        if compressed.remainder.shape != values.shape:
            raise InputError("The remainder belongs to another mesh.")
        return np.asarray(values + compressed.remainder_step * compressed.remainder)

    def observe(self, maps: Floats) -> Floats:
        """(F, n, 3) what is to be restored of maps (F, N, 3)."""
        return np.stack([np.asarray(self._observed @ values) for values in maps])

    def with_remainder(self, compressed: Compressed, missed: Floats, step: float) -> Compressed:
        """The same with what is missed, (F, n, 3), as multiples of a step; InputError if that is too small."""
        numbers = whole_steps(np.where(self._kept, 0.0, missed) / step, step)
        return replace(compressed, remainder_step=step, remainder=numbers)

    def stretch(self, compressed: Compressed, number: int) -> Floats:
        """(M, 3, 3) the representation that the numbers of a map stand for."""
        modes = compressed.numbers.shape[1]
        if modes > self.modes:
            raise InputError(f"The maps have {modes} modes; {self.modes} were computed.")
        coefficients = compressed.numbers[number] * (compressed.step * self.steps(modes))[:, None]
        matrices = from_upper_triangle(self._at_tets[:, :modes] @ coefficients / NORM)
        return matrices if compressed.scheme == "published" else exponential(matrices)

    def held(self, targets: Floats) -> Floats:
        """(F, b, 3) images of a fixed boundary; raises InputError for maps that cannot be compressed."""
        return self._held.images(targets) if self.observes_map else np.empty((len(targets), 0, 3))

    def _check(self, rebuilt: Floats) -> float:
        """A sum with signs that no symmetry has."""
        signs = 1.0 - 2.0 * (np.arange(rebuilt.size, dtype=np.uint64) * np.uint64(2654435761) >> np.uint64(16) & 1)
        return float(signs @ rebuilt.ravel() / np.sqrt(rebuilt.size))
